//! Strict CSV: a known header, and finite numbers in ascending order of time.

use crate::SceneError;
use crate::files::Origin;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// Most bytes of a file: some 200,000 poses, or 46 minutes at 72 Hz.
pub(super) const MAX_BYTES: u64 = 16 << 20;

/// Largest distance of a time from 0. Beyond it, milliseconds are not representable.
const MAX_TIME_S: f64 = 1e12;

/// One line of the file.
pub(super) struct Row<const N: usize> {
    /// Line number from 1.
    pub line: usize,
    /// Its numbers; the first is the time in seconds.
    pub values: [f64; N],
}

/// Reads a file whose first line is exactly `columns`. Every other line must have as many finite
/// numbers, and times must ascend. A byte order mark, CRLF and trailing blank lines are accepted.
/// There is at least one row.
pub(super) fn read<const N: usize>(
    file: &Path,
    columns: [&str; N],
) -> Result<Vec<Row<N>>, SceneError> {
    let origin = Origin::new(file);
    let text = read_text(file, &origin)?;
    let text = text.strip_prefix('\u{feff}').unwrap_or(&text).trim_end();
    let mut lines = (1..).zip(text.lines());
    let header = lines.next().map_or("", |(_, line)| line.trim());
    if !header.split(',').map(str::trim).eq(columns) {
        return Err(origin.invalid("line 1", format!("'{}'", columns.join(",")), quoted(header)));
    }
    let mut rows: Vec<Row<N>> = Vec::new();
    for (line, text) in lines {
        let values = numbers(&origin, line, text, columns)?;
        let time = values.first().copied().unwrap_or_default();
        let before = rows.last().and_then(|row| row.values.first());
        let place = || format!("line {line}, column {}", columns[0]);
        if time.abs() > MAX_TIME_S {
            let expected = format!("a time of at most {MAX_TIME_S} s");
            return Err(origin.invalid(place(), expected, format!("{time}")));
        }
        if let Some(before) = before.filter(|before| time <= **before) {
            let expected = format!("a time after the line before's, {before}");
            return Err(origin.invalid(place(), expected, format!("{time}")));
        }
        rows.push(Row { line, values });
    }
    if rows.is_empty() {
        return Err(origin.invalid(
            "line 2",
            "at least one row of numbers",
            "the end of the file",
        ));
    }
    Ok(rows)
}

/// The text of a file of at most [`MAX_BYTES`]. Pipes are read as well.
fn read_text(file: &Path, origin: &Origin) -> Result<String, SceneError> {
    let failed = |reason| SceneError::Io {
        file: file.to_owned(),
        place: "path".to_owned(),
        reason,
    };
    let mut bytes = Vec::new();
    let opened = File::open(file).map_err(failed)?;
    opened
        .take(MAX_BYTES + 1)
        .read_to_end(&mut bytes)
        .map_err(failed)?;
    if bytes.len() as u64 > MAX_BYTES {
        return Err(origin.invalid("file", format!("at most {MAX_BYTES} bytes"), "more"));
    }
    String::from_utf8(bytes).map_err(|e| {
        let at = e.utf8_error().valid_up_to();
        origin.invalid(format!("byte {at}"), "UTF-8 text", "other bytes")
    })
}

fn numbers<const N: usize>(
    origin: &Origin,
    line: usize,
    text: &str,
    columns: [&str; N],
) -> Result<[f64; N], SceneError> {
    let mut values = [0.0; N];
    let mut fields = text.split(',');
    for (value, column) in values.iter_mut().zip(columns) {
        let place = || format!("line {line}, column {column}");
        let Some(field) = fields.next().map(str::trim) else {
            return Err(origin.invalid(place(), "a number", "the end of the line"));
        };
        *value = match field.parse::<f64>() {
            Ok(number) if number.is_finite() => number,
            _ => return Err(origin.invalid(place(), "a finite number", quoted(field))),
        };
    }
    match fields.count() {
        0 => Ok(values),
        more => Err(origin.invalid(
            format!("line {line}"),
            format!("{N} columns"),
            format!("{}", N + more),
        )),
    }
}

fn quoted(text: &str) -> String {
    format!("'{text}'")
}
