//! Errors as Python exceptions with the same texts as on the command line.

use pyo3::create_exception;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

create_exception!(
    parallax_traces,
    ParallaxError,
    PyValueError,
    "A trace that cannot be read, or a setting that cannot be used. The text is that of the command line."
);

/// The reason why a job failed.
pub enum Failure {
    /// An error of Parallax.
    Own(anyhow::Error),
    /// An exception of the caller's Python code.
    Raised(PyErr),
}

impl<E: Into<anyhow::Error>> From<E> for Failure {
    fn from(error: E) -> Self {
        Self::Own(error.into())
    }
}

impl From<Failure> for PyErr {
    fn from(failure: Failure) -> Self {
        match failure {
            Failure::Own(error) => ParallaxError::new_err(shell::described(&error)),
            Failure::Raised(error) => error,
        }
    }
}
