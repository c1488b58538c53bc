//! The look-ups of a trace in replay order.

use crate::jobs::{self, Traces};
use crate::replays::{Settings, check_orders};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use replay::line_list::line_list;
use std::path::PathBuf;

/// Columns of the look-ups by name.
#[pyfunction]
pub fn lines<'py>(
    py: Python<'py>,
    path: PathBuf,
    settings: Settings,
) -> PyResult<Bound<'py, PyDict>> {
    let list = jobs::run(py, move |stop| {
        let config = settings.config()?;
        let traces = Traces::open(&[path], &stop)?;
        let subject = &traces.subjects()[0];
        check_orders([&config], subject)?;
        Ok(line_list(subject.source, &config)?)
    })?;
    let columns = PyDict::new(py);
    columns.set_item("address", PyArray1::from_vec(py, list.address))?;
    columns.set_item("pass", PyArray1::from_vec(py, list.pass))?;
    columns.set_item("tile", PyArray1::from_vec(py, list.tile))?;
    columns.set_item("eye", PyArray1::from_vec(py, list.eye))?;
    columns.set_item("core", PyArray1::from_vec(py, list.core))?;
    columns.set_item("texture", PyArray1::from_vec(py, list.texture))?;
    columns.set_item("level", PyArray1::from_vec(py, list.level))?;
    Ok(columns)
}
