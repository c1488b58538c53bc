//! Other work between two frames, which fills part of the caches with its own lines.

use crate::config::RunConfig;
use std::ops::Range;

/// The lines that other work accesses after a frame: it fills a share of each cache from the L2 down.
#[derive(Clone, Copy, Debug)]
pub struct OtherWork {
    /// Share of each cache, percent.
    percent: u8,
    /// Its first line, in lines of the L2.
    first: u32,
    /// Lines of an L2.
    l2_lines: u64,
}

impl OtherWork {
    /// Lines from here on belong to other work.
    const FIRST: u32 = 0xe000_0000;
    /// Lines of the buffers of other clients, which lie above the textures.
    const BUFFERS: u32 = 1 << 28;
    /// Lines of a cache at most; the configuration refuses larger ones.
    const MOST: u32 = 1 << 24;

    /// Checks that textures of `lines` lines do not reach the lines of other work.
    ///
    /// # Errors
    /// The largest possible number of lines.
    pub fn check(lines: u64) -> Result<(), u32> {
        match lines <= (Self::FIRST - Self::BUFFERS).into() {
            true => Ok(()),
            false => Err(Self::FIRST - Self::BUFFERS),
        }
    }

    /// The work after the frame with this index. Its lines differ from those after the 15 frames before.
    pub fn after(frame: usize, percent: u8, config: &RunConfig) -> Self {
        Self {
            percent,
            first: Self::FIRST + (frame as u32 % 16) * Self::MOST,
            l2_lines: config.level.l2.size_bytes / u64::from(config.line_bytes),
        }
    }

    /// Its lines in an L2 of the configuration.
    pub fn l2_lines(self) -> Range<u32> {
        self.lines(self.l2_lines, 0)
    }

    /// Its lines in a cache with `all` lines, each of which contains 2^`shift` lines of the L2.
    pub fn lines(self, all: u64, shift: u32) -> Range<u32> {
        let first = self.first >> shift;
        let count = all * u64::from(self.percent) / 100;
        first..first + (count as u32).min(Self::MOST >> shift)
    }
}
