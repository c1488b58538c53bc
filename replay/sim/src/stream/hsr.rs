//! Hidden-surface removal: selects the fragments of a trace that a renderer shades.
//!
//! A trace holds, in submission order, either the fragments that passed the depth test when drawn, or all
//! covered fragments. Without depth, one cannot be derived from the other. A deferred renderer first
//! determines what is visible in a tile and then shades it. Per pixel it shades the last opaque fragment,
//! which lies in front of all earlier ones, and the alpha-masked and blended fragments drawn after it,
//! whose visibility only shading determines.

use super::{StreamError, TileSource};
use crate::config::Hsr;
use formats::textrace::{QuadRecord, Surfaces, Tables, Tile};
use formats::view::TILE_SIZE_PX;

/// Pixels per tile edge.
const EDGE: usize = TILE_SIZE_PX as usize;

/// The trace as shaded by a renderer with this hidden-surface removal; unchanged if it was captured that way.
///
/// # Errors
/// The trace does not hold the fragments that the removal needs.
pub fn shaded<'a>(source: &'a dyn TileSource, hsr: Hsr) -> Result<Shaded<'a>, StreamError> {
    let refused = |expected: &str, found: &str| {
        StreamError::Tables(format!("hsr: expected {expected}, found {found}"))
    };
    let surfaces = source.tables().meta.surfaces.as_ref();
    let tested = surfaces.is_none_or(|s| s.depth_tested);
    let hidden = match (hsr, tested) {
        (Hsr::None, true) => Err(refused(
            "early-z or deferred, because the trace was captured with the depth test (for none, capture with --hsr none)",
            "none",
        )),
        (Hsr::None, false) | (Hsr::EarlyZ, true) => Ok(None),
        (Hsr::EarlyZ | Hsr::Deferred, false) => Err(refused(
            "none, because the trace was captured without the depth test and holds no depths (for the others, capture without --hsr none)",
            if hsr == Hsr::EarlyZ {
                "early-z"
            } else {
                "deferred"
            },
        )),
        (Hsr::Deferred, true) => match surfaces {
            Some(surfaces) => Ok(Some(opaque_draws(surfaces, source.tables().draws.len()))),
            None => Err(refused(
                "early-z, because the trace does not record which draws are opaque (capture it again)",
                "deferred",
            )),
        },
    };
    hidden.map(|opaque| Shaded { source, opaque })
}

/// By draw, whether it is opaque, so that its fragments hide what lies behind without being shaded.
fn opaque_draws(surfaces: &Surfaces, draws: usize) -> Vec<bool> {
    let mut opaque = vec![true; draws];
    for &[first, count] in &surfaces.not_opaque {
        let end = (first as usize).saturating_add(count as usize);
        let range = (first as usize).min(draws)..end.min(draws);
        opaque[range].fill(false);
    }
    opaque
}

/// See [`shaded`].
pub struct Shaded<'a> {
    source: &'a dyn TileSource,
    /// Present for deferred rendering: whether each draw is opaque.
    opaque: Option<Vec<bool>>,
}

impl TileSource for Shaded<'_> {
    fn tables(&self) -> &Tables {
        self.source.tables()
    }

    fn records(&self) -> u64 {
        self.source.records()
    }

    fn read_tile(&self, pass: u32, index: u32, tile: &mut Tile) -> Result<(), StreamError> {
        self.source.read_tile(pass, index, tile)?;
        if let Some(opaque) = &self.opaque {
            defer(tile, opaque);
        }
        Ok(())
    }
}

/// Index of the pixel of a record's lane in its tile.
fn pixel(record: &QuadRecord, lane: usize) -> usize {
    let at = |quad: u8, bit: usize| (2 * usize::from(quad & 7)) + bit;
    at(record.y, lane >> 1) * EDGE + at(record.x, lane & 1)
}

fn lanes(mask: u8) -> impl Iterator<Item = usize> {
    (0..4).filter(move |lane| mask >> lane & 1 != 0)
}

/// Keeps the last opaque fragment of each pixel and the fragments drawn after it. Invalid runs and unknown
/// draws stay unchanged; the reader of the tile refuses them.
fn defer(tile: &mut Tile, opaque: &[bool]) {
    // Per pixel, the last run (counted from 1) with an opaque fragment.
    let mut last = [0usize; EDGE * EDGE];
    let records = |tile: &Tile, run: usize| {
        let run = tile.runs[run];
        let first = run.first as usize;
        first
            ..first
                .saturating_add(run.count as usize)
                .min(tile.records.len())
                .max(first)
    };
    let fits = |tile: &Tile, run: usize| {
        let whole = tile.runs[run];
        let end = u64::from(whole.first) + u64::from(whole.count);
        end <= tile.records.len() as u64 && (whole.draw as usize) < opaque.len()
    };
    if !(0..tile.runs.len()).all(|run| fits(tile, run)) {
        return;
    }
    for run in 0..tile.runs.len() {
        if opaque[tile.runs[run].draw as usize] {
            for record in &tile.records[records(tile, run)] {
                for lane in lanes(record.mask) {
                    last[pixel(record, lane)] = run + 1;
                }
            }
        }
    }
    let mut kept = 0;
    for run in 0..tile.runs.len() {
        let is_opaque = opaque[tile.runs[run].draw as usize];
        let first = kept;
        for index in records(tile, run) {
            let mut record = tile.records[index];
            for lane in lanes(record.mask) {
                let over = last[pixel(&record, lane)];
                let seen = if is_opaque {
                    over == run + 1
                } else {
                    over <= run
                };
                if !seen {
                    record.mask &= !(1 << lane);
                }
            }
            if record.mask != 0 {
                // The write position never passes the read position.
                tile.records[kept] = record;
                kept += 1;
            }
        }
        tile.runs[run].first = first as u32;
        tile.runs[run].count = (kept - first) as u32;
    }
    tile.records.truncate(kept);
    tile.runs.retain(|run| run.count > 0);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stream::MemoryTrace;
    use crate::stream::testing::{record, tables};
    use formats::textrace::PrimitiveRun;
    use proptest::prelude::*;
    use std::collections::HashMap;

    /// A primitive: its draw, and its quads with their masks.
    type Primitive = (u32, Vec<(u8, u8, u8)>);

    fn tile(primitives: &[Primitive]) -> Tile {
        let mut tile = Tile::default();
        for (number, (draw, quads)) in primitives.iter().enumerate() {
            tile.runs.push(PrimitiveRun {
                primitive: number as u32,
                draw: *draw,
                first: tile.records.len() as u32,
                count: quads.len() as u32,
            });
            tile.records
                .extend(quads.iter().map(|&(x, y, mask)| QuadRecord {
                    mask,
                    ..record(x, y)
                }));
        }
        tile
    }

    /// The fragments of a tile, as pixel and primitive.
    fn fragments(tile: &Tile) -> Vec<(usize, u32)> {
        let of = |run: &PrimitiveRun| {
            let records = &tile.records[run.first as usize..][..run.count as usize];
            let all = records
                .iter()
                .flat_map(|r| lanes(r.mask).map(|lane| pixel(r, lane)));
            all.map(|pixel| (pixel, run.primitive)).collect::<Vec<_>>()
        };
        let mut all: Vec<_> = tile.runs.iter().flat_map(of).collect();
        all.sort_unstable();
        all
    }

    /// Per pixel, the list of fragments without those before the last opaque one.
    fn brute_force(primitives: &[Primitive], opaque: &[bool]) -> Vec<(usize, u32)> {
        let mut pixels: HashMap<(usize, usize), Vec<u32>> = HashMap::new();
        for (number, (_, quads)) in primitives.iter().enumerate() {
            for (x, y, mask) in quads {
                for lane in 0..4 {
                    if mask & (1 << lane) != 0 {
                        let at = (
                            usize::from(*x) * 2 + lane % 2,
                            usize::from(*y) * 2 + lane / 2,
                        );
                        pixels.entry(at).or_default().push(number as u32);
                    }
                }
            }
        }
        let mut all = Vec::new();
        for ((x, y), list) in pixels {
            let is_opaque = |number: &u32| opaque[primitives[*number as usize].0 as usize];
            let from = list.iter().rposition(is_opaque).unwrap_or(0);
            all.extend(list[from..].iter().map(|number| (y * 16 + x, *number)));
        }
        all.sort_unstable();
        all
    }

    fn primitives() -> impl Strategy<Value = Vec<Primitive>> {
        let quad = (0..8u8, 0..8u8, 1..16u8);
        let quads = prop::collection::vec(quad, 1..20).prop_map(|mut quads| {
            // A primitive covers a quad at most once.
            quads.sort_unstable();
            quads.dedup_by_key(|quad| (quad.0, quad.1));
            quads
        });
        prop::collection::vec((0..3u32, quads), 0..20)
    }

    proptest! {
        #[test]
        fn remaining_fragments_are_the_visible_ones_of_each_pixel(list in primitives()) {
            for opaque in [[true, true, true], [true, false, true], [false, false, false]] {
                let mut found = tile(&list);
                defer(&mut found, &opaque);
                prop_assert_eq!(fragments(&found), brute_force(&list, &opaque));
                prop_assert!(found.runs.iter().all(|run| run.count > 0));
                let records: u32 = found.runs.iter().map(|run| run.count).sum();
                prop_assert_eq!(records as usize, found.records.len());
            }
        }
    }

    #[test]
    fn opaque_draws_leave_one_fragment_per_pixel() {
        let all = (0..8)
            .flat_map(|y| (0..8).map(move |x| (x, y, 15)))
            .collect::<Vec<_>>();
        let mut found = tile(&[(0, all.clone()), (1, all.clone()), (0, all)]);
        defer(&mut found, &[true, true]);
        assert_eq!(fragments(&found).len(), 256);
        assert_eq!((found.runs.len(), found.runs[0].primitive), (1, 2));
    }

    fn trace(surfaces: Option<Surfaces>) -> MemoryTrace {
        let mut tables = tables(&[[64, 64]]);
        tables.meta.surfaces = surfaces;
        let whole = tile(&[(0, vec![(0, 0, 15)]), (0, vec![(0, 0, 3)])]);
        MemoryTrace {
            tables,
            tiles: vec![vec![whole.clone()], vec![whole]],
        }
    }

    #[test]
    fn a_trace_without_the_needed_fragments_is_refused() {
        let surfaces = |depth_tested| {
            Some(Surfaces {
                depth_tested,
                not_opaque: Vec::new(),
            })
        };
        let cases = [
            (
                None,
                Hsr::None,
                "hsr: expected early-z or deferred, because the trace was captured with the depth test (for none, capture with --hsr none), found none",
            ),
            (
                None,
                Hsr::Deferred,
                "hsr: expected early-z, because the trace does not record which draws are opaque (capture it again), found deferred",
            ),
            (
                surfaces(false),
                Hsr::Deferred,
                "hsr: expected none, because the trace was captured without the depth test and holds no depths (for the others, capture without --hsr none), found deferred",
            ),
        ];
        for (surfaces, hsr, expected) in cases {
            let trace = trace(surfaces);
            let error = shaded(&trace, hsr).err().expect("refused").to_string();
            assert!(error.ends_with(expected), "{error}");
        }
        for (surfaces, hsr, left) in [
            (None, Hsr::EarlyZ, 6),
            (surfaces(false), Hsr::None, 6),
            (surfaces(true), Hsr::Deferred, 4),
        ] {
            let (trace, mut tile) = (trace(surfaces), Tile::default());
            let source = shaded(&trace, hsr).unwrap();
            source.read_tile(0, 0, &mut tile).unwrap();
            assert_eq!(fragments(&tile).len(), left);
        }
    }
}
