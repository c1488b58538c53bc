//! Geometry in a trace: the vertices that draws read, and the primitives in each tile before any depth
//! test.
//!
//! Geometry is optional: replays of texture accesses do not need it.

mod lists;
mod read;
#[cfg(test)]
pub(crate) mod tests;
mod write;

pub use lists::TileLists;
pub(super) use read::{lists_of, read};
pub(super) use write::Spool;

use super::{Pass, Tables};
use crate::container::ChunkTag;
use crate::error::{Broken, ensure};
use crate::tiles::{TileChunk, TileSpan};
use crate::view::TILE_SIZE_PX;

/// Meshes, and the mesh of each draw.
pub const GEOMETRY: ChunkTag = ChunkTag(*b"GEOM");
/// The primitive lists of all views.
pub const PRIMITIVE_LISTS: ChunkTag = ChunkTag(*b"PLST");
/// Position of the lists of each view.
pub const LIST_INDEX: ChunkTag = ChunkTag(*b"PLIX");
/// Minor version that introduced geometry.
pub const GEOMETRY_MINOR: u16 = 2;
/// Bytes of a mesh without its indices.
pub const MESH_BYTES: usize = 12;
/// Bytes of an entry of the list index.
pub const LIST_INDEX_ENTRY_BYTES: usize = 36;
/// The lists and their index.
const LIST_CHUNK: TileChunk = TileChunk {
    tiles: PRIMITIVE_LISTS,
    index: LIST_INDEX,
    entry_bytes: LIST_INDEX_ENTRY_BYTES,
};
/// Largest width and height of a view in pixels.
const MOST_PIXELS: u32 = 16384;

/// The triangles of a mesh, in the form a driver reads.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct MeshGeometry {
    /// Vertices in the vertex buffer.
    pub vertices: u32,
    /// Bytes from one vertex to the next.
    pub vertex_bytes: u16,
    /// Bytes of an index, 2 or 4.
    pub index_bytes: u16,
    /// Three vertices for each triangle, in the order of the draw's primitives.
    pub indices: Vec<u32>,
}

/// Target of a view.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ViewTarget {
    /// A pass of the trace.
    Pass(u32),
    /// A shadow map, by the number of its cascade.
    ShadowMap(u32),
}

/// A view of a frame that has primitive lists.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GeometryView {
    /// Number of the frame.
    pub frame: u32,
    /// Render target.
    pub target: ViewTarget,
    /// Width and height in pixels.
    pub size_px: [u32; 2],
}

impl GeometryView {
    /// Tile columns and rows.
    pub fn tiles(&self) -> [u32; 2] {
        self.size_px.map(|size| size.div_ceil(TILE_SIZE_PX))
    }

    /// Number of tiles.
    pub fn tile_count(&self) -> usize {
        let [columns, rows] = self.tiles().map(|tiles| tiles as usize);
        columns * rows
    }

    /// Its place in the order of rendering.
    fn place(&self) -> (u32, u32, u32) {
        match self.target {
            ViewTarget::ShadowMap(cascade) => (self.frame, 0, cascade),
            ViewTarget::Pass(pass) => (self.frame, 1, pass),
        }
    }

    fn check(&self, tables: &Tables) -> Result<(), Broken> {
        let frames = &tables.meta.frames;
        let fits = (self.size_px.iter()).all(|size| (1..=MOST_PIXELS).contains(size))
            && frames.iter().any(|views| views.frame == self.frame)
            && match self.target {
                ViewTarget::ShadowMap(_) => true,
                ViewTarget::Pass(pass) => {
                    (tables.passes.get(pass as usize)).is_some_and(|pass: &Pass| {
                        (pass.frame, pass.size_px) == (self.frame, self.size_px)
                    })
                }
            };
        ensure(
            fits,
            "view",
            format_args!(
                "a pass of the trace with its frame and size, or a shadow map of 1 to {MOST_PIXELS} pixels of one of its frames"
            ),
            format_args!("{self:?}"),
        )
    }
}

/// Meshes, the mesh of each draw, and the views that have primitive lists.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Geometry {
    /// The meshes.
    pub meshes: Vec<MeshGeometry>,
    /// Mesh of each draw of the draw table.
    pub draw_meshes: Vec<u32>,
    /// The views, in rendering order.
    pub views: Vec<GeometryView>,
    /// Position of the lists of each view.
    pub(super) spans: Vec<TileSpan>,
}

impl Geometry {
    /// Checks that a view follows the views so far: frames ascend, and so do the shadow maps of a frame and
    /// then its passes.
    fn check_order(&self, view: &GeometryView) -> Result<(), Broken> {
        let follows = (self.views.last()).is_none_or(|last| last.place() < view.place());
        ensure(
            follows,
            format_args!("view {}", self.views.len()),
            "views by ascending frame, of each frame shadow maps before passes, both ascending, none twice",
            format_args!("{view:?} after {:?}", self.views.last()),
        )
    }

    /// Checks that every pass has lists; their order has been checked.
    fn check_passes(&self, tables: &Tables) -> Result<(), Broken> {
        let is_pass = |view: &&GeometryView| matches!(view.target, ViewTarget::Pass(_));
        let found = self.views.iter().filter(is_pass).count();
        let passes = tables.passes.len();
        let expected = format_args!("one for each of {passes} passes");
        ensure(found == passes, "views", expected, found)
    }

    /// Number of the view that a pass is.
    pub fn view_of_pass(&self, pass: usize) -> Option<usize> {
        let of_pass = |view: &GeometryView| match view.target {
            ViewTarget::Pass(number) => number as usize == pass,
            ViewTarget::ShadowMap(_) => false,
        };
        self.views.iter().position(of_pass)
    }

    /// Checks meshes and draws against the tables.
    fn check_meshes(&self, tables: &Tables) -> Result<(), Broken> {
        for (number, mesh) in self.meshes.iter().enumerate() {
            let fits = matches!(mesh.index_bytes, 2 | 4)
                && mesh.vertex_bytes > 0
                && mesh.indices.len().is_multiple_of(3)
                && mesh.indices.iter().all(|index| *index < mesh.vertices);
            ensure(
                fits,
                format_args!("mesh {number}"),
                "indices of 2 or 4 bytes, three for each triangle, below the number of vertices; vertices of at least 1 byte",
                format_args!(
                    "{} indices of {} bytes, {} vertices of {} bytes",
                    mesh.indices.len(),
                    mesh.index_bytes,
                    mesh.vertices,
                    mesh.vertex_bytes
                ),
            )?;
        }
        let (found, draws) = (self.draw_meshes.len(), tables.draws.len());
        ensure(found == draws, "meshes of draws", draws, found)?;
        for (number, (mesh, draw)) in self.draw_meshes.iter().zip(&tables.draws).enumerate() {
            let found = self.meshes.get(*mesh as usize);
            let triangles = found.map(|mesh| mesh.indices.len() / 3);
            let meshes = self.meshes.len();
            ensure(
                triangles == Some(draw.primitives as usize),
                format_args!("mesh of draw {number}"),
                format_args!("one of {meshes} meshes, of {} triangles", draw.primitives),
                format_args!("mesh {mesh} of {triangles:?}"),
            )?;
        }
        Ok(())
    }
}
