//! The shader's `View` and `Material`.

use crate::backend::View;
use crate::cascades::Cascade;
use crate::lighting::{Lighting, MAX_POINT_LIGHTS};
use glam::{Mat4, Vec3, Vec4};
use scene::{AlphaMode, Material, TextureSlot};

/// Number of shadow cascades in the shader.
pub const MAX_CASCADES: usize = 4;

/// The shader's `View`.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct ViewData {
    clip_from_world: [[f32; 4]; 4],
    world_from_clip: [[f32; 4]; 4],
    eye: [f32; 4],
    to_sun: [f32; 4],
    sun: [f32; 4],
    sky: [f32; 4],
    ground: [f32; 4],
    shadow_texel_m: [f32; 4],
    cascades: [[[f32; 4]; 4]; MAX_CASCADES],
    points: [[[f32; 4]; 2]; MAX_POINT_LIGHTS],
    counts: [u32; 4],
    lens: [f32; 4],
}

impl ViewData {
    /// The view of an eye. The record buffer holds `capacity` records.
    pub fn of_eye(view: &View<'_>, capacity: u32) -> Self {
        Self::new(
            view.clip_from_world(),
            (view.lighting).highlights_from(Vec3::from_array(view.layer.view.position)),
            view.lighting,
            capacity,
        )
    }

    /// Adds a lens, inside which marks are counted separately.
    pub fn with_lens(self, lens_px: [f32; 4]) -> Self {
        Self {
            lens: lens_px,
            ..self
        }
    }

    /// Selects the texture slot of the materials.
    pub fn with_texture_slot(mut self, slot: TextureSlot) -> Self {
        self.counts[2] = slot as u32;
        self
    }

    /// The light's view of a cascade.
    pub fn of_cascade(cascade: &Cascade, lighting: &Lighting) -> Self {
        Self::new(cascade.clip_from_world, Vec3::ZERO, lighting, 0)
    }

    fn new(clip_from_world: Mat4, eye: Vec3, lighting: &Lighting, capacity: u32) -> Self {
        let mut data: Self = bytemuck::Zeroable::zeroed();
        let color = |c: Vec3| c.extend(0.0).to_array();
        data.clip_from_world = clip_from_world.to_cols_array_2d();
        data.world_from_clip = clip_from_world.inverse().to_cols_array_2d();
        data.eye = color(eye);
        data.to_sun = color(lighting.to_sun);
        data.sun = color(lighting.sun);
        data.sky = color(lighting.sky.sky);
        data.ground = color(lighting.sky.ground);
        for (k, cascade) in lighting.cascades.iter().take(MAX_CASCADES).enumerate() {
            data.shadow_texel_m[k] = cascade.texel_m;
            data.cascades[k] = (clip_to_uv() * cascade.clip_from_world).to_cols_array_2d();
        }
        let points = lighting.points.iter().take(MAX_POINT_LIGHTS);
        data.counts = [points.len() as u32, capacity, 0, 0];
        for (row, (position, intensity)) in data.points.iter_mut().zip(points) {
            *row = [color(*position), color(*intensity)];
        }
        data
    }
}

/// Clip space (y up) to texture coordinates (v down). Depth is unchanged.
fn clip_to_uv() -> Mat4 {
    Mat4::from_cols(
        Vec4::new(0.5, 0.0, 0.0, 0.0),
        Vec4::new(0.0, -0.5, 0.0, 0.0),
        Vec4::Z,
        Vec4::new(0.5, 0.5, 0.0, 1.0),
    )
}

/// The shader's `Material`.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct MaterialData {
    base_color: [f32; 4],
    emissive: [f32; 4],
    specular: [f32; 4],
    surface: [f32; 4],
    uv_rows: [[f32; 4]; 2 * TextureSlot::COUNT],
}

impl MaterialData {
    /// The data of a material.
    pub fn new(material: &Material) -> Self {
        let mut uv_rows = [[0.0; 4]; 2 * TextureSlot::COUNT];
        for (slot, t) in material.textures.iter() {
            for (row, m) in t.uv_transform.iter().enumerate() {
                uv_rows[2 * slot as usize + row] = [m[0], m[1], m[2], t.uv_set as f32];
            }
        }
        let cutoff = match material.alpha {
            AlphaMode::Mask(cutoff) => cutoff,
            AlphaMode::Opaque | AlphaMode::Blend => 0.0,
        };
        Self {
            base_color: material.base_color.to_array(),
            emissive: material.emissive.extend(material.normal_scale).to_array(),
            specular: material.specular.extend(cutoff).to_array(),
            surface: [material.metallic, material.roughness, 0.0, 0.0],
            uv_rows,
        }
    }
}
