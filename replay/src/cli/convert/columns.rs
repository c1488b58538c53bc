//! Rows with typed columns: NPY and Parquet, CSV and JSON Lines.

use super::Target;
use crate::records::{self, Rows};
use anyhow::{Result, bail};
use formats::Trace;
use formats::interop::{
    Access, AccessSink, CsvWriter, GeometryRow, NpyWriter, RayRow, RecordRow, SampleRow, Tabular,
    child_rows, slot_rows,
};
use report::rows_parquet::RowsWriter;
use std::io::{self, Write};

/// A receiver of rows.
type Row<'a, R> = &'a mut dyn FnMut(R) -> Result<()>;

/// Passes accesses to a receiver of rows.
pub(super) struct Sink<'a>(pub(super) Row<'a, Access>);

impl AccessSink for Sink<'_> {
    fn write(&mut self, access: &Access) -> io::Result<()> {
        (self.0)(*access).map_err(io::Error::other)
    }
}

/// Writes the rows that `send` passes on. The header of NPY has their number, so `send` is called twice for it.
pub(super) fn rows<R: Tabular>(
    to: Target,
    out: &mut (impl Write + Send),
    send: impl Fn(Row<'_, R>) -> Result<()>,
) -> Result<()> {
    if to == Target::Parquet {
        let mut writer = RowsWriter::new(out)?;
        send(&mut |row| Ok(writer.write(row)?))?;
        writer.finish()?;
        return Ok(());
    }
    if to == Target::Csv {
        let mut csv = CsvWriter::new(out)?;
        return send(&mut |row| Ok(csv.row(&row)?));
    }
    if !to.is_columns() {
        return send(&mut |row| Ok(json_row(&row, out)?));
    }
    let mut count = 0;
    send(&mut |_| {
        count += 1;
        Ok(())
    })?;
    let mut writer = NpyWriter::new(out, count)?;
    send(&mut |row| Ok(writer.write(&row)?))?;
    Ok(writer.finish()?)
}

/// Whether a tile is written, by its pass or eye and its number.
pub(in crate::cli) type Chosen<'a> = &'a dyn Fn(usize, usize) -> bool;

/// Writes the rows of the chosen tiles of a trace, in file order.
fn of_tiles<R: Tabular, T: Rows<R>>(
    trace: &T,
    to: Target,
    out: &mut (impl Write + Send),
    chosen: Chosen<'_>,
) -> Result<()> {
    rows(to, out, |send| {
        let (mut tile, mut found) = (T::Tile::default(), Vec::new());
        for at in trace.places() {
            let (pass, number) = T::place(at);
            if chosen(pass, number) {
                trace.append(at, &mut tile, &mut found)?;
                found.drain(..).try_for_each(&mut *send)?;
            }
        }
        Ok(())
    })
}

/// Writes a row as a line of JSON. Codes are written as names.
fn json_row<R: Tabular>(row: &R, out: &mut impl Write) -> io::Result<()> {
    let mut line = b"{".to_vec();
    for field in R::FIELDS {
        let separator = if line.len() > 1 { "," } else { "" };
        write!(line, "{separator}\"{}\":", field.name)?;
        let begin = line.len();
        field.write_text(row, &mut line)?;
        if line.ends_with(b"NaN") {
            // JSON has no NaN.
            line.truncate(begin);
            line.extend(b"null");
        } else if !field.codes.is_empty() {
            line.insert(begin, b'"');
            line.push(b'"');
        }
    }
    line.extend(b"}\n");
    out.write_all(&line)
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
                child_rows(bvh, &hierarchy).try_for_each(send)
            })
        }
        RowKind::Slot => {
            let hierarchy = records::hierarchy(trace)?;
            rows(to, out, |send| slot_rows(&hierarchy).try_for_each(send))
        }
    }
}
