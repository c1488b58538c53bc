//! Decides which draws enter which view or shadow cascade. One technique per file.
//!
//! ```text
//! bounds -> Hierarchy (kept, refitted)
//!                |
//! Rig -> Culling -> volumes -> walk -> list of draws, tests
//!                                            |
//!     depth of what was visible -> Pyramid -> Occlusion -> shorter list
//! ```

pub mod binning;
pub mod culling;
mod draw_set;
pub mod frustum;
mod hierarchy;
pub mod magnification;
mod occlusion;
pub mod receivers;
mod rig;
#[cfg(test)]
mod testing;
pub mod triangles;
mod volume;

pub use culling::Culling;
pub use hierarchy::{Hierarchy, Scratch};
pub use occlusion::{Occlusion, Pyramid};
pub use rig::{Eye, Rig, TooWide};
pub use volume::Volume;
