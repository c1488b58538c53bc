//! Culling techniques by name: which volume each draws for a stereo frame.

mod registry;

pub use registry::{Culling, Technique, UnknownCulling};
