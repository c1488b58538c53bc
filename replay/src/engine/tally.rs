//! LRU caches of one level that see the same lines, and their misses: counted once a number of sets,
//! by how many of its associativities miss.

use super::counts::Misses;
use super::one_pass::Geometry;
use crate::cache::{Access, Stacks};
use crate::stream::Bins;

/// Where a footprint was asked for, and where it counts.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// Which of a level's caches was asked first.
    pub cache: u32,
    /// See [`Bins`].
    pub cell: u32,
    /// Likewise.
    pub tile: u32,
}

/// What counts by tile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TileCounts {
    /// Nothing.
    None,
    /// Footprints with any miss.
    Footprints,
    /// Lines.
    Lines,
}

/// Misses of all caches of one number of sets.
pub struct Tally {
    sets: u32,
    /// Associativities, ascending.
    ways: Vec<u32>,
    /// How many of the associativities miss a line, by its depth.
    missing: Vec<u8>,
    /// Lines and footprints, by cell and number of associativities that miss, from one on.
    counts: Vec<[u64; 2]>,
    count_tiles: TileCounts,
    /// By tile likewise. A tile has fewer than 2^32 accesses.
    tiles: Vec<u32>,
}

/// The footprint at hand, and how many associativities miss any of its lines.
struct Open {
    footprint: u32,
    most: u8,
}

impl Tally {
    /// Counts a line that so many associativities miss, one at least.
    #[inline(always)]
    fn line(&mut self, open: &mut Open, access: &Access, missing: u8, places: &[Place]) {
        if access.footprint != open.footprint {
            self.footprint(open, places);
            open.footprint = access.footprint;
            open.most = 0;
        }
        open.most = open.most.max(missing);
        let place = &places[access.footprint as usize];
        let slot = place.cell as usize * self.ways.len() + usize::from(missing) - 1;
        self.counts[slot][0] += 1;
        if self.count_tiles == TileCounts::Lines {
            self.tile(place, missing);
        }
    }

    /// Counts the footprint at hand, if there is one.
    #[inline(always)]
    fn footprint(&mut self, open: &Open, places: &[Place]) {
        let Some(place) = places.get(open.footprint as usize) else {
            return;
        };
        let slot = place.cell as usize * self.ways.len() + usize::from(open.most) - 1;
        self.counts[slot][1] += 1;
        if self.count_tiles == TileCounts::Footprints {
            self.tile(place, open.most);
        }
    }

    fn tile(&mut self, place: &Place, missing: u8) {
        let slot = place.tile as usize * self.ways.len() + usize::from(missing) - 1;
        self.tiles[slot] += 1;
    }

    /// Misses of one associativity, the `rank`-th, by cell.
    pub fn misses(&self, rank: usize) -> impl Iterator<Item = Misses> {
        let sum = move |counts: &[[u64; 2]], which: usize| {
            counts[rank..].iter().map(|count| count[which]).sum()
        };
        let cells = self.counts.chunks(self.ways.len());
        cells.map(move |counts| Misses {
            footprints: sum(counts, 1),
            lines: sum(counts, 0),
            secondary: 0,
        })
    }

    /// Likewise by tile, if they are counted.
    pub fn tile_misses(&self, rank: usize) -> impl Iterator<Item = u32> {
        let sum = move |counts: &[u32]| counts[rank..].iter().sum();
        self.tiles.chunks(self.ways.len()).map(sum)
    }
}

/// All caches of a level that see the same lines.
pub struct Level {
    /// By number of sets, ascending.
    trees: Vec<(Tally, Stacks)>,
}

impl Level {
    /// `caches` empty caches of each of the geometries.
    pub fn new(
        bins: &Bins,
        caches: usize,
        count_tiles: TileCounts,
        geometries: impl Iterator<Item = Geometry>,
    ) -> Self {
        let mut sorted: Vec<Geometry> = geometries.collect();
        sorted.sort_unstable();
        sorted.dedup();
        let tiles = match count_tiles {
            TileCounts::None => 0,
            TileCounts::Footprints | TileCounts::Lines => bins.tiles(),
        };
        let tree = |same_sets: &[Geometry]| {
            let sets = same_sets[0].0;
            let ways: Vec<u32> = same_sets.iter().map(|&(_, ways)| ways).collect();
            let depth = ways.last().copied().unwrap_or(0);
            let missing = |depth| ways.iter().filter(|&&w| w <= depth).count() as u8;
            let tally = Tally {
                sets,
                missing: (0..=depth).map(missing).collect(),
                counts: vec![[0; 2]; bins.cells() * ways.len()],
                count_tiles,
                tiles: vec![0; tiles * ways.len()],
                ways,
            };
            (tally, Stacks::new(caches, sets, depth))
        };
        Self {
            trees: sorted.chunk_by(|a, b| a.0 == b.0).map(tree).collect(),
        }
    }

    /// Empties all caches.
    pub fn clear(&mut self) {
        self.trees.iter_mut().for_each(|(_, stacks)| stacks.clear());
    }

    /// Number of numbers of sets.
    pub fn trees(&self) -> usize {
        self.trees.len()
    }

    /// The misses of one of them.
    pub fn tally(&self, tree: usize) -> &Tally {
        &self.trees[tree].0
    }

    /// Number of sets and rank of the associativity.
    pub fn find(&self, (sets, ways): Geometry) -> (usize, usize) {
        let tree = self.trees.partition_point(|(tally, _)| tally.sets < sets);
        let rank = self.trees[tree].0.ways.partition_point(|&w| w < ways);
        (tree, rank)
    }

    /// Accesses and counts a batch in the cache that `cache` chooses; `missed` is told what misses so many of the associativities of one of the
    /// numbers of sets. Few accesses are left in the list afterwards.
    #[inline(always)]
    pub fn run(
        &mut self,
        accesses: &mut Vec<Access>,
        places: &[Place],
        cache: impl Fn(&Place) -> usize,
        mut missed: impl FnMut(usize, &Access, u8),
    ) {
        for (tree, (tally, stacks)) in self.trees.iter_mut().enumerate() {
            let mut open = Open {
                footprint: u32::MAX,
                most: 0,
            };
            let cache = |access: &Access| cache(&places[access.footprint as usize]);
            stacks.access_all(accesses, cache, |access, depth| {
                let missing = tally.missing[usize::from(depth)];
                if missing > 0 {
                    tally.line(&mut open, access, missing, places);
                    missed(tree, access, missing);
                }
            });
            tally.footprint(&open, places);
        }
    }
}
