//! Frames that repeat an earlier frame of the trace, and what identifies the work of a frame.
//!
//! A functional LRU machine that starts a frame with the contents with which it started an equal frame before,
//! and renders the same items in the same sequence, counts the same and ends with the same contents. It need not
//! replay the frame, and if no machine does, the frame need not be expanded.

use crate::order::{Phase, TileRef, WorkItem};
use crate::stream::TileSource;
use formats::textrace::Pass;
use std::hash::{DefaultHasher, Hash, Hasher};

/// A hash of 128 bits.
pub(super) fn hash128(value: &impl Hash) -> u128 {
    let of_half = |half: u8| {
        let mut hasher = DefaultHasher::new();
        half.hash(&mut hasher);
        value.hash(&mut hasher);
        u128::from(hasher.finish())
    };
    of_half(0) << 64 | of_half(1)
}

/// For each frame of a trace the first frame that is equal to it.
pub(super) struct Repeats {
    first: Vec<usize>,
    /// Place of each pass in its frame.
    places: Vec<usize>,
}

impl Repeats {
    /// Compares the frames with these numbers.
    pub(super) fn of(source: &dyn TileSource, frames: &[u32]) -> Self {
        let passes = &source.tables().passes;
        let of_frame = |number: &u32| -> Vec<(u32, &Pass)> {
            let all = (0..).zip(passes);
            all.filter(|(_, pass)| pass.frame == *number).collect()
        };
        let frames: Vec<Vec<(u32, &Pass)>> = frames.iter().map(of_frame).collect();
        let mut places = vec![0; passes.len()];
        for (place, (pass, _)) in frames.iter().flat_map(|passes| passes.iter().enumerate()) {
            places[*pass as usize] = place;
        }
        let equal = |a: &[(u32, &Pass)], b: &[(u32, &Pass)]| {
            let shape = |pass: &Pass| Pass { frame: 0, ..*pass };
            let same_shape =
                |((_, a), (_, b)): (&(u32, &Pass), &(u32, &Pass))| shape(a) == shape(b);
            let same_tiles =
                |((a, _), (b, _)): (&(u32, &Pass), &(u32, &Pass))| source.has_same_tiles(*a, *b);
            a.len() == b.len() && a.iter().zip(b).all(same_shape) && a.iter().zip(b).all(same_tiles)
        };
        let mut different: Vec<usize> = Vec::new();
        let mut first_equal = |index: usize| {
            let same = |&other: &usize| equal(&frames[other], &frames[index]);
            let found = different.iter().copied().find(same);
            found.unwrap_or_else(|| {
                different.push(index);
                index
            })
        };
        Self {
            first: (0..frames.len()).map(&mut first_equal).collect(),
            places,
        }
    }

    /// The first frame that equals the frame with this index.
    pub(super) fn first(&self, index: usize) -> usize {
        self.first[index]
    }

    /// True if the frame equals an earlier one.
    pub(super) fn is_repeat(&self, index: usize) -> bool {
        self.first[index] != index
    }

    /// True if another frame of the trace equals this one.
    pub(super) fn recurs(&self, index: usize) -> bool {
        self.first
            .iter()
            .filter(|first| **first == self.first[index])
            .count()
            > 1
    }

    /// Identifies the work of a frame with these phases; none if no other frame equals it.
    pub(super) fn identity(&self, index: usize, phases: &[Phase]) -> Option<u128> {
        if !self.recurs(index) {
            return None;
        }
        let tile = |at: TileRef| (self.places[at.pass as usize], at.tile);
        let item = |item: &WorkItem| match *item {
            WorkItem::Tile(at) => (tile(at), None),
            WorkItem::Pair(left, right, interleave) => {
                (tile(left), Some((tile(right), interleave as u8)))
            }
        };
        let phase = |phase: &Phase| -> Vec<_> { phase.iter().map(item).collect() };
        let phases: Vec<_> = phases.iter().map(phase).collect();
        Some(hash128(&(self.first[index], phases)))
    }
}
