//! Which images a capture's views sample: only those need texels.

use super::backend::View;
use super::capture::CaptureJob;
use super::draws::DrawMode;
use formats::view::FrameViews;
use glam::Mat4;
use scene::Scene;
use visibility::triangles;

impl CaptureJob<'_> {
    /// For each image of the scene, whether a draw that samples it may be seen by an eye of any
    /// frame, or is a masked caster that a shadow cascade may see.
    #[must_use]
    pub fn seen_images(&self, scene: &Scene, frames: &[FrameViews]) -> Vec<bool> {
        let mut by_eyes = vec![false; self.draws.calls.len()];
        let mut by_cascades = by_eyes.clone();
        for views in frames {
            let lighting = self.light_frame(views);
            for eye in views.eyes {
                let view = View {
                    eye,
                    lighting: &lighting,
                    visible: &[],
                };
                self.mark(scene, view.clip_from_world(), |_| true, &mut by_eyes);
            }
            for cascade in &lighting.cascades {
                let masked = |mode| mode == DrawMode::Masked;
                self.mark(scene, cascade.clip_from_world, masked, &mut by_cascades);
            }
        }
        let mut images = vec![false; scene.images.len()];
        for (draw, call) in self.draws.calls.iter().enumerate() {
            let textures = scene.materials[call.material].textures();
            let sampled = match (by_eyes[draw], by_cascades[draw]) {
                (true, _) => &textures[..],
                // The caster's alpha.
                (false, true) => &textures[..1],
                (false, false) => &[],
            };
            for texture in sampled.iter().flatten() {
                if let Some(image) = images.get_mut(texture.image) {
                    *image = true;
                }
            }
        }
        images
    }

    /// Marks the draws of the chosen modes of which the view may see a triangle.
    fn mark(
        &self,
        scene: &Scene,
        clip_from_world: Mat4,
        chosen: impl Fn(DrawMode) -> bool,
        seen: &mut [bool],
    ) {
        for index in self.draws.visible(clip_from_world) {
            let call = &self.draws.calls[index as usize];
            let mesh = &scene.meshes[call.mesh];
            let seen = &mut seen[index as usize];
            *seen = *seen
                || chosen(call.mode)
                    && triangles::any_inside(
                        &mesh.positions,
                        &mesh.indices,
                        &call.transform,
                        clip_from_world,
                    );
        }
    }
}
