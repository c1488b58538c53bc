//! JSON Lines: one object per row.

use super::Origin;
use super::columns::Tabular;
use crate::textrace::{NO_GROUP, QuadRecord};
use serde_json::{Value, json};
use std::io::{self, Write};

/// Writes a row as a line of JSON: codes as names, numbers that are not finite as null.
///
/// # Errors
/// Errors of the underlying writer.
pub fn write_json_line<R: Tabular>(row: &R, out: &mut impl Write) -> io::Result<()> {
    let mut line = b"{".to_vec();
    for field in R::FIELDS {
        let separator = if line.len() > 1 { "," } else { "" };
        write!(line, "{separator}\"{}\":", field.name)?;
        let begin = line.len();
        field.write_text(row, &mut line)?;
        if line.ends_with(b"NaN") {
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

/// A quad record as `replay dump` prints it, with the stored fixed-point numbers.
pub fn record_to_json(origin: Origin, record: &QuadRecord) -> Value {
    let group = Some(record.group).filter(|group| *group != NO_GROUP);
    json!({
        "pass": origin.pass,
        "tile": origin.tile,
        "draw": origin.draw,
        "primitive": origin.primitive,
        "x": record.x,
        "y": record.y,
        "mask": record.mask,
        "group": group,
        "uv": record.uv,
        "dx": record.dx,
        "dy": record.dy,
        "cross": record.cross,
    })
}
