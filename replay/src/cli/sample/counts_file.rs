//! Counts by frame, order and caches as CSV (`--save-values`, `--values`).

use crate::files;
use anyhow::{Context, Result, bail, ensure};
use std::path::Path;
use studies::sampling::points::Points;
use studies::sampling::values::FrameCounts;

const HEADINGS: [&str; 9] = [
    "caches",
    "order",
    "frame",
    "external_bytes",
    "footprints",
    "l1_footprint_misses",
    "l2_line_lookups",
    "l2_line_misses",
    "cycles",
];

/// Writes the counts of all points.
///
/// # Errors
/// The file cannot be written.
pub(super) fn write(path: &Path, points: &Points) -> Result<()> {
    let mut text = HEADINGS.join(",") + "\n";
    for point in &points.points {
        for (frame, c) in &point.values {
            let counts = [
                c.external_bytes,
                c.footprints,
                c.l1_footprint_misses,
                c.l2_line_lookups,
                c.l2_line_misses,
                c.cycles,
            ];
            let counts = counts.map(|count| count.to_string()).join(",");
            let order = point.config.order.name();
            text += &format!("{},{order},{frame},{counts}\n", point.caches);
        }
    }
    files::write_atomically(path, text.as_bytes())
}

/// Reads the counts of the points that are asked for; rows of others are left out.
///
/// # Errors
/// An unreadable file, or a line that is none.
pub(super) fn read(path: &Path, points: &mut Points) -> Result<()> {
    let name = || path.display().to_string();
    let mut lines = csv::Reader::from_path(path).with_context(name)?;
    let found: Vec<&str> = lines.headers().with_context(name)?.iter().collect();
    ensure!(
        found == HEADINGS,
        "{}: line 1: expected {}, found {}",
        path.display(),
        HEADINGS.join(","),
        found.join(",")
    );
    for line in lines.records() {
        let line = line.with_context(name)?;
        let number = line.position().map_or(0, csv::Position::line);
        let row = line.deserialize(None);
        let Ok((caches, order, frame, counts)) = row as csv::Result<(&str, &str, u32, FrameCounts)>
        else {
            let found: Vec<&str> = line.iter().collect();
            bail!(
                "{}: line {number}: expected caches, order, frame and six counts, found {}",
                path.display(),
                found.join(",")
            );
        };
        let mut all = points.points.iter_mut();
        if let Some(point) = all.find(|p| p.caches == caches && p.config.order.name() == order) {
            point.values.insert(frame, counts);
        }
    }
    Ok(())
}
