//! The Python package `parallax`.
use pyo3::prelude::*;

#[pymodule]
mod _native {}
