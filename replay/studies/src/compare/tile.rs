//! Compares a tile of two captures.

use super::partners::Partners;
use super::tally::{LOD_STEPS, Tally};
use formats::footprint::{Footprint, LodFormula, footprints, quad_lod};
use formats::textrace::{
    NO_GROUP, PrimitiveRun, QuadRecord, Tile, UvGroup, quad_morton, with_operands,
};
use sim::config::SamplingConfig;
use sim::order::TileRef;
use sim::stream::{StreamError, TileSource};
use std::cmp::Ordering;

/// Smaller levels of detail are equivalent, because the finest level is magnified.
const LEAST_LOD: f32 = -16.0;

/// Compares tiles.
pub(super) struct Comparer<'a> {
    traces: [&'a dyn TileSource; 2],
    partners: &'a Partners<'a>,
    sampling: &'a SamplingConfig,
    tiles: [Tile; 2],
    by_draw: Vec<Tally>,
    tiles_that_differ: u64,
    footprints: [Vec<Footprint>; 2],
}

/// A primitive's quads in a tile, each as its records.
fn quads<'t>(tile: &'t Tile, run: &PrimitiveRun) -> Vec<&'t [QuadRecord]> {
    let records = &tile.records[run.first as usize..][..run.count as usize];
    records.chunk_by(|a, b| (a.x, a.y) == (b.x, b.y)).collect()
}

/// Lanes that any of a quad's records covers.
fn covered(records: &[QuadRecord]) -> u8 {
    records
        .iter()
        .fold(0, |mask, record| mask | record.mask & 15)
}

/// Lanes that sample a group.
fn sampled(records: &[QuadRecord], group: u8) -> u8 {
    let of_group = records.iter().filter(|record| record.group == group);
    of_group.fold(0, |mask, record| mask | record.mask)
}

/// Merges two ascending lists by key: pairs under the same key, and elements of only one list.
fn joined<'t, T>(
    lists: [&'t [T]; 2],
    key: impl Fn(&T) -> u64,
    mut each: impl FnMut(Option<&'t T>, Option<&'t T>),
) {
    let [mut a, mut b] = lists;
    loop {
        let order = match (a.first(), b.first()) {
            (None, None) => return,
            (Some(_), None) => Ordering::Less,
            (None, Some(_)) => Ordering::Greater,
            (Some(a), Some(b)) => key(a).cmp(&key(b)),
        };
        let left = if order.is_le() {
            a.split_off_first()
        } else {
            None
        };
        let right = if order.is_ge() {
            b.split_off_first()
        } else {
            None
        };
        each(left, right);
    }
}

impl<'a> Comparer<'a> {
    /// An empty comparison.
    pub fn new(
        traces: [&'a dyn TileSource; 2],
        partners: &'a Partners<'a>,
        sampling: &'a SamplingConfig,
    ) -> Self {
        Self {
            traces,
            partners,
            sampling,
            tiles: Default::default(),
            by_draw: vec![Tally::default(); partners.count()],
            tiles_that_differ: 0,
            footprints: Default::default(),
        }
    }

    /// Counts by the first capture's draws, and the number of tiles that differ.
    pub fn finish(self) -> (Vec<Tally>, u64) {
        (self.by_draw, self.tiles_that_differ)
    }

    /// Compares a tile.
    ///
    /// # Errors
    /// An unreadable tile.
    pub fn tile(&mut self, at: TileRef) -> Result<(), StreamError> {
        let mut tiles = std::mem::take(&mut self.tiles);
        for (trace, tile) in self.traces.iter().zip(&mut tiles) {
            trace.read_tile(at.pass, at.tile, tile)?;
        }
        let [a, b] = &tiles;
        let runs = |tile: &Tile| tile.runs.iter().map(|r| (r.primitive, r.count)).collect();
        let (runs_a, runs_b): (Vec<_>, Vec<_>) = (runs(a), runs(b));
        let differs = a.records != b.records || runs_a != runs_b;
        self.tiles_that_differ += u64::from(differs);
        joined(
            [&a.runs, &b.runs],
            |run| run.primitive.into(),
            |left, right| {
                let primitive = left.or(right).map_or(0, |run| run.primitive);
                let draws = [left, right].map(|run| run.map_or(0, |run| run.draw));
                let of_a = left.map(|run| run.draw as usize);
                let draw = of_a.unwrap_or_else(|| self.partners.draw_of(primitive));
                let of = |tile, run: Option<&PrimitiveRun>| {
                    run.map_or_else(Vec::new, |run| quads(tile, run))
                };
                let [left, right] = [of(a, left), of(b, right)];
                let place =
                    |quad: &&[QuadRecord]| quad.first().map_or(0, |r| quad_morton(r.x, r.y)).into();
                joined([&left, &right], place, |left, right| {
                    let none: &[QuadRecord] = &[];
                    let [left, right] = [left, right].map(|quad| quad.copied().unwrap_or(none));
                    self.quad(draw, draws, left, right);
                });
            },
        );
        self.tiles = tiles;
        Ok(())
    }

    fn quad(&mut self, draw: usize, draws: [u32; 2], a: &[QuadRecord], b: &[QuadRecord]) {
        let both = covered(a) & covered(b);
        let tally = &mut self.by_draw[draw];
        tally.fragments_in_both += u64::from(both.count_ones());
        tally.fragments_only_in_a += u64::from((covered(a) & !both).count_ones());
        tally.fragments_only_in_b += u64::from((covered(b) & !both).count_ones());
        if both == 0 {
            return;
        }
        // Compared per lane, because one record in a capture may be two in the other (parts of a clipped primitive).
        let alone = |of: &[QuadRecord], other: &[QuadRecord]| -> u32 {
            let lanes = |r: &QuadRecord| r.mask & both & !sampled(other, r.group);
            of.iter().map(|r| lanes(r).count_ones()).sum()
        };
        tally.lanes_sampled_differently += u64::from(alone(a, b) + alone(b, a));
        for (left, of_left) in with_operands(a) {
            for (right, of_right) in with_operands(b).filter(|(r, _)| r.group == left.group) {
                let shared = left.mask & right.mask & both;
                match self.partners.group(draws, left.group) {
                    _ if shared == 0 || left.group == NO_GROUP => {}
                    Some(group) => {
                        let pairs = [(left, of_left), (right, of_right)];
                        self.records(draw, group, shared, pairs);
                    }
                    None => {
                        let tally = &mut self.by_draw[draw];
                        tally.lanes_sampled_differently += u64::from(shared.count_ones());
                    }
                }
            }
        }
    }

    /// Compares two records of the same lanes and textures, with their operands.
    fn records(
        &mut self,
        draw: usize,
        group: &UvGroup,
        lanes: u8,
        pairs: [(&QuadRecord, Option<&QuadRecord>); 2],
    ) {
        let tally = &mut self.by_draw[draw];
        let records = pairs.map(|(record, _)| record);
        let operands = pairs.map(|(_, operands)| operands.copied());
        let [a, b] = records;
        for lane in (0..4).filter(|lane| lanes >> lane & 1 != 0) {
            let ([au, av], [bu, bv]) = (a.lane_uv(lane), b.lane_uv(lane));
            let distance = |a: i32, b: i32| u64::from(a.abs_diff(b));
            tally
                .uv_texels
                .record(distance(au, bu).max(distance(av, bv)), 1);
        }
        let lod = records.map(|record| {
            quad_lod(record, group.extent, group.extent, LodFormula::Exact).max(LEAST_LOD)
        });
        let levels = f64::from(lod[0] - lod[1]).abs();
        tally
            .lod_levels
            .record((levels * f64::from(LOD_STEPS)).round() as u64, 1);
        let tables = self.partners.tables();
        let records = records.map(|record| QuadRecord {
            mask: lanes,
            ..*record
        });
        let same =
            records[0] == records[1] && (!group.has_operands() || operands[0] == operands[1]);
        for sample in &group.samples {
            let texture = &tables.textures[sample.texture as usize];
            let sampler = &tables.samplers[usize::from(sample.sampler)];
            let sides = records.iter().zip(&operands);
            for ((record, operands), list) in sides.zip(&mut self.footprints) {
                list.clear();
                if same && std::ptr::eq(record, &records[1]) {
                    continue;
                }
                let visit = |footprint| list.push(footprint);
                footprints(
                    record,
                    operands.as_ref(),
                    group.extent,
                    sample,
                    texture,
                    sampler,
                    self.sampling,
                    visit,
                );
            }
            let [a, b] = &self.footprints;
            tally.footprints += a.len().max(b.len()) as u64;
            if !same {
                let only = |list: &[Footprint], other: &[Footprint]| {
                    list.iter().filter(|f| !other.contains(f)).count()
                };
                tally.footprints_that_differ += only(a, b).max(only(b, a)) as u64;
            }
        }
    }
}
