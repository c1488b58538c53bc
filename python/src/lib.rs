//! The extension module of the Python package `parallax_traces`. It contains the functions that need Rust.
//! The package's Python modules convert their results to tables and data frames, and document them.

mod errors;
mod jobs;
mod lines;
mod orders;
mod policies;
mod replays;
mod tables;

use pyo3::prelude::*;

/// Functions of the package `parallax_traces` written in Rust.
#[pymodule]
mod _native {
    #[pymodule_export]
    use super::errors::ParallaxError;
    #[pymodule_export]
    use super::lines::lines;
    #[pymodule_export]
    use super::orders::{name_order, order_items, pairs};
    #[pymodule_export]
    use super::policies::name_policy;
    #[pymodule_export]
    use super::replays::{config_json, read_settings, result, run, sweep};
    #[pymodule_export]
    use super::tables::{info, raytrace, textrace};

    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
