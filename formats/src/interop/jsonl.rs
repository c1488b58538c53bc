//! JSON Lines: one object per access or per record.

use super::{Access, AccessSink, Origin};
use crate::textrace::{NO_GROUP, QuadRecord};
use serde_json::{Value, json};
use std::io::{self, Write};

/// Writes JSON Lines.
#[derive(Debug)]
pub struct JsonlWriter<W>(pub W);

impl<W: Write> AccessSink for JsonlWriter<W> {
    fn write(&mut self, access: &Access) -> io::Result<()> {
        serde_json::to_writer(&mut self.0, access)?;
        self.0.write_all(b"\n")
    }
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
