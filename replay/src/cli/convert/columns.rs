//! Output forms with typed columns: NPY and Parquet.

use super::Target;
use crate::records::Rows;
use crate::report::rows_parquet::RowsWriter;
use anyhow::Result;
use formats::interop::{Access, AccessSink, NpyWriter, Tabular};
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
