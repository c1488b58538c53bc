//! The records of each pixel, and whether they explain its colour.

use formats::footprint::{Footprint, SamplingOptions, record_footprints};
use formats::textrace::{NO_GROUP, QuadRecord, Sample, Tables, Textrace, Tile};
use formats::view::Eye;
use std::collections::HashMap;

/// Texel, level and layer that the colour of a pixel encodes; `None` for the background.
pub fn texel_of_color([x, y, level, layer]: [u8; 4]) -> Option<[u32; 4]> {
    let level = u32::from(level.checked_sub(1)?);
    assert_eq!(level % 30, 0, "no colour of a texel");
    Some([
        x.into(),
        y.into(),
        level / 30,
        (255 - u32::from(layer)) / 40,
    ])
}

/// A record of one lane with its operands and its draw.
#[derive(Clone, Copy)]
pub struct Last {
    pub draw: u32,
    pub record: QuadRecord,
    operands: Option<QuadRecord>,
}

/// All records of each pixel of an eye's picture, in trace order.
pub fn records(trace: &Textrace, eye: Eye) -> HashMap<[usize; 2], Vec<Last>> {
    let mut found: HashMap<[usize; 2], Vec<Last>> = HashMap::new();
    let mut tile = Tile::default();
    let passes = trace.tables().passes.iter().enumerate();
    for (pass, of) in passes.filter(|(_, of)| of.eye == Some(eye)) {
        for index in 0..of.tile_count() {
            trace
                .decode_tile(pass, index as usize, &mut tile)
                .expect("a tile");
            let corner = [index % of.tiles[0], index / of.tiles[0]].map(|at| 16 * at as usize);
            for run in &tile.runs {
                let of_run = run.first as usize..(run.first + run.count) as usize;
                for (record, before) in formats::textrace::with_operands(&tile.records[of_run]) {
                    for lane in (0..4).filter(|lane| record.mask >> lane & 1 == 1) {
                        let pixel = [
                            corner[0] + 2 * usize::from(record.x) + lane % 2,
                            corner[1] + 2 * usize::from(record.y) + lane / 2,
                        ];
                        let record = QuadRecord {
                            mask: 1 << lane,
                            ..*record
                        };
                        found.entry(pixel).or_default().push(Last {
                            draw: run.draw,
                            record,
                            operands: before.copied(),
                        });
                    }
                }
            }
        }
    }
    found
}

/// Footprints of a record whose coordinates are moved by some steps of 1/2048 texel.
pub fn reads(tables: &Tables, last: &Last, by: [i32; 2]) -> Vec<(Sample, Footprint)> {
    let mut record = last.record;
    record.uv = [0, 1].map(|axis| record.uv[axis] + by[axis]);
    let mut found = Vec::new();
    let options = SamplingOptions::default();
    let add = |sample: &Sample, footprint| found.push((*sample, footprint));
    record_footprints(
        tables,
        last.draw,
        &record,
        last.operands.as_ref(),
        &options,
        add,
    );
    found
}

/// Whether the pixel shows a texel that the record reads. Coordinates are rounded to 1/2048 texel, so a
/// coordinate near a texel's edge may be on either side; so may a level.
pub fn explains_pixel(tables: &Tables, last: &Last, object: &str, pixel: [u8; 4]) -> bool {
    const STEPS: [i32; 3] = [0, -2, 2];
    let moves = STEPS
        .iter()
        .flat_map(|u| STEPS.iter().map(move |v| [*u, *v]));
    let mut all = moves.map(|by| reads(tables, last, by));
    match object {
        // The components are the columns of the four texels, starting at the lower left one.
        "gather" => all.any(|reads| {
            reads.iter().any(|(_, f)| {
                let columns = [f.i[0], f.i[1], f.i[1], f.i[0]].map(|i| i as u8);
                columns == pixel
            })
        }),
        // Texels of the border are black.
        "border" if pixel == [0; 4] => all.any(|reads| reads.is_empty()),
        _ => {
            let Some([x, y, level, layer]) = texel_of_color(pixel) else {
                return last.record.group == NO_GROUP;
            };
            all.any(|reads| {
                reads.iter().any(|(_, f)| {
                    let at = [f.i[0], f.j[0], f.level.into(), f.layer.into()];
                    at == [x, y, level, layer] && f.texels().count() == 1
                })
            })
        }
    }
}
