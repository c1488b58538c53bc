//! The buffer with vertices, indices and indirect draws.

use crate::gpu::{Buffer, Gpu, Result};
use ash::vk;

/// Vertices, indices and indirect draws in the buffer of geometry.
pub const INDICES_AT: u64 = 512;
pub const INDIRECT_AT: u64 = 768;
pub const INDEXED_AT: u64 = 1024;
pub const COUNTS_AT: u64 = 1280;
/// First vertex and number of vertices of each shape: the whole target, half of it, some triangles.
pub const SHAPES: [(u32, u32); 4] = [(0, 6), (6, 6), (12, 3), (12, 12)];

pub(super) fn geometry(gpu: &Gpu) -> Result<Buffer> {
    let mut bytes = vec![0; 2048];
    let quad = [
        [-1.0, -1.0],
        [1.0, -1.0],
        [-1.0, 1.0],
        [1.0, -1.0],
        [1.0, 1.0],
        [-1.0, 1.0_f32],
    ];
    let some = (0..12).map(|i| {
        let angle = 2.3 * i as f32;
        [0.9 * angle.sin(), 0.9 * (1.7 * angle).cos()]
    });
    let half = quad.map(|at| at.map(|v| 0.5 * v));
    let all = quad.into_iter().chain(half).chain(some);
    let vertices: Vec<[f32; 4]> = all
        .map(|[x, y]| [x, y, 0.5 + 0.5 * x, 0.5 + 0.5 * y])
        .collect();
    let mut put = |at: u64, of: &[u8]| bytes[at as usize..][..of.len()].copy_from_slice(of);
    put(0, bytemuck::cast_slice(&vertices));
    // The indices take the triangles in the opposite order.
    let indices: Vec<u16> = (0..24).map(|i| 23 - i).collect();
    put(INDICES_AT, bytemuck::cast_slice(&indices));
    let indirect: [[u32; 4]; 3] = [[6, 1, 0, 0], [3, 2, 12, 0], [12, 1, 12, 3]];
    put(INDIRECT_AT, bytemuck::cast_slice(&indirect));
    let indexed: [[u32; 5]; 3] = [[6, 1, 12, 0, 0], [9, 1, 0, 0, 0], [3, 3, 6, 0, 1]];
    put(INDEXED_AT, bytemuck::cast_slice(&indexed));
    put(COUNTS_AT, bytemuck::cast_slice(&[2_u32, 0, 3]));
    use vk::BufferUsageFlags as Usage;
    let usage = Usage::VERTEX_BUFFER | Usage::INDEX_BUFFER | Usage::INDIRECT_BUFFER;
    gpu.buffer_of(&bytes, usage | Usage::TRANSFER_SRC)
}
