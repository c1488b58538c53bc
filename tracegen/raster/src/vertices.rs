//! Vertices and instances in the layout that the shader reads.

use crate::draws::{DrawCall, DrawList};
use glam::{Mat4, Vec4};
use scene::Mesh;

/// Interleaved vertex of the shader's `Vertex`.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct VertexData {
    position: [f32; 3],
    normal: [f32; 3],
    tangent: [f32; 4],
    uv: [f32; 4],
}

/// Bytes between two vertices.
pub const VERTEX_STRIDE: u64 = size_of::<VertexData>() as u64;

/// The shader's `Instance`.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct InstanceData {
    world_from_object: [[f32; 4]; 4],
    normal_from_object: [[f32; 4]; 4],
}

impl InstanceData {
    /// The row of the draw.
    pub fn new(draw: u32, call: &DrawCall) -> Self {
        let matrix = glam::Mat3::from(call.transform.matrix3);
        let inverse = matrix.inverse().transpose();
        // A flattened instance has no inverse. Its normals keep the object's direction.
        let normal = if inverse.is_finite() { inverse } else { matrix };
        let mut normal_from_object = Mat4::from_mat3(normal);
        normal_from_object.w_axis = Vec4::new(
            f32::from_bits(draw),
            f32::from_bits(call.first_primitive),
            0.0,
            1.0,
        );
        Self {
            world_from_object: Mat4::from(call.transform).to_cols_array_2d(),
            normal_from_object: normal_from_object.to_cols_array_2d(),
        }
    }
}

/// Interleaves a mesh's vertices. Missing attributes get defaults.
pub fn pack(mesh: &Mesh) -> Vec<VertexData> {
    let at2 = |set: &[glam::Vec2], i: usize| set.get(i).copied().unwrap_or_default();
    mesh.positions
        .iter()
        .enumerate()
        .map(|(i, position)| {
            let (uv0, uv1) = (at2(&mesh.uv0, i), at2(&mesh.uv1, i));
            VertexData {
                position: position.to_array(),
                normal: mesh
                    .normals
                    .get(i)
                    .copied()
                    .unwrap_or(glam::Vec3::Y)
                    .to_array(),
                tangent: mesh
                    .tangents
                    .get(i)
                    .copied()
                    .unwrap_or(Vec4::new(1.0, 0.0, 0.0, 1.0))
                    .to_array(),
                uv: [uv0.x, uv0.y, uv1.x, uv1.y],
            }
        })
        .collect()
}

/// Colour of a vertex, 16 bits per channel.
pub type ColorData = [u16; 4];

/// Bytes between two colours.
pub const COLOR_STRIDE: u64 = size_of::<ColorData>() as u64;

/// The mesh's vertex colours, if it has any.
pub fn pack_colors(mesh: &Mesh) -> Vec<ColorData> {
    if mesh.colors.is_empty() {
        return Vec::new();
    }
    let color = |i| mesh.colors.get(i).copied().unwrap_or(Vec4::ONE);
    (0..mesh.positions.len())
        .map(|i| color(i).to_array().map(|c| (c * 65535.0).round() as u16))
        .collect()
}

/// One row per draw, at least one.
pub fn instances(draws: &DrawList) -> Vec<InstanceData> {
    let mut rows: Vec<InstanceData> = (0_u32..)
        .zip(&draws.calls)
        .map(|(draw, call)| InstanceData::new(draw, call))
        .collect();
    if rows.is_empty() {
        rows.push(bytemuck::Zeroable::zeroed());
    }
    rows
}
