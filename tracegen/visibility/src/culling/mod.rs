//! Culling techniques, one per file. Each computes the volumes in which draws of a stereo frame may be
//! visible.
//!
//! To add a technique, add a file with a function from a frame to volumes, its `mod` line below, and a row of
//! the table in `registry.rs`.

mod conical;
mod conical_round_robin;
mod conical_superfrustum;
mod none;
mod per_eye;
mod registry;
mod round_robin;
mod superfrustum;
#[cfg(test)]
mod tests;

pub use registry::{Culling, Technique, UnknownCulling};
pub use superfrustum::Superfrustum;

use crate::hierarchy::{Hierarchy, Scratch};
use crate::rig::{Rig, TooWide};
use crate::volume::{Prepared, Volume, frustum};
use glam::{DVec3, Mat4};

/// Inputs that determine the volumes of a frame.
pub(crate) struct CullInput<'a> {
    rig: &'a Rig,
    /// Frame number, whose parity selects the eye of round-robin techniques.
    number: u32,
    /// Largest absolute coordinates of the draws, metres.
    extent: DVec3,
}

/// Volumes in which a draw may be visible.
#[derive(Clone, Debug)]
pub enum Volumes {
    /// All of space; nothing is tested.
    Everything,
    /// The union of these volumes.
    Any(Vec<Volume>),
}

impl Hierarchy {
    /// The volumes of a frame of `rig`.
    ///
    /// # Errors
    /// The technique needs a single volume around both eyes, and there is none.
    pub fn volumes(&self, rig: &Rig, culling: Culling, frame: u32) -> Result<Volumes, TooWide> {
        culling.volumes(&CullInput {
            rig,
            number: frame,
            extent: self.extent(),
        })
    }

    /// Writes the draws that the technique keeps to `list`, ascending and for both eyes together. Returns the
    /// number of tests of one box against one volume.
    ///
    /// # Errors
    /// The technique needs a single volume around both eyes, and there is none.
    pub fn cull(
        &self,
        rig: &Rig,
        culling: Culling,
        frame: u32,
        scratch: &mut Scratch,
        list: &mut Vec<u32>,
    ) -> Result<u64, TooWide> {
        match self.volumes(rig, culling, frame)? {
            Volumes::Everything => {
                list.clear();
                list.extend(0..self.len() as u32);
                Ok(0)
            }
            Volumes::Any(volumes) => {
                let extent = self.extent();
                let prepared: Vec<Prepared> = volumes
                    .iter()
                    .map(|volume| volume.prepare(extent))
                    .collect();
                Ok(self.collect(&prepared, scratch, list))
            }
        }
    }

    /// The draws that may be in the frustum of a clip matrix (depth 0 to 1), ascending. Used for single views
    /// and shadow cascades.
    pub fn entering(&self, clip_from_world: Mat4) -> Vec<u32> {
        let extent = self.extent();
        let volume = Volume::new(frustum(clip_from_world, extent), None);
        let mut list = Vec::new();
        self.collect(
            &[volume.prepare(extent)],
            &mut Scratch::default(),
            &mut list,
        );
        list
    }
}
