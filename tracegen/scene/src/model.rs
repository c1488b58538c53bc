//! The scene model, filled by every loader and read by every renderer.
//!
//! World space is right-handed, y up, metres. Front faces wind counter-clockwise. Coordinates are
//! relative to [`Scene::origin`], in single precision.

use crate::geometry::{bounding_box, transformed_box};
use crate::{Animation, Image, Motion, TextureSlot, TextureSlots, Textures};
use formats::texture::Sampler;
use glam::{Affine3A, DVec3, Mat3, Vec2, Vec3, Vec4};

/// A whole scene.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// Name for reports: the built-in's name or the file's stem.
    pub name: String,
    /// World position that all coordinates are relative to: zero except for a scene far from zero.
    pub origin: DVec3,
    /// Triangle meshes, each with one material.
    pub meshes: Vec<Mesh>,
    /// Whether a unit is a metre, as in glTF; other files do not say.
    pub in_metres: bool,
    /// Meshes placed in the world, in submission order.
    pub instances: Vec<Instance>,
    /// Which instances of a built-in scene move, and how.
    pub motions: Vec<Motion>,
    /// The animation of a file, or `None` if nothing moves.
    pub animation: Option<Animation>,
    /// Materials.
    pub materials: Vec<Material>,
    /// Images with their colour space (an image used in both spaces is listed twice).
    pub images: Vec<Image>,
    /// Named cameras; never empty once loaded (`cameras::default_camera` fills it).
    pub cameras: Vec<Camera>,
    /// Lights.
    pub lights: Vec<Light>,
    /// Background and ambient radiance, linear RGB.
    pub sky: Vec3,
    /// The scene's own choice of `--shadows`: 0 none, 1 one shadow map, more: that many cascades.
    pub shadow_cascades: u32,
}

/// An indexed triangle list with one material.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Name for reports.
    pub name: String,
    /// Positions, object space.
    pub positions: Vec<Vec3>,
    /// Unit normals, one per position.
    pub normals: Vec<Vec3>,
    /// Tangents with the bitangent's sign in w, one per position (computed where the file has
    /// none).
    pub tangents: Vec<Vec4>,
    /// Texture coordinates set 0, one per position (zero where the file has none).
    pub uv0: Vec<Vec2>,
    /// Texture coordinates set 1, empty where no material of the mesh uses it.
    pub uv1: Vec<Vec2>,
    /// Linear colours with alpha that multiply the base colour, one per position; empty where the
    /// file has none.
    pub colors: Vec<Vec4>,
    /// Three indices per triangle.
    pub indices: Vec<u32>,
    /// Index into the scene's materials.
    pub material: usize,
}

impl Mesh {
    /// Number of triangles.
    pub fn triangles(&self) -> usize {
        self.indices.len() / 3
    }

    /// Object-space bounds. Inverted and infinite for a mesh without vertices.
    pub fn bounds(&self) -> [Vec3; 2] {
        bounding_box(self.positions.iter().copied())
    }
}

/// A mesh placed in the world.
#[derive(Clone, Copy, Debug)]
pub struct Instance {
    /// Index into the scene's meshes.
    pub mesh: usize,
    /// Object to world; may mirror and scale unevenly.
    pub transform: Affine3A,
}

impl Instance {
    /// True where the transform mirrors, which reverses the winding.
    pub fn mirrored(&self) -> bool {
        self.transform.matrix3.determinant() < 0.0
    }

    /// Inverse transpose for normals. An instance with a scale of zero uses its own matrix.
    pub fn normal_matrix(&self) -> Mat3 {
        let matrix = Mat3::from(self.transform.matrix3);
        let inverse = matrix.inverse().transpose();
        if inverse.is_finite() { inverse } else { matrix }
    }
}

/// How a material treats alpha.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum AlphaMode {
    /// Alpha is ignored.
    #[default]
    Opaque,
    /// Fragments whose alpha is below the cutoff are discarded.
    Mask(f32),
    /// Blended over what is behind. Depth is tested and not written.
    Blend,
}

/// A texture as a material uses it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureRef {
    /// Index into the scene's images.
    pub image: usize,
    /// Wrap and filter modes.
    pub sampler: Sampler,
    /// Texture coordinate set, 0 or 1.
    pub uv_set: u32,
    /// `uv' = m * (u, v, 1)`: rows of KHR_texture_transform's 2x3 matrix.
    pub uv_transform: [[f32; 3]; 2],
}

impl TextureRef {
    /// The identity transform.
    pub const IDENTITY: [[f32; 3]; 2] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

    /// Set 0, repeat, trilinear.
    pub fn new(image: usize) -> Self {
        Self {
            image,
            sampler: Sampler::TRILINEAR_REPEAT,
            uv_set: 0,
            uv_transform: Self::IDENTITY,
        }
    }
}

/// A metallic-roughness material with additional parameters for Whitted-style ray tracing.
#[derive(Clone, Debug)]
pub struct Material {
    /// Name for reports.
    pub name: String,
    /// Textures.
    pub textures: Textures,
    /// Linear base colour and alpha.
    pub base_color: Vec4,
    /// Scale of the normal map's x and y.
    pub normal_scale: f32,
    /// Metalness, 0 to 1.
    pub metallic: f32,
    /// Perceptual roughness, 0 to 1.
    pub roughness: f32,
    /// Specular colour (KHR_materials_specular), linear.
    pub specular: Vec3,
    /// Emitted radiance, linear.
    pub emissive: Vec3,
    /// Alpha mode.
    pub alpha: AlphaMode,
    /// Both faces are drawn.
    pub double_sided: bool,
    /// Fraction of light that passes through (glass), 0 to 1. Ray tracing only.
    pub transmission: f32,
    /// Index of refraction. Ray tracing only.
    pub ior: f32,
    /// Fraction mirrored at normal incidence beyond Fresnel's (chrome, polished floors), 0 to 1.
    /// Used by ray tracing only, where smooth metals reflect even if it is 0.
    pub mirror: f32,
}

impl Default for Material {
    fn default() -> Self {
        Self {
            name: String::new(),
            textures: Textures::default(),
            base_color: Vec4::ONE,
            normal_scale: 1.0,
            metallic: 0.0,
            roughness: 0.8,
            specular: Vec3::ONE,
            emissive: Vec3::ZERO,
            alpha: AlphaMode::Opaque,
            double_sided: false,
            transmission: 0.0,
            ior: 1.5,
            mirror: 0.0,
        }
    }
}

/// A named camera: the head's pose. The HMD decides field of view and eyes.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Name.
    pub name: String,
    /// Midpoint between the eyes, metres.
    pub eye: Vec3,
    /// Point looked at.
    pub target: Vec3,
    /// Up direction.
    pub up: Vec3,
    /// The file's vertical field of view in degrees, used with `--vfov file` only.
    pub vfov_deg: f32,
    /// Distance of the near plane, metres.
    pub near: f32,
    /// Distance of the far plane, metres.
    pub far: f32,
}

/// A light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Light {
    /// Parallel light.
    Directional {
        /// Direction in which the light travels, unit length.
        direction: Vec3,
        /// Irradiance, linear RGB.
        color: Vec3,
    },
    /// A point light.
    Point {
        /// Position, metres.
        position: Vec3,
        /// Radiant intensity, linear RGB.
        color: Vec3,
    },
}

impl Scene {
    /// Removes the textures of other slots, and the images that only they sample.
    pub fn keep_texture_slots(&mut self, keep: TextureSlots) {
        let mut new_index = vec![None; self.images.len()];
        let mut kept = Vec::new();
        for material in &mut self.materials {
            for slot in TextureSlot::ALL {
                let texture = &mut material.textures[slot];
                *texture = texture.filter(|_| keep.contains(slot)).map(|texture| {
                    let image = *new_index[texture.image].get_or_insert_with(|| {
                        kept.push(self.images[texture.image].clone());
                        kept.len() - 1
                    });
                    TextureRef { image, ..texture }
                });
            }
        }
        self.images = kept;
    }

    /// Number of triangles over all instances.
    pub fn triangle_count(&self) -> u64 {
        self.instances
            .iter()
            .map(|i| self.meshes[i.mesh].triangles() as u64)
            .sum()
    }

    /// World-space bounds at time 0, `None` for an empty scene.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        let boxes: Vec<[Vec3; 2]> = self.meshes.iter().map(Mesh::bounds).collect();
        let placed = self.instances.iter().filter_map(|i| {
            let positions = &self.meshes[i.mesh].positions;
            (!positions.is_empty()).then(|| transformed_box(positions, boxes[i.mesh], &i.transform))
        });
        let around = |a: [Vec3; 2], b: [Vec3; 2]| [a[0].min(b[0]), a[1].max(b[1])];
        placed.reduce(around).map(|[low, high]| (low, high))
    }
}
