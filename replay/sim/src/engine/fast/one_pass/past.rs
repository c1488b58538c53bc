//! Frames that were replayed before: what they counted, and what they left in the caches.

use super::history::{Contents, Counts, History};
use crate::engine::repeats::hash128;
use std::collections::VecDeque;

/// Memory for contents and counts of earlier frames. The oldest are forgotten first.
const MOST_BYTES: usize = 16 << 20;

/// Earlier frames of a machine.
pub(super) struct Past {
    enabled: bool,
    frames: VecDeque<PastFrame>,
    bytes: usize,
}

/// The start of a frame.
pub(super) struct Start {
    key: u128,
    counts: Vec<Counts>,
}

struct PastFrame {
    start: Start,
    counts: Vec<Counts>,
    contents: Vec<Contents>,
    bytes: usize,
}

fn contents_of(history: &History) -> Contents {
    let (l1, l2) = history.contents();
    (l1.to_vec(), l2.into_iter().cloned().collect())
}

impl Past {
    /// Remembers nothing unless `enabled`.
    pub(super) fn new(enabled: bool) -> Self {
        Self {
            enabled,
            frames: VecDeque::new(),
            bytes: 0,
        }
    }

    fn key<'h>(identity: u128, histories: impl Iterator<Item = &'h History>) -> u128 {
        let contents = histories.map(|of| hash128(&of.contents()));
        hash128(&(identity, contents.collect::<Vec<_>>()))
    }

    /// The number of the frame with this work that started with the same contents.
    pub(super) fn find<'h>(
        &self,
        identity: u128,
        histories: impl Iterator<Item = &'h History>,
    ) -> Option<usize> {
        if self.frames.is_empty() {
            return None;
        }
        let key = Self::key(identity, histories);
        self.frames.iter().position(|frame| frame.start.key == key)
    }

    /// Notes the start of a frame.
    pub(super) fn start<'h>(
        &self,
        identity: u128,
        histories: impl Iterator<Item = &'h History> + Clone,
    ) -> Start {
        Start {
            key: Self::key(identity, histories.clone()),
            counts: match self.enabled {
                true => histories.map(History::counts_so_far).collect(),
                false => Vec::new(),
            },
        }
    }

    /// Remembers a frame at its end.
    pub(super) fn remember<'h>(
        &mut self,
        start: Start,
        histories: impl Iterator<Item = &'h History> + Clone,
    ) {
        if !self.enabled {
            return;
        }
        let bytes = histories.clone().map(History::bytes).sum();
        if bytes > MOST_BYTES {
            return;
        }
        while self.bytes + bytes > MOST_BYTES {
            let oldest = self.frames.pop_front();
            self.bytes -= oldest.map_or(self.bytes, |frame| frame.bytes);
        }
        self.bytes += bytes;
        self.frames.push_back(PastFrame {
            start,
            counts: histories.clone().map(History::counts_so_far).collect(),
            contents: histories.map(contents_of).collect(),
            bytes,
        });
    }

    /// Repeats a frame.
    pub(super) fn repeat<'h>(
        &self,
        frame: usize,
        histories: impl Iterator<Item = &'h mut History>,
    ) {
        let PastFrame {
            start,
            counts,
            contents,
            ..
        } = &self.frames[frame];
        let counted = start.counts.iter().zip(counts);
        for ((history, (before, after)), contents) in histories.zip(counted).zip(contents) {
            history.repeat(before, after, contents);
        }
    }
}
