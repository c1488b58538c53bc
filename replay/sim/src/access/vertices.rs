//! Vertex processing of a view: index and vertex fetch, reuse of shaded vertices, and the data written for tiles.

use super::Traffic;
use super::buffers::Buffers;
use crate::config::{FrameConfig, FrameMachine};
use crate::memory::{Client, Lru, WaysOf};
use crate::result::GeometryCounts;
use formats::textrace::geometry::{Geometry, GeometryView, TileLists, ViewTarget};
use formats::textrace::{Pass, Tables};
use std::collections::VecDeque;

/// Bytes of a shaded position.
pub(super) const POSITION_BYTES: u64 = 16;

/// A view after vertex processing and binning.
#[derive(Debug)]
pub(super) struct ShadedView {
    pub view: GeometryView,
    pub lists: TileLists,
    /// Primitives in at least one tile, ascending.
    pub kept: Vec<u32>,
    /// Shaded vertices of each primitive.
    pub vertices: Vec<[u32; 3]>,
    /// Index in the frame of the view whose varyings this view shares (multiview).
    pub varyings_of: Option<usize>,
    /// First bytes of the shaded positions and varyings.
    pub positions: u64,
    pub varyings: u64,
    /// First byte of each tile's list.
    list_addresses: Vec<u64>,
}

/// What a view reuses from another view.
pub(super) enum Reuse<'a> {
    None,
    /// The reads and varyings of this view, which has this index in the frame.
    Of(&'a ShadedView, usize),
}

/// Vertex processing, and the sums it updates.
pub(super) struct VertexStage<'a> {
    pub geometry: &'a Geometry,
    pub tables: &'a Tables,
    pub machine: &'a FrameConfig,
    pub buffers: &'a mut Buffers,
    pub traffic: &'a mut Traffic,
    pub counts: &'a mut GeometryCounts,
}

impl VertexStage<'_> {
    /// Shades the draws of a view, in order.
    pub(super) fn shade(
        &mut self,
        view: GeometryView,
        lists: TileLists,
        reuse: &Reuse<'_>,
    ) -> ShadedView {
        let mut kept = lists.primitives.clone();
        kept.sort_unstable();
        kept.dedup();
        let line_bytes = u64::from(self.machine.line_bytes);
        let sets = (self.machine.vertex_cache_bytes / line_bytes / 4) as u32;
        let mut fetch = Lru::<WaysOf<4>, u64>::new(sets, WaysOf);
        let mut shader = Shader::new(self.machine.post_transform_entries as usize);
        let mut vertices = Vec::with_capacity(kept.len());
        let (mut written, mut next) = (0_u32, 0);
        for &draw in &lists.draws {
            let mesh = self.geometry.draw_meshes[draw as usize] as usize;
            let (of, first) = (
                &self.geometry.meshes[mesh],
                self.tables.draws[draw as usize].first_primitive,
            );
            self.counts.triangles_submitted += of.indices.len() as u64 / 3;
            let shared = matches!(reuse, Reuse::Of(other, _) if other.lists.draws.binary_search(&draw).is_ok());
            if !shared {
                let bytes = of.indices.len() as u64 * u64::from(of.index_bytes);
                self.traffic
                    .read(Client::Index, self.buffers.indices[mesh], bytes);
            }
            shader.start_draw();
            for (primitive, triangle) in (first..).zip(of.indices.chunks_exact(3)) {
                let is_kept = kept.get(next) == Some(&primitive);
                let mut slots = [0; 3];
                for (slot, &vertex) in slots.iter_mut().zip(triangle) {
                    let (entry, is_new) = shader.shade(vertex);
                    if is_new && !shared {
                        self.counts.vertices_shaded += 1;
                        let at = self.buffers.vertices[mesh]
                            + u64::from(vertex) * u64::from(of.vertex_bytes);
                        let last = at + u64::from(of.vertex_bytes) - 1;
                        for line in at / line_bytes..=last / line_bytes {
                            if !fetch.access(line) {
                                let first = line * line_bytes;
                                self.traffic.read(Client::Vertex, first, line_bytes);
                            }
                        }
                    }
                    *slot = if is_kept {
                        shader.written(entry, &mut written)
                    } else {
                        0
                    };
                }
                if is_kept {
                    vertices.push(slots);
                    next += 1;
                }
            }
        }
        self.counts.triangles_binned += kept.len() as u64;
        self.counts.list_entries += lists.primitives.len() as u64;
        let mut shaded = ShadedView {
            view,
            kept,
            vertices,
            varyings_of: match reuse {
                Reuse::Of(_, place) => Some(*place),
                Reuse::None => None,
            },
            positions: 0,
            varyings: 0,
            list_addresses: vec![0; lists.starts.len().saturating_sub(1)],
            lists,
        };
        if self.machine.machine != FrameMachine::Immediate {
            self.write(&mut shaded, written.into());
        }
        shaded
    }

    /// Writes positions, varyings and primitive lists for the tiles.
    fn write(&mut self, of: &mut ShadedView, vertices: u64) {
        let (buffers, traffic) = (&mut *self.buffers, &mut *self.traffic);
        let bytes = vertices * POSITION_BYTES;
        of.positions = buffers.place(bytes);
        traffic.write(Client::ShadedVertex, of.positions, bytes);
        // A shadow map only needs depth.
        let is_picture = matches!(of.view.target, ViewTarget::Pass(_));
        if is_picture && of.varyings_of.is_none() {
            let bytes = vertices * u64::from(self.machine.varying_bytes);
            of.varyings = buffers.place(bytes);
            traffic.write(Client::ShadedVertex, of.varyings, bytes);
        }
        // Each tile's list starts a line.
        let entry_bytes = u64::from(self.machine.list_entry_bytes);
        let line_bytes = u64::from(self.machine.line_bytes);
        let sizes: Vec<u64> = (0..of.tile_count())
            .map(|tile| of.lists.tile(tile).len() as u64 * entry_bytes)
            .collect();
        let all = sizes.iter().map(|bytes| bytes.next_multiple_of(line_bytes));
        let mut next = buffers.place(all.sum());
        for (address, bytes) in of.list_addresses.iter_mut().zip(sizes) {
            *address = next;
            traffic.write(Client::PrimitiveList, next, bytes);
            next += bytes.next_multiple_of(line_bytes);
        }
    }
}

impl ShadedView {
    /// Number of tiles of the view.
    pub fn tile_count(&self) -> usize {
        self.list_addresses.len()
    }

    /// First byte of a tile's list.
    pub(super) fn list_address(&self, tile: usize) -> u64 {
        self.list_addresses.get(tile).copied().unwrap_or(0)
    }

    /// The pass that the view renders; none for a shadow map.
    pub fn pass<'t>(&self, tables: &'t Tables) -> Option<&'t Pass> {
        match self.view.target {
            ViewTarget::Pass(pass) => tables.passes.get(pass as usize),
            ViewTarget::ShadowMap(_) => None,
        }
    }

    /// Shaded vertices of a primitive of the lists.
    pub(super) fn vertices_of(&self, primitive: u32) -> Option<[u32; 3]> {
        let place = self.kept.binary_search(&primitive).ok()?;
        self.vertices.get(place).copied()
    }
}

/// The post-transform cache: the most recently shaded vertices, first in, first out (Hoppe 1999).
struct Shader {
    /// Each vertex, and the number under which it was written, if it was.
    recent: VecDeque<(u32, Option<u32>)>,
    entries: usize,
}

impl Shader {
    fn new(entries: usize) -> Self {
        Self {
            recent: VecDeque::with_capacity(entries + 1),
            entries,
        }
    }

    /// Empties the cache, because another draw has other vertices.
    fn start_draw(&mut self) {
        self.recent.clear();
    }

    /// Returns the vertex's index in the queue, and whether it was shaded now.
    fn shade(&mut self, vertex: u32) -> (usize, bool) {
        if let Some(entry) = self.recent.iter().position(|(recent, _)| *recent == vertex) {
            return (entry, false);
        }
        if self.recent.len() == self.entries {
            self.recent.pop_front();
        }
        self.recent.push_back((vertex, None));
        (self.recent.len() - 1, true)
    }

    /// The number under which an entry's vertex is written, allocating one if necessary.
    fn written(&mut self, entry: usize, next: &mut u32) -> u32 {
        *self.recent[entry].1.get_or_insert_with(|| {
            *next += 1;
            *next - 1
        })
    }
}
