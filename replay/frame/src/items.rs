//! The items of a scheduler's queue as warps of the cores.

use super::device::Source;
use super::machine::Machine;
use super::schedulers::{HandOut, Place, Queue};
use super::work::{Part, Request, Warp};
use sim::order::{TileRef, WorkItem};
use sim::stream::{Cores, QuadLines, StreamError, TileSource, for_quads};
use std::collections::VecDeque;
use std::ops::Range;

/// One warp in this many starts first, with [`Items::priority`].
const PRIORITY_STRIDE: usize = 8;

/// The tile writes of a frame: the first line of each pass, and the bytes of a pixel.
#[derive(Clone, Debug, Default)]
pub struct Pictures {
    first_lines: Vec<u32>,
    pixel_bytes: u32,
    line_bytes: u32,
}

impl Pictures {
    /// The pictures of all passes, behind the textures. Each frame has the same addresses.
    pub fn new(source: &dyn TileSource, textures: u64, pixel_bytes: u32, line_bytes: u32) -> Self {
        let mut next = textures;
        let mut frame = None;
        let mut first = |pass: &formats::textrace::Pass| {
            if frame != Some(pass.frame) {
                (frame, next) = (Some(pass.frame), textures);
            }
            let here = next;
            let tile = u64::from(source.tile_px()).pow(2) * u64::from(pixel_bytes);
            next += u64::from(pass.tile_count()) * tile.div_ceil(line_bytes.into());
            u32::try_from(here).unwrap_or(0)
        };
        let passes = source.tables().passes.iter();
        Self {
            first_lines: passes.map(&mut first).collect(),
            pixel_bytes,
            line_bytes,
        }
    }

    /// First line and number of lines of a tile, as far as it lies in the picture.
    fn tile(&self, source: &dyn TileSource, at: TileRef) -> [u32; 2] {
        let pass = &source.tables().passes[at.pass as usize];
        let edge = source.tile_px();
        let place = [at.tile % pass.tiles[0], at.tile / pass.tiles[0]];
        let side = |axis: usize| (pass.size_px[axis] - place[axis] * edge).min(edge);
        let lines = |pixels: u32| (pixels * self.pixel_bytes).div_ceil(self.line_bytes);
        let first = self.first_lines[at.pass as usize] + at.tile * lines(edge * edge);
        [first, lines(side(0) * side(1))]
    }
}

/// The items of a phase.
pub struct Items<'a, 'f> {
    /// Reads the quads of an item.
    pub reader: Cores<'f>,
    /// The trace as rendered.
    pub source: &'a dyn TileSource,
    /// The scheduler's queue.
    pub queue: &'a Queue,
    /// The machine.
    pub machine: &'a Machine,
    /// What tiles write.
    pub pictures: &'a Pictures,
    /// True if some warps of each item start before the others.
    pub priority: bool,
    cursor: Cursor,
    /// Items taken.
    taken: u64,
    /// Dealt items that some cores have not taken, from number `first` on.
    dealt: VecDeque<Vec<Part>>,
    first: u64,
    /// Items that each core has taken, if dealt.
    of_core: Vec<u64>,
    quads: Quads,
}

/// The quads of an item.
#[derive(Default)]
struct Quads {
    /// Requests of each quad.
    of: Vec<Range<usize>>,
    requests: Vec<Request>,
    lines: Vec<u32>,
}

/// What is left of a queue.
enum Cursor {
    /// Items in order; any core takes the next one.
    All(Range<usize>),
    /// The next item of each core, and the number of cores.
    Own(Vec<usize>),
    /// Groups that are left, and the items of each core's group.
    Groups(Range<usize>, Vec<Range<usize>>),
}

impl<'a, 'f> Items<'a, 'f> {
    /// All items of a queue.
    pub fn new(
        reader: Cores<'f>,
        source: &'a dyn TileSource,
        queue: &'a Queue,
        machine: &'a Machine,
        pictures: &'a Pictures,
        priority: bool,
    ) -> Self {
        let cores = machine.cores;
        let cursor = match &queue.hand_out {
            HandOut::FirstIdle | HandOut::Dealt(..) => Cursor::All(0..queue.items.len()),
            HandOut::Static => Cursor::Own((0..cores).collect()),
            HandOut::BothEnds(ends) => Cursor::Groups(0..ends.len(), vec![0..0; cores]),
        };
        Self {
            reader,
            source,
            queue,
            machine,
            pictures,
            priority,
            cursor,
            taken: 0,
            dealt: VecDeque::new(),
            first: 0,
            of_core: vec![0; cores],
            quads: Quads::default(),
        }
    }

    /// Position of the next item of a core.
    fn next(&mut self, core: usize) -> Option<usize> {
        match &mut self.cursor {
            Cursor::All(left) => left.next(),
            Cursor::Own(next) => {
                let at = next[core];
                next[core] += self.machine.cores;
                (at < self.queue.items.len()).then_some(at)
            }
            Cursor::Groups(left, of_cores) => {
                let HandOut::BothEnds(groups) = &self.queue.hand_out else {
                    return None;
                };
                loop {
                    if let Some(item) = of_cores[core].next() {
                        return Some(item);
                    }
                    let group = match core % 2 {
                        0 => left.next(),
                        _ => left.next_back(),
                    }?;
                    of_cores[core] = groups[group].clone();
                }
            }
        }
    }

    /// Reads the quads of an item and gives each to `to(number of the quad)`.
    fn read(
        &mut self,
        item: &WorkItem,
        parts: &mut [Part],
        mut to: impl FnMut(usize) -> usize,
    ) -> Result<(), StreamError> {
        self.reader.load(0, item)?;
        let mut warps: Vec<Vec<usize>> = vec![Vec::new(); parts.len()];
        self.quads.clear();
        while let Some(quad) = self.reader.next_quad(0) {
            let number = self.quads.of.len();
            let place = to(number);
            self.quads.push(quad);
            let warp = &mut warps[place];
            warp.push(number);
            if warp.len() == self.machine.warp_quads {
                add_warp(self.machine, warp, &self.quads, &mut parts[place]);
                warp.clear();
            }
        }
        for (warp, part) in warps.iter().zip(parts.iter_mut()) {
            if !warp.is_empty() {
                add_warp(self.machine, warp, &self.quads, part);
            }
        }
        let count = parts.len() as u32;
        for (place, part) in (0..).zip(parts.iter_mut()) {
            for at in item.tiles() {
                let [first, lines] = self.pictures.tile(self.source, at);
                // The cores of a dealt tile write equal shares of it.
                let [from, to] = [place, place + 1].map(|share| lines * share / count);
                if part.write_lines == 0 {
                    part.write_first = first + from;
                }
                part.write_lines += to - from;
            }
            if self.priority {
                start_some_first(&mut part.warps);
            }
        }
        Ok(())
    }

    /// Where each quad of an item is.
    fn places(&self, item: &WorkItem) -> Result<Vec<Place>, StreamError> {
        let passes = &self.source.tables().passes;
        let mut places = Vec::new();
        for_quads(self.source, item, |quad| {
            let columns = passes[quad.at.pass as usize].tiles[0];
            let record = quad.records[0];
            places.push(Place {
                quad: [record.x, record.y].map(u32::from),
                tile: [quad.at.tile % columns, quad.at.tile / columns],
                tile_quads: self.source.tile_px() / 2,
            });
            Ok::<(), StreamError>(())
        })?;
        Ok(places)
    }
}

impl Source for Items<'_, '_> {
    type Error = StreamError;

    fn take(&mut self, core: usize, part: &mut Part) -> Result<bool, StreamError> {
        let queue = self.queue;
        let HandOut::Dealt(core_of, _) = queue.hand_out else {
            let Some(index) = self.next(core) else {
                return Ok(false);
            };
            (part.item, part.index) = (self.taken, index);
            self.taken += 1;
            self.read(&queue.items[index], std::slice::from_mut(part), |_| 0)?;
            return Ok(true);
        };
        let number = self.of_core[core];
        if number == self.taken {
            let Some(index) = self.next(core) else {
                return Ok(false);
            };
            let item = &queue.items[index];
            let mut parts = vec![Part::default(); self.machine.cores];
            let places = self.places(item)?;
            let cores = self.machine.cores;
            self.read(item, &mut parts, |quad| core_of(&places[quad], cores))?;
            for part in &mut parts {
                (part.item, part.index) = (number, index);
            }
            self.taken += 1;
            self.dealt.push_back(parts);
        }
        *part = std::mem::take(&mut self.dealt[(number - self.first) as usize][core]);
        self.of_core[core] += 1;
        while self.of_core.iter().all(|taken| *taken > self.first) {
            self.dealt.pop_front();
            self.first += 1;
        }
        Ok(true)
    }

    fn parts(&self) -> u32 {
        match self.queue.hand_out {
            HandOut::Dealt(..) => self.machine.cores as u32,
            _ => 1,
        }
    }

    fn cores_wait(&self) -> bool {
        matches!(self.queue.hand_out, HandOut::Dealt(_, true))
    }
}

impl Quads {
    fn clear(&mut self) {
        self.of.clear();
        self.requests.clear();
        self.lines.clear();
    }

    /// Adds the requests of a quad: its footprints level by level, with the distinct lines of each level.
    fn push(&mut self, quad: QuadLines<'_>) {
        let start = self.requests.len();
        let mut cell = None;
        for footprint in quad.footprints() {
            let first = self.lines.len() as u32;
            if cell.replace(footprint.cell) != Some(footprint.cell) {
                self.requests.push(Request {
                    first,
                    end: first,
                    footprints: 0,
                });
            }
            let Some(request) = self.requests.last_mut() else {
                continue;
            };
            request.footprints += 1 + footprint.repeats;
            for &line in footprint.lines {
                if !self.lines[request.first as usize..].contains(&line) {
                    self.lines.push(line);
                }
            }
            request.end = self.lines.len() as u32;
        }
        self.of.push(start..self.requests.len());
    }
}

/// Appends a warp of these quads: the first level of each quad, then the second, and so on.
fn add_warp(machine: &Machine, numbers: &[usize], quads: &Quads, part: &mut Part) {
    let of = |number: &usize| &quads.requests[quads.of[*number].clone()];
    let levels = numbers.iter().map(|number| of(number).len()).max();
    let requests = (0..levels.unwrap_or(0)).flat_map(|level| {
        let of_level = numbers
            .iter()
            .filter_map(move |number| of(number).get(level));
        of_level.map(|request| {
            let lines = &quads.lines[request.first as usize..request.end as usize];
            (lines, request.footprints)
        })
    });
    part.add_warp(requests, numbers.len() as u32, machine.alu_ticks, false);
}

/// Moves every eighth warp to the front, with priority.
fn start_some_first(warps: &mut [Warp]) {
    for warp in warps.iter_mut().step_by(PRIORITY_STRIDE) {
        warp.priority = true;
    }
    warps.sort_by_key(|warp| !warp.priority);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_eighth_warp_starts_first() {
        let warp = |first| Warp {
            first,
            end: first,
            quads: 1,
            alu_ticks: [1; 2],
            priority: false,
        };
        let mut warps: Vec<Warp> = (0..18).map(warp).collect();
        start_some_first(&mut warps);
        let order: Vec<u32> = warps.iter().map(|warp| warp.first).collect();
        assert_eq!(order[..5], [0, 8, 16, 1, 2]);
        assert_eq!(order[17], 17);
    }
}
