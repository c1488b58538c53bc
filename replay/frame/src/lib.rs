//! Closed-loop model of frame time: shader cores, texture units, caches and DRAM in one event loop, and the schedulers
//! that give tiles to cores. A miss completes when DRAM delivers it. docs/models/frame-time.md states the machine.
//!
//! | file | contents |
//! | --- | --- |
//! | `machine` | the parameters, and the machine in whole cycles and ticks |
//! | `work` | what a core runs: warps, and the look-ups of their quads |
//! | `dram` | DRAM: a latency and a rate, or banks and rows |
//! | `l2` | the shared cache: banks, MSHRs, ports of the cores |
//! | `core` | a core: warps, ALUs, texture unit, L1 with MSHRs |
//! | `device` | the event loop |
//! | `counts` | counters, and what the model conserves |
//! | `items` | the items of a scheduler as warps of the cores |
//! | `schedulers/` | the schedulers, one a file |
//! | `replay` | the frames of a trace |
//! | `timeline` | a replay over time |
//! | `figures` | milliseconds, bytes, energy and the lower bound |
//!
//! In each cycle, these phases follow each other: DRAM answers; lines from the L2 enter the ports of the cores; lines
//! arrive in L1 caches; filtered textures and ends of instructions reach their warps; banks of the L2 look up one line
//! each; DRAM takes requests; each core in order filters, looks up, issues and launches; idle cores take items.

mod core;
mod counts;
mod device;
mod dram;
mod figures;
mod items;
mod l2;
mod machine;
mod replay;
pub mod schedulers;
mod timeline;
mod work;

pub use counts::{CoreCycles, Counts};
pub use device::{Device, Source};
pub use dram::MakeChannels;
pub use figures::{Bound, Energy, Figures};
pub use machine::{DramModel, Machine, Settings};
pub use replay::{FrameTime, Point, ReplayError, replay, replay_with};
pub use timeline::{FrameTimeline, TileSpan};
pub use work::{Part, Request, Warp};

#[cfg(test)]
mod tests;
