//! Pictures of the work that a technique skipped, next to its image error.

use super::pictures::reference;
use super::{Folder, PictureFigures};
use formats::textrace::{PassKind, QuadRecord, Tile};
use formats::view::{Eye, TILE_SIZE_PX};
use image_error::Picture;
use sim::stream::{StreamError, TileSource};

/// Colour of skipped work.
const TINT: [f64; 3] = [213.0, 94.0, 0.0];
/// Brightness of pixels outside the visible area.
const UNSEEN: f64 = 0.45;
const GAP_PX: u32 = 4;

/// The worst picture of a technique: the picture, its FLIP map, and the skipped work as a tint.
#[derive(Clone, Debug)]
pub struct Difference {
    /// Index of the row in the manifest.
    pub row: usize,
    /// Number of the frame.
    pub frame: u32,
    /// Eye.
    pub eye: Eye,
    /// The three pictures.
    pub picture: Picture,
    /// Fragments shaded over the baseline's, in percent, if both traces show whole pictures. The tint is
    /// then by tile, otherwise by the error of each pixel.
    pub shaded_pct: Option<f64>,
}

/// The difference pictures of a folder, for all rows whose pictures or fragments differ from the
/// baseline's. `figures` and `traces` have one entry per row. For a row with a trace, the picture is the
/// worst of the trace's frames.
///
/// # Errors
/// A picture or a trace that cannot be read.
pub fn differences(
    folder: &Folder,
    figures: &[PictureFigures],
    traces: &[Option<&dyn TileSource>],
) -> anyhow::Result<Vec<Difference>> {
    let manifest = &folder.manifest;
    let rows = &manifest.rows;
    let Some(baseline) = rows.iter().position(|r| r.technique == manifest.baseline) else {
        return Ok(Vec::new());
    };
    let mut out = Vec::new();
    for (row, figures) in figures.iter().enumerate() {
        if row == baseline {
            continue;
        }
        let (frame, eye) = worst(figures, folder, traces[row].is_some().then_some(row));
        let shaded = match (traces[baseline], traces[row]) {
            (Some(expected), Some(found)) => {
                let number = manifest.frames[frame];
                let of = |source| shaded_by_tile(source, number, eye, manifest.size_px);
                of(expected)?.zip(of(found)?)
            }
            _ => None,
        };
        let unchanged = shaded.as_ref().is_none_or(|(a, b)| a == b);
        if figures.identical_pct == 100.0 && unchanged {
            continue;
        }
        let expected = folder.picture_file(baseline, frame, eye)?.decode()?;
        let found = folder.picture_file(row, frame, eye)?.decode()?;
        let reference = reference(folder, expected, eye);
        // Decoded pictures have the manifest's size.
        let Ok(map) = reference.flip_map(&found) else {
            continue;
        };
        let skipped = match &shaded {
            Some((expected, found)) => by_tile(manifest.size_px, expected, found),
            None => map.errors.iter().map(|e| f64::from(e.sqrt())).collect(),
        };
        let tinted = tinted(&found, &skipped, &reference.mask().inside);
        let sum = |tiles: &[f64]| tiles.iter().sum::<f64>();
        out.push(Difference {
            row,
            frame: manifest.frames[frame],
            eye,
            picture: Picture::side_by_side(&[&found, &map.picture(), &tinted], GAP_PX),
            shaded_pct: shaded.map(|(expected, found)| 100.0 * sum(&found) / sum(&expected)),
        });
    }
    Ok(out)
}

/// Index of the frame and the eye of a row's worst picture; among the frames of its trace if `traced`.
fn worst(figures: &PictureFigures, folder: &Folder, traced: Option<usize>) -> (usize, Eye) {
    let numbers = &folder.manifest.frames;
    let in_trace: Vec<usize> = traced
        .map(|row| &folder.manifest.rows[row].trace_frames)
        .into_iter()
        .flatten()
        .filter_map(|number| numbers.iter().position(|n| n == number))
        .collect();
    if in_trace.is_empty() || in_trace.contains(&figures.worst_frame) {
        return (figures.worst_frame, figures.worst_eye);
    }
    let error = |frame: &usize| figures.by_frame[*frame];
    let frames = in_trace.into_iter().rev();
    let frame = frames.max_by(|a, b| error(a).total_cmp(&error(b)));
    (frame.unwrap_or(figures.worst_frame), figures.worst_eye)
}

/// Fragments of an eye's picture of a frame in each 16x16 tile, row by row. `None` if a pass shows a part
/// of the picture at a place that the trace does not record.
fn shaded_by_tile(
    source: &dyn TileSource,
    frame: u32,
    eye: Eye,
    size_px: [u32; 2],
) -> Result<Option<Vec<f64>>, StreamError> {
    let tiles = size_px.map(|size| size.div_ceil(TILE_SIZE_PX));
    let mut out = vec![0.0; tiles[0] as usize * tiles[1] as usize];
    let mut tile = Tile::default();
    for (index, pass) in source.tables().passes.iter().enumerate() {
        let of_eye = pass.eye.is_none_or(|of| of == eye);
        if pass.frame != frame || pass.kind == PassKind::Shadow || !of_eye {
            continue;
        }
        let coarser = |axis: usize| {
            [1, 2, 4]
                .into_iter()
                .find(|rate| pass.size_px[axis] == size_px[axis].div_ceil(*rate))
        };
        let (Some(across), Some(down)) = (coarser(0), coarser(1)) else {
            return Ok(None);
        };
        for number in 0..pass.tile_count() {
            source.read_tile(index as u32, number, &mut tile)?;
            let at = [number % pass.tiles[0], number / pass.tiles[0]];
            // A tile of a coarser pass covers several tiles of the picture.
            let share = f64::from(lanes(&tile)) / f64::from(across * down);
            for y in at[1] * down..((at[1] + 1) * down).min(tiles[1]) {
                for x in at[0] * across..((at[0] + 1) * across).min(tiles[0]) {
                    out[(y * tiles[0] + x) as usize] += share;
                }
            }
        }
    }
    Ok(Some(out))
}

/// Covered lanes of a tile; a quad with records for several groups of textures counts once.
fn lanes(tile: &Tile) -> u32 {
    let runs = tile.runs.iter();
    let of_run = |run: &formats::textrace::PrimitiveRun| -> u32 {
        let first = run.first as usize;
        let records = tile.records.get(first..first + run.count as usize);
        let quads = records.unwrap_or_default();
        let quads = quads.chunk_by(|a, b| (a.x, a.y) == (b.x, b.y));
        let mask = |quad: &[QuadRecord]| quad.iter().fold(0, |all, r| all | r.mask & 15);
        quads.map(|quad| mask(quad).count_ones()).sum()
    };
    runs.map(of_run).sum()
}

/// Share of the baseline's fragments that was skipped, by pixel.
fn by_tile(size_px: [u32; 2], expected: &[f64], found: &[f64]) -> Vec<f64> {
    let columns = size_px[0].div_ceil(TILE_SIZE_PX);
    let pixels = (0..size_px[1]).flat_map(|y| (0..size_px[0]).map(move |x| (x, y)));
    let skipped = |(x, y): (u32, u32)| {
        let tile = (y / TILE_SIZE_PX * columns + x / TILE_SIZE_PX) as usize;
        match expected[tile] {
            0.0 => 0.0,
            all => (1.0 - found[tile] / all).clamp(0.0, 1.0),
        }
    };
    pixels.map(skipped).collect()
}

fn tinted(picture: &Picture, skipped: &[f64], seen: &[bool]) -> Picture {
    let mut out = picture.clone();
    for ((pixel, share), seen) in out.pixels.iter_mut().zip(skipped).zip(seen) {
        let tint = 0.75 * share;
        let light = if *seen { 1.0 } else { UNSEEN };
        for (channel, tone) in pixel.iter_mut().zip(TINT) {
            let mixed = f64::from(*channel) * light * (1.0 - tint) + tone * tint;
            *channel = mixed.round() as u8;
        }
    }
    out
}
