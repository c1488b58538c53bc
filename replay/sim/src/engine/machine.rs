//! The interface of machines.

use super::outcome::MachineOutcome;
use crate::access::FrameClients;
use crate::config::{Assign, RunConfig};
use crate::order::Phase;
use crate::stream::{Cores, StreamError, Tag};

/// The work of a frame.
pub(super) struct FrameWork<'w, 'c, 'f> {
    pub(super) cores: &'w mut Cores<'c>,
    pub(super) phases: &'w [Phase],
    pub(super) assign: Assign,
    /// The other clients of memory, if simulated.
    pub(super) clients: Option<&'w mut FrameClients<'f>>,
    /// Identifies the frame's work among frames that have an equal one in the trace.
    pub(super) identity: Option<u128>,
}

/// A machine that processes the cores' work: caches, with or without clocks, for one or more configurations.
pub(super) trait Machine: Send {
    /// Runs the phases of a frame. Other clients of memory, if simulated, follow the cores' items.
    fn run(&mut self, frame: FrameWork) -> Result<(), StreamError>;

    /// Performs the accesses of other clients before the first item of a frame or after the last one.
    fn client_accesses(&mut self, _clients: &mut FrameClients<'_>) {}

    /// Applies what happens to the caches after the frame with this index.
    fn between_frames(&mut self, index: usize, config: &RunConfig);

    /// True if it knows the counts of this work with its present contents.
    fn knows(&self, _identity: u128) -> bool {
        false
    }

    /// Repeats known work without its lines.
    fn repeat(&mut self, _identity: u128) {}

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
