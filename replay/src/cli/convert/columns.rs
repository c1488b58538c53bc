//! Rows with typed columns: NPY and Parquet, CSV and JSON Lines.

use super::{GranularityName, Target};
use crate::records::{self, Rows};
use anyhow::{Result, bail};
use formats::Trace;
use formats::interop::{
    Access, AccessSink, Field, GeometryRow, Get, NpyWriter, RayRow, RecordRow, Tabular, child_rows,
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
        let names: Vec<&str> = R::FIELDS.iter().map(|field| field.name).collect();
        writeln!(out, "{}", names.join(","))?;
    }
    if !to.is_columns() {
        return send(&mut |row| Ok(text_row(to, &row, out)?));
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

/// Writes a row as a line of CSV or JSON. Codes are written as names.
fn text_row<R: Tabular>(to: Target, row: &R, out: &mut impl Write) -> io::Result<()> {
    let values = R::FIELDS.iter().map(|field| (field, text(field, row)));
    if to == Target::Csv {
        let texts: Vec<String> = values
            .map(|(_, text)| text.unwrap_or_else(|| "NaN".to_owned()))
            .collect();
        return writeln!(out, "{}", texts.join(","));
    }
    let pairs: Vec<String> = values
        .map(|(field, text)| {
            // JSON has no NaN.
            let text = text.unwrap_or_else(|| "null".to_owned());
            let quote = if field.codes.is_empty() { "" } else { "\"" };
            format!("\"{}\":{quote}{text}{quote}", field.name)
        })
        .collect();
    writeln!(out, "{{{}}}", pairs.join(","))
}

/// A value as text in its shortest form; `None` for a number that is not finite.
fn text<R: Tabular>(field: &Field<R>, row: &R) -> Option<String> {
    let number = match &field.get {
        Get::U8(get) => match field.codes.get(usize::from(get(row))) {
            Some(name) => (*name).to_owned(),
            None => get(row).to_string(),
        },
        Get::U16(get) => get(row).to_string(),
        Get::U32(get) => get(row).to_string(),
        Get::U64(get) => get(row).to_string(),
        Get::I32(get) => get(row).to_string(),
        Get::F32(get) if !get(row).is_finite() => return None,
        Get::F32(get) => serde_json::to_string(&get(row)).ok()?,
    };
    Some(number)
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
