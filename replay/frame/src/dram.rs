//! DRAM as the caches see it: reads of lines and writes of tiles, each answered once.

use super::machine::{DramMachine, Machine};
use sim::memory::TICKS;
use sim::memory::dram::{Channels, ClosedLoop, DramConfig};
use std::collections::VecDeque;

/// An answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// A line that was read.
    Read(u32),
    /// All lines of the tile in this core's slot are written.
    Written(usize, usize),
}

/// A tile that is written.
#[derive(Clone, Copy, Debug)]
struct Write {
    core: usize,
    slot: usize,
    /// The next line.
    line: u32,
    /// Lines that are not started, and lines that are not answered.
    waiting: u32,
    open: u32,
    /// Cycle of the last answer so far.
    end: u64,
}

/// DRAM.
pub struct Dram {
    kind: Kind,
    /// Writes by number. A number is used again when its write is answered.
    writes: Vec<Write>,
    free: Vec<usize>,
    /// Numbers of writes with lines that are not started.
    queue: VecDeque<usize>,
    /// Lines of these.
    waiting: u64,
    reads_in_flight: u64,
    counted: u64,
    occupancy: u64,
    /// Cycles from request to arrival, summed over reads that arrived.
    pub latencies: u64,
    /// Lines read and written.
    pub lines: [u64; 2],
}

enum Kind {
    Rate {
        latency: u64,
        ticks: u64,
        most_writes: u64,
        /// Tick at which the channel is free.
        free: u64,
        reads: VecDeque<u32>,
    },
    Banks(Box<ClosedLoop>, Vec<(u64, u64)>),
}

/// Makes the channels of a machine with banks and rows.
pub type MakeChannels<'a> = dyn Fn(&DramConfig) -> Box<dyn Channels> + Sync + 'a;

/// Reads have the number of their line, writes this bit, the number of their tile and the place in it.
const WRITE: u64 = 1 << 62;

impl Dram {
    /// An idle memory.
    pub fn new(machine: &Machine, channels: &MakeChannels<'_>) -> Self {
        let kind = match machine.dram {
            DramMachine::Rate {
                latency,
                ticks_per_line,
                most_writes,
            } => Kind::Rate {
                latency,
                ticks: ticks_per_line,
                most_writes,
                free: 0,
                reads: VecDeque::new(),
            },
            DramMachine::Banks(config) => {
                let channels = channels(&config);
                let memory = ClosedLoop::new(channels, &config, machine.line_bytes);
                Kind::Banks(Box::new(memory), Vec::new())
            }
        };
        Self {
            kind,
            writes: Vec::new(),
            free: Vec::new(),
            queue: VecDeque::new(),
            waiting: 0,
            reads_in_flight: 0,
            counted: 0,
            occupancy: 0,
            latencies: 0,
            lines: [0; 2],
        }
    }

    /// Adds a read. It starts at the poll of this cycle, which is to follow.
    pub fn read(&mut self, now: u64, line: u32) {
        self.occupancy_until(now);
        self.reads_in_flight += 1;
        self.latencies = self.latencies.wrapping_sub(now);
        self.lines[0] += 1;
        match &mut self.kind {
            Kind::Rate { reads, .. } => reads.push_back(line),
            Kind::Banks(memory, _) => memory.read(now, line, line.into()),
        }
    }

    /// Counts a read that arrives in this cycle.
    pub fn arrived(&mut self, now: u64) {
        self.occupancy_until(now);
        self.reads_in_flight -= 1;
        self.latencies = self.latencies.wrapping_add(now);
    }

    /// Adds the lines of a tile, at least one.
    pub fn write(&mut self, core: usize, slot: usize, line: u32, lines: u32) {
        self.lines[1] += u64::from(lines);
        self.waiting += u64::from(lines);
        let write = Write {
            core,
            slot,
            line,
            waiting: lines,
            open: lines,
            end: 0,
        };
        let number = self.free.pop().unwrap_or(self.writes.len());
        match self.writes.get_mut(number) {
            Some(place) => *place = write,
            None => self.writes.push(write),
        }
        self.queue.push_back(number);
    }

    /// Sum over cycles of the reads in flight.
    pub fn occupancy_until(&mut self, now: u64) -> u64 {
        self.occupancy += self.reads_in_flight * (now - self.counted);
        self.counted = now;
        self.occupancy
    }

    /// Starts what can start in this cycle. Calls `answer` with the cycle of each answer that is now known. Returns the
    /// cycle of the next poll, if one is needed.
    pub fn poll(&mut self, now: u64, mut answer: impl FnMut(u64, Answer)) -> Option<u64> {
        if let Kind::Banks(memory, answers) = &mut self.kind {
            while let Some(&number) = self.queue.front() {
                let write = &mut self.writes[number];
                let name = WRITE | (number as u64) << 32 | u64::from(write.waiting);
                if !memory.write(now, write.line, name) {
                    break;
                }
                self.waiting -= 1;
                if write.start() {
                    self.queue.pop_front();
                }
            }
            memory.advance(now, answers);
            for (name, at) in answers.drain(..) {
                let at = at.max(now + 1);
                if name & WRITE == 0 {
                    answer(at, Answer::Read(name as u32));
                    continue;
                }
                let number = ((name & !WRITE) >> 32) as usize;
                if let Some((end, written)) = self.writes[number].answer(at) {
                    answer(end, written);
                    self.free.push(number);
                }
            }
            let waits = memory.is_busy() || !self.queue.is_empty();
            return waits.then(|| now + memory.poll_cycles());
        }
        let Kind::Rate {
            latency,
            ticks,
            most_writes,
            free,
            reads,
        } = &mut self.kind
        else {
            return None;
        };
        while *free / TICKS <= now {
            let start = (*free).max(now * TICKS);
            let writes = self.queue.front().copied();
            let writes = writes.filter(|_| self.waiting > *most_writes || reads.is_empty());
            if let Some(number) = writes {
                self.waiting -= 1;
                if self.writes[number].start() {
                    self.queue.pop_front();
                }
                let end = (start + *ticks).div_ceil(TICKS).max(now + 1);
                if let Some((end, written)) = self.writes[number].answer(end) {
                    answer(end, written);
                    self.free.push(number);
                }
            } else if let Some(line) = reads.pop_front() {
                answer(start.div_ceil(TICKS) + *latency, Answer::Read(line));
            } else {
                break;
            }
            *free = start + *ticks;
        }
        let waits = !(reads.is_empty() && self.queue.is_empty());
        waits.then(|| (*free / TICKS).max(now + 1))
    }
}

impl Write {
    /// Starts a line. Returns true for the last one.
    fn start(&mut self) -> bool {
        self.line = self.line.wrapping_add(1);
        self.waiting -= 1;
        self.waiting == 0
    }

    /// Takes the answer to a line. Returns the answer to the tile after the last one.
    fn answer(&mut self, at: u64) -> Option<(u64, Answer)> {
        self.open -= 1;
        self.end = self.end.max(at);
        (self.open == 0).then_some((self.end, Answer::Written(self.core, self.slot)))
    }
}
