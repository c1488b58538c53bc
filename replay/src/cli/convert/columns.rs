//! Rows with typed columns: NPY and Parquet, CSV and JSON Lines.

use super::{GranularityName, Target};
use crate::records::{self, Rows};
use anyhow::{Result, bail};
use formats::Trace;
use formats::interop::{
    Access, AccessSink, CsvWriter, GeometryRow, NpyWriter, RayRow, RecordRow, Tabular, child_rows,
    slot_rows,
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

/// Writes the records, rays or samples of a trace, in file order.
pub(super) fn records<R: Tabular, T: Rows<R>>(
    trace: &T,
    to: Target,
    out: &mut (impl Write + Send),
) -> Result<()> {
    rows(to, out, |send| {
        let (mut tile, mut found) = (T::Tile::default(), Vec::new());
        for at in trace.places() {
            trace.append(at, &mut tile, &mut found)?;
            found.drain(..).try_for_each(&mut *send)?;
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

/// Writes the rows of a trace: its records or rays, or the nodes or slots of its hierarchy.
pub(super) fn of_trace(
    trace: &Trace,
    granularity: GranularityName,
    to: Target,
    out: &mut (impl Write + Send),
) -> Result<()> {
    let is_hierarchy = granularity != GranularityName::Record;
    match trace {
        Trace::Texture(trace) if is_hierarchy => bail!(
            "{}: expected a ray trace, because a texture trace has no hierarchy",
            trace.container().file()
        ),
        Trace::Texture(trace) => records::<RecordRow, _>(&**trace, to, out),
        Trace::Ray(trace) if is_hierarchy => {
            let hierarchy = records::hierarchy(trace)?;
            if granularity == GranularityName::Slot {
                return rows(to, out, |send| slot_rows(&hierarchy).try_for_each(send));
            }
            let bvh = &trace.tables().bvh;
            rows(to, out, |send| {
                child_rows(bvh, &hierarchy).try_for_each(send)
            })
        }
        Trace::Ray(trace) if trace.has_geometry() => records::<GeometryRow, _>(&**trace, to, out),
        Trace::Ray(trace) => records::<RayRow, _>(&**trace, to, out),
    }
}
