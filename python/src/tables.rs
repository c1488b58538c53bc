//! Traces as columns. The vectors of the columns become NumPy arrays without copying.

use crate::{errors::Failure, jobs};
use formats::Trace;
use formats::interop::{
    ChildRow, GeometryRow, RayAccess, RayRow, RecordRow, SampleRow, SlotRow, Tabular, Values,
    child_rows, slot_rows,
};
use formats::raytrace::Raytrace;
use formats::textrace::Textrace;
use numpy::PyArray1;
use pyo3::prelude::*;
use replay::records::{self, Rows};
use std::path::PathBuf;

/// Name, names of codes, and values of a column.
type Column<'py> = (&'static str, Vec<&'static str>, Bound<'py, PyAny>);

fn array(py: Python<'_>, values: Values) -> Bound<'_, PyAny> {
    match values {
        Values::U8(values) => PyArray1::from_vec(py, values).into_any(),
        Values::U16(values) => PyArray1::from_vec(py, values).into_any(),
        Values::U32(values) => PyArray1::from_vec(py, values).into_any(),
        Values::U64(values) => PyArray1::from_vec(py, values).into_any(),
        Values::I32(values) => PyArray1::from_vec(py, values).into_any(),
        Values::F32(values) => PyArray1::from_vec(py, values).into_any(),
    }
}

fn columns<'py, R: Tabular>(py: Python<'py>, columns: Vec<Values>) -> Vec<Column<'py>> {
    let fields = R::FIELDS.iter().zip(columns);
    fields
        .map(|(field, values)| (field.name, field.codes.to_vec(), array(py, values)))
        .collect()
}

/// The columns of all rows of a trace.
fn read<R: Tabular, T: Rows<R> + Send + 'static>(
    py: Python<'_>,
    open: impl FnOnce() -> formats::Result<T> + Send + 'static,
) -> PyResult<Vec<Values>> {
    jobs::run(py, |_| Ok(records::columns::<R, T>(&open()?)?))
}

/// The records of a texture trace.
#[pyfunction]
pub fn textrace(py: Python<'_>, path: PathBuf) -> PyResult<Vec<Column<'_>>> {
    let values = read::<RecordRow, _>(py, move || Textrace::open(&path))?;
    Ok(columns::<RecordRow>(py, values))
}

/// The rows of a ray trace: rays, samples, visits, or the children or triangles of its hierarchy.
#[pyfunction]
pub fn raytrace<'py>(py: Python<'py>, path: PathBuf, rows: &str) -> PyResult<Vec<Column<'py>>> {
    let open = move || Raytrace::open(&path);
    match rows {
        "rays" => {
            let (geometry, values) = jobs::run(py, move |_| {
                let trace = open()?;
                Ok(if trace.has_geometry() {
                    (true, records::columns::<GeometryRow, _>(&trace)?)
                } else {
                    (false, records::columns::<RayRow, _>(&trace)?)
                })
            })?;
            Ok(if geometry {
                columns::<GeometryRow>(py, values)
            } else {
                columns::<RayRow>(py, values)
            })
        }
        "samples" => Ok(columns::<SampleRow>(py, read::<SampleRow, _>(py, open)?)),
        "visits" => {
            let values = jobs::run(py, move |_| {
                let trace = open()?;
                if !trace.tables().meta.has_visits {
                    let file = trace.container().file();
                    let text = format!(
                        "{file}: expected a trace with visits (captured with `tracegen rays --visits`), found none"
                    );
                    return Err(Failure::Own(anyhow::anyhow!(text)));
                }
                Ok(records::columns::<RayAccess, _>(&trace)?)
            })?;
            Ok(columns::<RayAccess>(py, values))
        }
        "nodes" => {
            let values = jobs::run(py, move |_| {
                let trace = open()?;
                let hierarchy = records::hierarchy(&trace)?;
                let rows: Vec<ChildRow> = child_rows(&trace.tables().bvh, &hierarchy).collect();
                Ok(records::columns_of(&rows))
            })?;
            Ok(columns::<ChildRow>(py, values))
        }
        "slots" => {
            let values = jobs::run(py, move |_| {
                let hierarchy = records::hierarchy(&open()?)?;
                let rows: Vec<SlotRow> = slot_rows(&hierarchy).collect();
                Ok(records::columns_of(&rows))
            })?;
            Ok(columns::<SlotRow>(py, values))
        }
        _ => {
            let text =
                format!("rows: expected rays, samples, visits, nodes or slots, found {rows:?}");
            Err(Failure::Own(anyhow::anyhow!(text)).into())
        }
    }
}

/// The output of `replay info --json`.
#[pyfunction]
pub fn info(py: Python<'_>, path: PathBuf) -> PyResult<String> {
    jobs::run(py, move |_| {
        Ok(replay::cli::info::to_json(&Trace::open(&path)?)?.to_string())
    })
}
