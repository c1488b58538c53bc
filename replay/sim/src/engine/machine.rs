//! The interface of machines.

use super::outcome::MachineOutcome;
use crate::access::FrameClients;
use crate::config::{Assign, RunConfig};
use crate::memory::OtherWork;
use crate::order::Phase;
use crate::stream::{Cores, StreamError, Tag};

/// The work of a frame.
pub(super) struct FrameWork<'w, 'c, 'f> {
    pub(super) cores: &'w mut Cores<'c>,
    pub(super) phases: &'w [Phase],
    pub(super) assign: Assign,
    /// The other clients of memory, if simulated.
    pub(super) clients: Option<&'w mut FrameClients<'f>>,
}

/// A machine that processes the cores' work: caches, with or without clocks, for one or more configurations.
pub(super) trait Machine: Send {
    /// Runs the phases of a frame. Other clients of memory, if simulated, follow the cores' items.
    fn run(&mut self, frame: FrameWork) -> Result<(), StreamError>;

    /// Performs the accesses of other clients before the first item of a frame or after the last one.
    fn client_accesses(&mut self, _clients: &mut FrameClients<'_>) {}

    /// Empties the caches between frames.
    fn flush(&mut self);

    /// Between frames, other work empties the L1 caches and fills part of each other cache.
    fn lose(&mut self, other: OtherWork);

    /// The counts for one of its configurations.
    fn outcome(&self, config: &RunConfig) -> MachineOutcome;
}

/// A machine without clocks, which accepts lines from any source.
pub(super) trait AtOnce: Machine {
    /// Accesses lines on the first core, each as a footprint of its own. `missed` receives the lines that
    /// missed in some L1.
    fn lines(&mut self, lines: &[u32], tags: &[Tag], missed: &mut Vec<u32>);

    /// Counts all pending accesses.
    fn finish(&mut self) {}
}
