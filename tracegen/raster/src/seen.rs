//! Which images a capture's views sample: only those need texels.

use super::capture::CaptureJob;
use super::draws::DrawMode;
use super::error::RasterError;
use super::groups::MATERIAL_TEXTURES;
use formats::view::FrameViews;
use glam::Mat4;
use scene::Scene;
use visibility::triangles;

impl CaptureJob<'_> {
    /// For each image of the scene, whether a draw that samples it may be seen by a view of any
    /// frame, or is a masked caster that a shadow cascade may see.
    ///
    /// # Errors
    /// Eyes that the culling technique is not made for.
    pub fn seen_images(
        &self,
        scene: &Scene,
        frames: &[FrameViews],
    ) -> Result<Vec<bool>, RasterError> {
        let mut seen = vec![false; scene.images.len()];
        for views in frames {
            let frame = self.frame(views)?;
            for view in frame.views() {
                let all = |_| MATERIAL_TEXTURES;
                self.mark(scene, view.clip_from_world(), view.visible, all, &mut seen);
            }
            for (cascade, casters) in frame.lighting.cascades.iter().zip(&frame.casters) {
                // A masked caster samples its base colour, the first slot.
                let slots = |mode| usize::from(mode == DrawMode::Masked);
                self.mark(scene, cascade.clip_from_world, casters, slots, &mut seen);
            }
        }
        Ok(seen)
    }

    /// Marks the images in the first `slots` of the materials that the view may see.
    fn mark(
        &self,
        scene: &Scene,
        clip_from_world: Mat4,
        visible: &[u32],
        slots: impl Fn(DrawMode) -> usize,
        seen: &mut [bool],
    ) {
        for &index in visible {
            let call = &self.draws.calls[index as usize];
            let mesh = &scene.meshes[call.mesh];
            let sampled = scene.materials[call.material].textures();
            let sampled = || sampled[..slots(call.mode)].iter().flatten();
            let inside = || {
                let (transform, triangles) = (&call.transform, &mesh.indices);
                triangles::any_inside(&mesh.positions, triangles, transform, clip_from_world)
            };
            if sampled().any(|t| seen.get(t.image) == Some(&false)) && inside() {
                for texture in sampled() {
                    if let Some(seen) = seen.get_mut(texture.image) {
                        *seen = true;
                    }
                }
            }
        }
    }
}
