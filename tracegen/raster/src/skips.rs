//! Skips invisible work that culling by bounding boxes keeps.

use super::capture::CaptureJob;
use super::cascades::{Cascade, SHADOW_SIZE};
use super::frame::Frame;
use glam::Mat4;
use visibility::receivers::{Receivers, Volume};

/// Width of the border that the shader's look-up leaves unused at a cascade's edge, plus the
/// distance by which it offsets a point from its surface, in texels, rounded up.
const LOOKUP_TEXELS: f32 = 2.0 + 1.6 + 0.4;

impl CaptureJob<'_> {
    /// Removes invisible work from a frame.
    pub(crate) fn skip(&self, frame: &mut Frame) {
        if self.skips.cascades {
            self.skip_cascades(frame);
        }
    }

    /// Finds the shadow cascades that no visible triangle looks up.
    fn skip_cascades(&self, frame: &mut Frame) {
        let volumes: Vec<Volume> = frame.lighting.cascades.iter().map(volume).collect();
        let mut receivers = Receivers::new(&volumes);
        for view in frame.views() {
            receivers.look(view.clip_from_world());
            for &draw in view.visible {
                if receivers.all() {
                    return;
                }
                let call = &self.draws.calls[draw as usize];
                let mesh = &self.scene.meshes[call.mesh];
                receivers.add(call.bounds, &mesh.positions, &mesh.indices, &call.transform);
            }
        }
        frame.cascades_seen = receivers.found().to_vec();
        frame.skipped.cascades += receivers.found().iter().filter(|seen| !**seen).count() as u64;
    }
}

fn volume(cascade: &Cascade) -> Volume {
    let clip: Mat4 = cascade.clip_from_world;
    let depth_by_m = clip.row(2).truncate().length();
    Volume {
        clip_from_world: clip,
        margin: 2.0 * LOOKUP_TEXELS / SHADOW_SIZE as f32,
        end_margin: LOOKUP_TEXELS * cascade.texel_m * depth_by_m,
    }
}
