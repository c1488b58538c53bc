//! Converts raw records of a tile to the trace's `Tile`.

use super::bins::{Bins, Entry};
use super::error::RecordError;
use super::masked::{DepthReplay, MaskedDepth};
use super::quantise::{GroupScale, Quantiser};
use super::raw::{RawRecord, RawRecords};
use formats::textrace::{Draw, NO_GROUP, PrimitiveRun, QuadRecord, Tables, Tile};
use formats::texture::Sampler;
use std::ops::AddAssign;

/// Counts of a capture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CaptureCounts {
    /// Covered quads with a record in the trace. A quad with several uv groups is counted once.
    pub quads: u64,
    /// Covered lanes of these quads that have a record in the trace.
    pub fragments: u64,
    /// Records in the trace.
    pub records: u64,
    /// Lanes of masked draws that the repeated depth test removed.
    pub masked_lanes_killed: u64,
    /// Records left out because a coordinate was not finite.
    pub not_finite: u64,
    /// Bytes of the encoded tiles.
    pub tile_bytes: u64,
    /// Uncovered tiles. Each takes only an entry in the index.
    pub empty_tiles: u64,
}

impl AddAssign for CaptureCounts {
    fn add_assign(&mut self, other: Self) {
        formats::add_fields!(
            self,
            other,
            quads,
            fragments,
            records,
            masked_lanes_killed,
            not_finite,
            tile_bytes,
            empty_tiles
        );
    }
}

/// Properties of the draws that determine their tiles.
pub(crate) struct TileRules {
    /// By draw and group.
    scales: Vec<Vec<GroupScale>>,
    /// Depth test between the quads of each draw.
    replays: Vec<DepthReplay>,
}

/// Memory that is reused for all tiles.
#[derive(Default)]
pub(crate) struct Scratch {
    order: Vec<Entry>,
    depth: MaskedDepth,
    quantisers: [Quantiser; 16],
    /// The tile built last.
    pub tile: Tile,
}

impl TileRules {
    /// Rules for the draws of `tables`. `replays` has the depth test between the quads of each draw.
    pub fn new(tables: &Tables, replays: Vec<DepthReplay>) -> Self {
        let scales = |draw| scales(draw, &tables.samplers);
        Self {
            scales: tables.draws.iter().map(scales).collect(),
            replays,
        }
    }

    /// Adds the next draw.
    pub fn add_draw(&mut self, draw: &Draw, samplers: &[Sampler], replay: DepthReplay) {
        self.scales.push(scales(draw, samplers));
        self.replays.push(replay);
    }

    /// Builds tile `tile` of the bins into `scratch.tile`.
    ///
    /// # Errors
    /// A record has a draw or group that is not in the tables.
    pub fn build(
        &self,
        records: RawRecords<'_>,
        bins: &Bins,
        tile: usize,
        scratch: &mut Scratch,
    ) -> Result<CaptureCounts, RecordError> {
        bins.sorted(tile, &mut scratch.order);
        scratch.tile.clear();
        scratch.depth.clear();
        let mut counts = CaptureCounts::default();
        let order = std::mem::take(&mut scratch.order);
        for quad in order.chunk_by(|a, b| a.0 >> 8 == b.0 >> 8) {
            self.add_quad(records, quad, scratch, &mut counts)?;
        }
        scratch.order = order;
        if scratch.tile.runs.last().is_some_and(|run| run.count == 0) {
            scratch.tile.runs.pop();
        }
        counts.records = scratch.tile.records.len() as u64;
        counts.empty_tiles = u64::from(scratch.tile.records.is_empty());
        Ok(counts)
    }

    /// Adds the records of one quad of one primitive.
    fn add_quad(
        &self,
        records: RawRecords<'_>,
        quad: &[Entry],
        scratch: &mut Scratch,
        counts: &mut CaptureCounts,
    ) -> Result<(), RecordError> {
        let of = |entry: &Entry| &records.quads[entry.1 as usize];
        let Some(first) = quad.first().map(of) else {
            return Ok(());
        };
        let (x, y) = ((first.qx() & 7) as u8, (first.qy() & 7) as u8);
        let mut alive = 15;
        let replay = self.replays.get(first.draw as usize).copied();
        if let Some(replay) = replay.filter(|replay| *replay != DepthReplay::None) {
            alive = 0;
            let has_depth = |r: &RawRecord| {
                r.group() == 0 && !r.is_operands() || r.passing & RawRecord::HAS_DEPTH != 0
            };
            for &(_, index) in quad.iter().filter(|entry| has_depth(of(entry))) {
                let record = of(&(0, index));
                let Some(depth) = records.depths.get(index as usize) else {
                    continue;
                };
                let survivors = scratch.depth.survivors(replay, record, depth);
                counts.masked_lanes_killed += u64::from((record.mask() & !survivors).count_ones());
                alive |= survivors;
            }
        }
        let mut lanes = 0;
        let first_of_quad = scratch.tile.records.len();
        // Operands are kept until the record to which they belong.
        let mut operands: Option<Option<QuadRecord>> = None;
        for record in quad.iter().map(of) {
            let mask = record.mask() & alive;
            if mask == 0 {
                continue;
            }
            let mut result = QuadRecord {
                x,
                y,
                mask,
                group: record.group(),
                ..QuadRecord::default()
            };
            self.open_run(record, scratch);
            let mut has_operands = false;
            if record.group() != NO_GROUP {
                let rule = self.rule(record)?;
                let quantiser = &mut scratch.quantisers[usize::from(record.group())];
                let fixed = quantiser.quantise(rule, record);
                if let Some(fixed) = fixed {
                    result.uv = fixed.uv;
                    result.dx = fixed.dx;
                    result.dy = fixed.dy;
                    result.cross = fixed.cross;
                }
                if record.is_operands() {
                    operands = Some(fixed.map(|_| result));
                    continue;
                }
                let before = operands.take();
                if fixed.is_none() || before == Some(None) {
                    counts.not_finite += 1;
                    continue;
                }
                if let Some(before) = before.flatten() {
                    has_operands = true;
                    push(&mut scratch.tile, before);
                }
            }
            lanes |= mask;
            let mut earlier = scratch.tile.records[first_of_quad..].iter_mut();
            match earlier.find(|of| !has_operands && joins(of, &result)) {
                Some(of) => of.mask |= mask,
                None => push(&mut scratch.tile, result),
            }
        }
        counts.quads += u64::from(lanes != 0);
        counts.fragments += u64::from(lanes.count_ones());
        Ok(())
    }

    /// Conversion of the coordinates of a record's group to fixed point.
    fn rule(&self, record: &RawRecord) -> Result<&GroupScale, RecordError> {
        let invalid = |expected: String, found: u32| RecordError::Invalid {
            expected,
            found: found.to_string(),
        };
        let groups = self
            .scales
            .get(record.draw as usize)
            .ok_or_else(|| invalid(format!("a draw below {}", self.scales.len()), record.draw))?;
        groups.get(usize::from(record.group())).ok_or_else(|| {
            let expected = format!("a group below {} of draw {}", groups.len(), record.draw);
            invalid(expected, record.group().into())
        })
    }

    /// Starts a run for the record's primitive, unless it is the current one.
    fn open_run(&self, record: &RawRecord, scratch: &mut Scratch) {
        let tile = &mut scratch.tile;
        if tile
            .runs
            .last()
            .is_none_or(|run| run.primitive != record.primitive)
        {
            // Remove a run without records before the next one starts.
            if tile.runs.last().is_some_and(|run| run.count == 0) {
                tile.runs.pop();
            }
            tile.runs.push(PrimitiveRun {
                primitive: record.primitive,
                draw: record.draw,
                first: tile.records.len() as u32,
                count: 0,
            });
            scratch.quantisers = Default::default();
        }
    }
}

fn scales(draw: &Draw, samplers: &[Sampler]) -> Vec<GroupScale> {
    let scale = |group| GroupScale::new(group, samplers);
    draw.groups.iter().map(scale).collect()
}

/// Whether two records of a quad differ in their lanes alone, as those of the parts of a clipped primitive may.
/// A driver that records fragments one by one does not tell such parts apart.
fn joins(a: &QuadRecord, b: &QuadRecord) -> bool {
    let with_b_lanes = QuadRecord { mask: b.mask, ..*a };
    a.mask & b.mask == 0 && with_b_lanes == *b
}

fn push(tile: &mut Tile, record: QuadRecord) {
    tile.records.push(record);
    if let Some(run) = tile.runs.last_mut() {
        run.count += 1;
    }
}
