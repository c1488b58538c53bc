//! Memory of textures and of rays as time sees it: a fixed latency behind a channel of limited or unlimited bandwidth.
//!
//! Requests are served in order of time, without rows and banks. A read that finds the channel free takes exactly the
//! latency.

use super::server::TICKS;

/// Lines that other work transfers at equal intervals.
#[derive(Clone, Copy, Debug)]
struct Stream {
    start: u64,
    cycles: u64,
    lines: u64,
    sent: u64,
}

/// Memory with a fixed latency.
#[derive(Clone, Debug)]
pub struct SimpleMemory {
    latency: u64,
    ticks_per_line: u64,
    /// Tick at which the channel is free.
    free: u64,
    stream: Stream,
    /// Tick at which the stream's last line so far has been transferred.
    stream_end: u64,
}

impl SimpleMemory {
    /// Idle memory. A line occupies its channel for `ticks_per_line`; 0: unlimited bandwidth.
    pub fn new(latency_cycles: u64, ticks_per_line: u64) -> Self {
        let stream = Stream {
            start: 0,
            cycles: 1,
            lines: 0,
            sent: 0,
        };
        Self {
            latency: latency_cycles,
            ticks_per_line,
            free: 0,
            stream,
            stream_end: 0,
        }
    }

    /// Reads a line in cycle `now`. Returns the cycle in which the data arrives.
    #[inline(always)]
    pub fn read(&mut self, now: u64) -> u64 {
        if self.ticks_per_line == 0 {
            return now + self.latency;
        }
        self.send_until(now);
        let start = self.transfer(now);
        start.div_ceil(TICKS) + self.latency
    }

    /// Starts the transfers of other work: `lines` lines over `cycles` cycles. The previous stream has ended.
    pub fn start_stream(&mut self, now: u64, cycles: u64, lines: u64) {
        self.stream = Stream {
            start: now,
            cycles,
            lines,
            sent: 0,
        };
    }

    /// Sends the rest of the stream. Returns the cycle by which all its lines are transferred, `now` or later.
    pub fn end_stream(&mut self, now: u64) -> u64 {
        self.send_until(now);
        if self.stream.lines == 0 {
            return now;
        }
        self.stream_end.div_ceil(TICKS).max(now)
    }

    /// Sends the stream's lines that are due by `now`.
    fn send_until(&mut self, now: u64) {
        while self.stream.sent < self.stream.lines {
            let s = &self.stream;
            let due = s.start + s.sent * s.cycles / s.lines;
            if due > now {
                return;
            }
            self.stream.sent += 1;
            self.transfer(due);
            self.stream_end = self.free;
        }
    }

    /// Occupies the channel for a line, not before cycle `now`. Returns the tick at which the transfer starts.
    fn transfer(&mut self, now: u64) -> u64 {
        let start = self.free.max(now * TICKS);
        self.free = start + self.ticks_per_line;
        start
    }
}
