//! Captures a program and converts the capture to a trace.
//!
//! ```text
//! launch: the program under the layer -> a folder of events and records (layer::spool)
//!   -> session: frames, passes, draws -> views: which draw shows which eye
//!   -> drain: records of draws -> quads and their groups -> record::Recorder -> .textrace
//! ```

pub mod browser;
mod check;
mod drain;
mod groups;
mod lanes;
mod launch;
pub mod list;
mod loader;
mod pairs;
mod reads;
mod session;
mod texture;
mod views;
mod watch;
mod x_server;

pub use check::{Check, Difference, check};
pub use drain::{Cameras, DrainError, Drained, Job, drain};
pub use launch::{Launch, LaunchError, openxr_library};
pub use session::{Executed, ProgramFrame, Session, SessionError};
pub use views::{FileError, Other, Role, Rule, RuleFile, View, Views, ViewsError, Wanted};
pub use watch::Watch;
pub use x_server::XServer;
