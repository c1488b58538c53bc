//! Rows in every form: NPY, Parquet, CSV, JSON Lines and, for accesses, the forms of other simulators.

use super::Target;
use crate::records::{self, Rows};
use anyhow::{Result, bail};
use formats::Trace;
use formats::interop::plain::PlainWriter;
use formats::interop::{
    CsvWriter, GeometryRow, NpyWriter, RayRow, RecordRow, SampleRow, Tabular, child_rows,
    slot_rows, write_json_line,
};
use report::rows_parquet::RowsWriter;
use std::io::{self, Write};

/// A receiver of rows.
pub(super) type Row<'a, R> = &'a mut dyn FnMut(&R) -> io::Result<()>;

/// Writes the rows that `send` passes on. The header of NPY has their number, so `send` is called twice for it.
pub(super) fn rows<R: Tabular + Copy>(
    to: Target,
    out: &mut (impl Write + Send),
    send: impl Fn(Row<'_, R>) -> Result<()>,
) -> Result<()> {
    if let Some(form) = to.plain() {
        let mut writer = PlainWriter::new(form, out)?;
        return send(&mut |row| row.plain().map_or(Ok(()), |access| writer.access(&access)));
    }
    match to {
        Target::Parquet => {
            let mut writer = RowsWriter::new(out)?;
            send(&mut |row: &R| writer.write(*row).map_err(io::Error::other))?;
            writer.finish()?;
        }
        Target::Npy => {
            let mut count = 0;
            send(&mut |_| {
                count += 1;
                Ok(())
            })?;
            let mut writer = NpyWriter::new(out, count)?;
            send(&mut |row| writer.write(row))?;
            writer.finish()?;
        }
        Target::Csv => {
            let mut writer = CsvWriter::new(out)?;
            send(&mut |row| writer.write(row))?;
        }
        _ => send(&mut |row| write_json_line(row, out))?,
    }
    Ok(())
}

/// Whether a tile is written, by its pass or eye and its number.
pub(in crate::cli) type Chosen<'a> = &'a dyn Fn(usize, usize) -> bool;

/// Writes the rows of the chosen tiles of a trace, in file order.
fn of_tiles<R: Tabular + Copy, T: Rows<R>>(
    trace: &T,
    to: Target,
    out: &mut (impl Write + Send),
    chosen: Chosen<'_>,
) -> Result<()> {
    rows(to, out, |send| {
        let (mut tile, mut found) = (T::Content::default(), Vec::new());
        for at in trace.places() {
            let (pass, number) = T::numbers(at);
            if chosen(pass, number) {
                trace.append(at, &mut tile, &mut found)?;
                found.iter().try_for_each(&mut *send)?;
                found.clear();
            }
        }
        Ok(())
    })
}

/// Rows of a trace.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::cli) enum RowKind {
    /// Records or rays.
    Record,
    /// Samples of pixels of a ray trace.
    Sample,
    /// Children of the inner nodes of the hierarchy.
    Node,
    /// Slots of the hierarchy.
    Slot,
}

/// Writes the rows of a trace: those of the chosen tiles, or all of the hierarchy.
pub(in crate::cli) fn of_trace(
    trace: &Trace,
    kind: RowKind,
    to: Target,
    out: &mut (impl Write + Send),
    chosen: Chosen<'_>,
) -> Result<()> {
    let trace = match (trace, kind) {
        (Trace::Texture(trace), RowKind::Record) => {
            return of_tiles::<RecordRow, _>(&**trace, to, out, chosen);
        }
        (Trace::Texture(trace), _) => bail!(
            "{}: expected a ray trace, because a texture trace has no hierarchy",
            trace.container().file()
        ),
        (Trace::Ray(trace), _) => &**trace,
    };
    match kind {
        RowKind::Record if trace.has_geometry() => {
            of_tiles::<GeometryRow, _>(trace, to, out, chosen)
        }
        RowKind::Record => of_tiles::<RayRow, _>(trace, to, out, chosen),
        RowKind::Sample => of_tiles::<SampleRow, _>(trace, to, out, chosen),
        RowKind::Node => {
            let (bvh, hierarchy) = (&trace.tables().bvh, records::hierarchy(trace)?);
            rows(to, out, |send| {
                Ok(child_rows(bvh, &hierarchy).try_for_each(|row| send(&row))?)
            })
        }
        RowKind::Slot => {
            let hierarchy = records::hierarchy(trace)?;
            rows(to, out, |send| {
                Ok(slot_rows(&hierarchy).try_for_each(|row| send(&row))?)
            })
        }
    }
}
