//! Culling techniques: the volumes of each for a stereo frame. One technique per file.
//!
//! A technique is a file with a function from a frame to volumes (its `mod` line below) and a row
//! of the table in `registry.rs`.

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
    /// Frame number: its parity chooses the eye of round-robin techniques.
    number: u32,
    /// Largest absolute coordinates of the draws, metres.
    extent: DVec3,
}

/// Volumes in which a draw may be visible.
#[derive(Clone, Debug)]
pub enum Volumes {
    /// Everywhere: nothing is tested.
    Everything,
    /// In any of these.
    Any(Vec<Volume>),
}

impl Hierarchy {
    /// The volumes of a frame of `rig`.
    ///
    /// # Errors
    /// Eyes that the technique cannot lay one volume around.
    pub fn volumes(&self, rig: &Rig, culling: Culling, frame: u32) -> Result<Volumes, TooWide> {
        culling.volumes(&CullInput {
            rig,
            number: frame,
            extent: self.extent(),
        })
    }

    /// Replaces `list` by the draws that the technique keeps, ascending, for both eyes alike, and
    /// tells how many boxes were tested: one test is one box against one volume.
    ///
    /// # Errors
    /// Eyes that the technique cannot lay one volume around.
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

    /// The draws that may enter the frustum of a clip matrix (depth 0 to 1), ascending: those of one
    /// view or of a shadow cascade.
    #[must_use]
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
