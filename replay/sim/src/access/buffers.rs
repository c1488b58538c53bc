//! Buffer addresses of a frame: after the textures, first the mesh buffers, then the buffers written in each frame.

use formats::textrace::geometry::Geometry;

/// Buffers are aligned to pages.
const PAGE_BYTES: u64 = 4096;

/// First bytes of the buffers.
#[derive(Debug)]
pub(super) struct Buffers {
    /// Of the indices of each mesh.
    pub indices: Vec<u64>,
    /// Of the vertices of each mesh, in whole lines.
    pub vertices: Vec<u64>,
    first_of_frame: u64,
    next: u64,
}

impl Buffers {
    pub fn new(geometry: &Geometry, texture_bytes: u64, line_bytes: u64) -> Self {
        let mut next = texture_bytes.next_multiple_of(PAGE_BYTES);
        let mut place = |bytes: u64| {
            let first = next;
            next += bytes.next_multiple_of(line_bytes);
            first
        };
        let indices = geometry.meshes.iter().map(|mesh| {
            let bytes = mesh.indices.len() as u64 * u64::from(mesh.index_bytes);
            place(bytes)
        });
        let indices = indices.collect();
        let vertices = geometry.meshes.iter().map(|mesh| {
            let bytes = u64::from(mesh.vertices) * u64::from(mesh.vertex_bytes);
            place(bytes)
        });
        let vertices = vertices.collect();
        let first_of_frame = next.next_multiple_of(PAGE_BYTES);
        Self {
            indices,
            vertices,
            first_of_frame,
            next: first_of_frame,
        }
    }

    /// Frees the buffers of the previous frame.
    pub(super) fn start_frame(&mut self) {
        self.next = self.first_of_frame;
    }

    /// Allocates a buffer for this frame.
    pub fn place(&mut self, bytes: u64) -> u64 {
        let first = self.next;
        self.next = (first + bytes).next_multiple_of(PAGE_BYTES);
        first
    }
}
