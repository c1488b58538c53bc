//! Finds the mip levels of the scene's images that a capture's views can sample. Only those need
//! texels.

use super::capture::CaptureJob;
use super::draws::{DrawCall, DrawMode, SHADOW_SIZE};
use super::frame::Frame;
use formats::texture::MipFilter;
use glam::Vec2;
use scene::{Mesh, Scene, TextureRef, TextureSlot};
use visibility::magnification::{Pixels, least_derivative_squared};
use visibility::triangles;

/// Largest number of levels by which a driver's level of detail lies below the exact one. The error
/// of llvmpipe's logarithm is at most 0.044.
const DRIVER_LEVELS: f64 = 0.1;
/// Texture coordinates beyond this are too coarse in 32 bits for a bound on their derivatives.
const LARGEST_UV: f32 = 256.0;

impl CaptureJob<'_> {
    /// Lowers the levels of `finest`, which may be empty, to the finest mip level of each image
    /// that may be sampled by a draw that may be visible in the frame, or by a masked caster that
    /// may be visible in a shadow cascade.
    pub(crate) fn add_finest_levels(&self, frame: &Frame, finest: &mut Vec<Option<u32>>) {
        let scene = self.scene;
        if !self.skips.images {
            *finest = vec![Some(0); scene.images.len()];
            return;
        }
        finest.resize(scene.images.len(), None);
        // Moving draws have other positions in every frame and are few, so all their levels are
        // prepared.
        for &draw in &self.draws.moving {
            let material = &scene.materials[self.draws.calls[draw as usize].material];
            for texture in material.textures.all() {
                if let Some(level) = finest.get_mut(texture.image) {
                    *level = Some(0);
                }
            }
        }
        for view in frame.views() {
            let projection = view.layer.view.eye_to_clip;
            let pixels = Pixels {
                clip_from_world: view.clip_from_world(),
                size_px: view.layer.size_px,
                least_w: projection[3][2] / (1.0 + projection[2][2]),
            };
            let all = |_| TextureSlot::COUNT;
            self.sample(scene, &pixels, view.visible, all, finest);
        }
        for (cascade, casters) in frame.lighting.cascades.iter().zip(&frame.casters) {
            // A masked caster samples its base colour, the first slot.
            let slots = |mode| usize::from(mode == DrawMode::Masked);
            let pixels = Pixels {
                clip_from_world: cascade.clip_from_world,
                size_px: [SHADOW_SIZE; 2],
                least_w: 1.0,
            };
            self.sample(scene, &pixels, casters, slots, finest);
        }
    }

    /// Adds the samples of a view through the first `slots` of its draws' materials.
    fn sample(
        &self,
        scene: &Scene,
        pixels: &Pixels,
        visible: &[u32],
        slots: impl Fn(DrawMode) -> usize,
        finest: &mut [Option<u32>],
    ) {
        for &index in visible {
            let call = &self.draws.calls[index as usize];
            let mesh = &scene.meshes[call.mesh];
            let textures = &scene.materials[call.material].textures;
            let sampled = || textures.first(slots(call.mode));
            if !sampled().any(|t| is_new(t, finest)) || !self.any_inside(call, mesh, pixels) {
                continue;
            }
            for set in [0, 1] {
                let of_set = || sampled().filter(move |t| t.uv_set == set);
                if !of_set().any(|t| is_new(t, finest)) {
                    continue;
                }
                let largest = LARGEST_UV / of_set().map(scale).fold(1.0, f32::max);
                let derivative = if self.skips.mip_levels {
                    derivative_squared(call, mesh, set, largest, pixels)
                } else {
                    0.0
                };
                for texture in of_set() {
                    let Some(level) = finest.get_mut(texture.image) else {
                        continue;
                    };
                    let least = least_level(texture, scene.images[texture.image].size, derivative);
                    *level = Some(level.map_or(least, |known| known.min(least)));
                }
            }
        }
    }

    fn any_inside(&self, call: &DrawCall, mesh: &Mesh, pixels: &Pixels) -> bool {
        let (transform, indices) = (&call.transform, &mesh.indices);
        triangles::any_inside(&mesh.positions, indices, transform, pixels.clip_from_world)
    }
}

/// Squared length of the smallest derivative of a mesh's texture coordinates per pixel; 0 if a
/// coordinate is larger than `largest`.
fn derivative_squared(
    call: &DrawCall,
    mesh: &Mesh,
    set: u32,
    largest: f32,
    pixels: &Pixels,
) -> f64 {
    let coordinates = if set == 0 { &mesh.uv0 } else { &mesh.uv1 };
    let uv = |vertex: usize| {
        let uv = coordinates.get(vertex).copied().unwrap_or(Vec2::NAN);
        if uv.abs().max_element() <= largest {
            uv
        } else {
            Vec2::NAN
        }
    };
    least_derivative_squared(&mesh.positions, &mesh.indices, uv, &call.transform, pixels)
}

/// Whether a finer level of a texture's image may be needed than found so far.
fn is_new(texture: &TextureRef, finest: &[Option<u32>]) -> bool {
    finest
        .get(texture.image)
        .is_some_and(|level| *level != Some(0))
}

/// Largest factor by which a texture's transform scales a coordinate.
fn scale(texture: &TextureRef) -> f32 {
    let sum = |row: [f32; 3]| row.map(f32::abs).iter().sum::<f32>();
    sum(texture.uv_transform[0]).max(sum(texture.uv_transform[1]))
}

/// The finest level of an image of `size` texels that is sampled if the square of the smallest
/// derivative of the coordinates is `derivative_squared`.
fn least_level(texture: &TextureRef, size: [u32; 2], derivative_squared: f64) -> u32 {
    if texture.sampler.mip == MipFilter::None {
        return 0;
    }
    let [[a, b, _], [c, d, _]] = texture.uv_transform.map(|row| row.map(f64::from));
    let texels = f64::from(size[0]) * f64::from(size[1]) * (a * d - b * c).abs();
    let level = (derivative_squared * texels).log2() / 2.0 - DRIVER_LEVELS;
    // The conversion saturates, so an unknown level becomes 0.
    level as u32
}
