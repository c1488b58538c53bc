//! The content of the L2 over the time of a frame: how full it is, whose lines it holds, and the share of each tile's
//! lines that are in it.

use super::tiles::{BOTH_EYES, FrameTiles};
use sim::memory::EMPTY;
use sim::result::L2Change;
use std::collections::HashMap;

/// Equal steps of a frame's time.
pub const STEPS: u32 = 64;

/// Share of a tile's lines in a frame of [`STEPS`]: 0 for none, [`FULL`] for all.
pub type Share = u8;

/// All of a tile's lines.
pub const FULL: Share = 7;

/// The content over a frame. Lists have a value for the frame's start and for the end of each step.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FrameContent {
    /// Lines that only the left eye touches in the frame, only the right eye, both, and none (lines of shared passes, of
    /// other frames and of other clients).
    pub lines: [Vec<u32>; 4],
    /// Lines that entered since the value before.
    pub entered: Vec<u32>,
    /// Step and share of each tile whenever the share changes, by pass in the order of [`FrameTiles::passes`].
    pub shares: Vec<Vec<Vec<(u32, Share)>>>,
}

/// The L2 while its changes are followed.
#[derive(Default)]
pub struct L2Content {
    /// How many caches hold a line.
    caches: HashMap<u32, u32>,
}

impl L2Content {
    /// Follows the changes of a frame, which lasts from `start` to `end` in cycles.
    pub fn follow(
        &mut self,
        changes: &[L2Change],
        [start, end]: [u64; 2],
        tiles: &FrameTiles,
    ) -> FrameContent {
        let mut frame = Following::new(tiles);
        frame.refill(&self.caches);
        let mut changes = changes.iter().peekable();
        for step in 0..=STEPS {
            let now = start + (end - start) * u64::from(step) / u64::from(STEPS);
            while let Some(change) = changes.next_if(|of| of.cycle <= now || step == STEPS) {
                self.apply(change, &mut frame);
            }
            frame.end_step(step);
        }
        frame.out
    }

    fn apply(&mut self, change: &L2Change, frame: &mut Following<'_>) {
        if change.line == EMPTY {
            self.caches.clear();
            frame.refill(&self.caches);
        } else if change.is_there {
            let caches = self.caches.entry(change.line).or_default();
            *caches += 1;
            frame.entered += 1;
            frame.moved(change.line, 1, *caches == 1);
        } else if let Some(caches) = self.caches.get_mut(&change.line) {
            *caches -= 1;
            let is_gone = *caches == 0;
            if is_gone {
                self.caches.remove(&change.line);
            }
            frame.moved(change.line, -1, is_gone);
        }
    }
}

/// A frame while the changes are followed.
struct Following<'a> {
    tiles: &'a FrameTiles,
    /// Lines by whose they are.
    lines: [i64; 4],
    entered: u32,
    /// Tiles of all passes that touch a line.
    touched_by: HashMap<u32, Vec<u32>>,
    /// Lines of each tile, and those in the L2.
    all: Vec<u32>,
    there: Vec<u32>,
    /// Tiles whose share may have changed in this step.
    changed: Vec<u32>,
    is_changed: Vec<bool>,
    out: FrameContent,
}

impl<'a> Following<'a> {
    fn new(tiles: &'a FrameTiles) -> Self {
        let of_tiles = || tiles.passes.iter().flat_map(|(_, pass)| &pass.lines);
        let mut touched_by: HashMap<u32, Vec<u32>> = HashMap::new();
        for (tile, lines) in (0..).zip(of_tiles()) {
            for line in lines {
                touched_by.entry(*line).or_default().push(tile);
            }
        }
        let all: Vec<u32> = of_tiles().map(|lines| lines.len() as u32).collect();
        let passes = tiles.passes.iter();
        Self {
            tiles,
            lines: [0; 4],
            entered: 0,
            touched_by,
            there: vec![0; all.len()],
            changed: Vec::new(),
            is_changed: vec![false; all.len()],
            all,
            out: FrameContent {
                shares: passes
                    .map(|(_, pass)| vec![Vec::new(); pass.lines.len()])
                    .collect(),
                ..FrameContent::default()
            },
        }
    }

    /// Starts with the lines of these caches.
    fn refill(&mut self, caches: &HashMap<u32, u32>) {
        self.lines = [0; 4];
        self.there.fill(0);
        self.is_changed.fill(true);
        self.changed = (0..self.all.len() as u32).collect();
        for (&line, &count) in caches {
            self.moved(line, i64::from(count), true);
        }
    }

    /// Copies of a line entered or left; `is_all` if it was the first or the last one.
    fn moved(&mut self, line: u32, copies: i64, is_all: bool) {
        let whose = match self.tiles.eyes.get(&line).copied().unwrap_or(0) {
            0 => 3,
            BOTH_EYES => 2,
            eye => usize::from(eye) - 1,
        };
        self.lines[whose] += copies;
        if !is_all {
            return;
        }
        for &tile in self.touched_by.get(&line).into_iter().flatten() {
            let index = tile as usize;
            self.there[index] = self.there[index].wrapping_add_signed(copies.signum() as i32);
            if !std::mem::replace(&mut self.is_changed[index], true) {
                self.changed.push(tile);
            }
        }
    }

    fn end_step(&mut self, step: u32) {
        for (list, lines) in self.out.lines.iter_mut().zip(self.lines) {
            list.push(lines as u32);
        }
        self.out.entered.push(std::mem::take(&mut self.entered));
        self.changed.sort_unstable();
        let mut first = 0;
        let mut changed = self.changed.drain(..).peekable();
        for pass in &mut self.out.shares {
            let end = first + pass.len();
            while let Some(tile) = changed.next_if(|&tile| (tile as usize) < end) {
                let tile = tile as usize;
                self.is_changed[tile] = false;
                let share = share(self.there[tile], self.all[tile]);
                let list = &mut pass[tile - first];
                if list.last().map_or(0, |(_, share)| *share) != share {
                    list.push((step, share));
                }
            }
            first = end;
        }
    }
}

/// A share in steps of one of [`FULL`]: 0 only for none, [`FULL`] only for all, rounded down between them.
pub fn share(part: u32, all: u32) -> Share {
    if part == 0 {
        return 0;
    }
    let share = u64::from(part) * u64::from(FULL) / u64::from(all.max(1));
    (share as Share).clamp(1, FULL)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::PassTiles;

    fn tiles() -> FrameTiles {
        let pass = |lines: &[&[u32]]| PassTiles {
            lines: lines.iter().map(|lines| lines.to_vec()).collect(),
            ..PassTiles::default()
        };
        FrameTiles {
            passes: vec![
                (0, pass(&[&[1, 2], &[2, 3, 4]])),
                (1, pass(&[&[2, 9], &[]])),
            ],
            eyes: [(1, 1), (2, 3), (3, 1), (4, 1), (9, 2)].into(),
            ..FrameTiles::default()
        }
    }

    #[test]
    fn shares_and_owners_follow_the_changes_of_two_caches() {
        let change = |cycle, line, is_there| L2Change {
            cycle,
            line,
            is_there,
        };
        let mut l2 = L2Content::default();
        let first = [
            change(0, 2, true),
            change(64, 2, true),
            change(64, 77, true),
            change(100, 2, false),
            change(500, 1, true),
        ];
        let found = l2.follow(&first, [0, 128], &tiles());
        // The last step has what comes after the end of the frame.
        assert_eq!(found.shares[0], [vec![(0, 3), (64, 7)], vec![(0, 2)]]);
        assert_eq!(found.shares[1], [vec![(0, 3)], vec![]]);
        let at = |step: usize| found.lines.each_ref().map(|list| list[step]);
        assert_eq!(
            [0, 31, 32, 50, 64].map(at),
            [
                [0, 0, 1, 0],
                [0, 0, 1, 0],
                [0, 0, 2, 1],
                [0, 0, 1, 1],
                [1, 0, 1, 1]
            ]
        );
        assert_eq!(found.entered.iter().sum::<u32>(), 4);

        // The next frame starts with what is left, until the cache is emptied.
        let second = [change(128, EMPTY, false), change(200, 9, true)];
        let found = l2.follow(&second, [128, 256], &tiles());
        assert_eq!(found.shares[0], [vec![], vec![]]);
        assert_eq!(found.shares[1][0], [(36, 3)]);
    }

    #[test]
    fn shares_are_none_or_all_only_if_they_are() {
        assert_eq!(share(0, 1000), 0);
        assert_eq!(share(1, 1000), 1);
        assert_eq!(share(999, 1000), FULL - 1);
        assert_eq!(share(1000, 1000), FULL);
    }
}
