//! Culling techniques, one per file. Each computes the volumes in which draws of a stereo frame may be
//! visible.
//!
//! To add a technique, add a file with a function from a frame to volumes, its `mod` line and its row below.

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

use self::registry::{row, techniques};
use crate::hierarchy::{Hierarchy, Scratch};
use crate::rig::{Rig, TooWide};
use crate::volume::{Prepared, Volume, frustum};
use glam::{DVec3, Mat4};

techniques! {
    // constant                  name                    title                              inside the lens, nothing visible is lost   help
    NONE                 = row("none",                 "No culling",                      true,  "Every draw, in both eyes", none::volumes);
    PER_EYE              = row("per-eye",              "Per-eye frustum culling",         true,  "What enters either eye's frustum: two frusta, their lists merged", per_eye::volumes);
    SUPERFRUSTUM         = row("superfrustum",         "Superfrustum culling",            true,  "What enters one frustum around both eyes'", superfrustum::volumes);
    ROUND_ROBIN          = row("round-robin",          "Round-robin culling",             false, "What enters the left eye's frustum in even frames, the right eye's in odd ones", round_robin::volumes);
    CONICAL              = row("conical",              "Conical culling",                 true,  "What enters the part of either eye's frustum that its lens shows", conical::volumes);
    CONICAL_ROUND_ROBIN  = row("conical-round-robin",  "Conical round-robin culling",     false, "What the left eye's lens shows in even frames, the right eye's in odd ones", conical_round_robin::volumes);
    CONICAL_SUPERFRUSTUM = row("conical-superfrustum", "Conical superfrustum culling",    true,  "What enters one cone around what both lenses show", conical_superfrustum::volumes);
}

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
