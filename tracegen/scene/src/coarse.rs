//! Texture coordinates for which single precision is too coarse.

use crate::{Mesh, Scene, TextureRef};
use glam::Vec2;

/// Largest allowed rounding step of a coordinate, in texels. Filtering weighs texels in steps of
/// 1/256, and interpolation adds a few rounding errors.
const STEP_TEXELS: f32 = 1.0 / 16.0;

/// A warning about coordinates that are too coarse.
pub(crate) fn warning(scene: &Scene) -> Option<String> {
    let steps = (scene.meshes.iter()).map(|mesh| (largest_step(scene, mesh), mesh));
    let coarse: Vec<_> = steps.filter(|(step, _)| *step > STEP_TEXELS).collect();
    let (step, mesh) = coarse.iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
    Some(format!(
        "texture coordinates of {} meshes are so large that they have steps of up to {step:.3} texels (mesh '{}'): \
         their footprints are off by a few of these; take whole repeats from them",
        coarse.len(),
        mesh.name
    ))
}

/// The largest rounding step of a mesh's coordinates, in texels of the textures that use them.
fn largest_step(scene: &Scene, mesh: &Mesh) -> f32 {
    let Some(material) = scene.materials.get(mesh.material) else {
        return 0.0;
    };
    let largest = [&mesh.uv0, &mesh.uv1].map(|set| {
        let abs = set.iter().map(|uv| uv.abs());
        abs.fold(Vec2::ZERO, Vec2::max)
    });
    let step = |texture: &TextureRef| {
        let [u, v] = largest[usize::from(texture.uv_set == 1)].to_array();
        let size = scene.images.get(texture.image).map_or([0; 2], |i| i.size);
        let texels = |row: [f32; 3], size: u32| {
            (row[0].abs() * u + row[1].abs() * v + row[2].abs()) * size as f32
        };
        let [across, down] = texture.uv_transform;
        texels(across, size[0]).max(texels(down, size[1])) * f32::EPSILON
    };
    material.textures.all().map(step).fold(0.0, f32::max)
}
