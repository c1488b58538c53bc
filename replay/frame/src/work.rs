//! What a core runs: warps of quads, and the look-ups of their textures.

/// A quad's look-ups of one level of one texture: the unit of work of a texture unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Request {
    /// Its distinct lines in [`Part::lines`].
    pub first: u32,
    /// End of its lines.
    pub end: u32,
    /// Bilinear footprints.
    pub footprints: u32,
}

/// Quads in lock step. All requests are made after the first instructions, level by level, quad by quad; the other
/// instructions use all of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Warp {
    /// Its first request in [`Part::requests`].
    pub first: u32,
    /// End of its requests.
    pub end: u32,
    /// Quads.
    pub quads: u32,
    /// Ticks of its instructions before its textures, and after them.
    pub alu_ticks: [u64; 2],
    /// True if its instructions are issued before those of other warps.
    pub priority: bool,
}

/// The warps of an item on one core.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Part {
    /// Number of the item. Items are numbered as they are first taken.
    pub item: u64,
    /// Position of the item in the scheduler's list, for its counters.
    pub index: usize,
    /// Warps, in order of launch.
    pub warps: Vec<Warp>,
    /// Requests of all warps.
    pub requests: Vec<Request>,
    /// Lines of all requests.
    pub lines: Vec<u32>,
    /// First line that is written when the warps have finished.
    pub write_first: u32,
    /// Lines that are written.
    pub write_lines: u32,
}

impl Part {
    /// Empties the part and keeps its memory.
    pub fn clear(&mut self) {
        self.warps.clear();
        self.requests.clear();
        self.lines.clear();
        (self.write_first, self.write_lines) = (0, 0);
    }

    /// Appends a warp: the distinct lines and the footprints of each request, its quads, and its instructions in ticks.
    pub fn add_warp<'a>(
        &mut self,
        requests: impl IntoIterator<Item = (&'a [u32], u32)>,
        quads: u32,
        alu_ticks: [u64; 2],
        priority: bool,
    ) {
        let first = self.requests.len() as u32;
        for (lines, footprints) in requests {
            let first = self.lines.len() as u32;
            self.lines.extend_from_slice(lines);
            self.requests.push(Request {
                first,
                end: self.lines.len() as u32,
                footprints,
            });
        }
        self.warps.push(Warp {
            first,
            end: self.requests.len() as u32,
            quads,
            alu_ticks,
            priority,
        });
    }

    /// The lines of a request.
    pub fn lines_of(&self, request: &Request) -> &[u32] {
        &self.lines[request.first as usize..request.end as usize]
    }
}
