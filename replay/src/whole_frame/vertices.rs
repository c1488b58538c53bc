//! Vertex processing of a view: index and vertex fetch, reuse of shaded vertices, and what is written for the tiles.

use super::{Traffic, lines};
use crate::access::{Client, FrameConfig, FrameMachine, GeometryCounts};
use crate::memory::{Lru, WaysOf};
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
    /// Primitives that enter any tile, ascending.
    pub kept: Vec<u32>,
    /// Shaded vertices of each of them.
    pub vertices: Vec<[u32; 3]>,
    /// View whose varyings are this one's (multiview), by its place in the frame.
    pub varyings_of: Option<usize>,
}

/// What a view takes over from another.
pub(super) enum Reuse<'a> {
    None,
    /// Reads and varyings of the view at a place in the frame: both are shaded at once.
    Of(&'a ShadedView, usize),
}

impl ShadedView {
    /// Shades the draws of a view, in order.
    #[allow(
        clippy::too_many_arguments,
        reason = "what a view is made of, and the two sums that it adds to"
    )]
    pub fn new(
        geometry: &Geometry,
        tables: &Tables,
        view: GeometryView,
        lists: TileLists,
        machine: &FrameConfig,
        reuse: &Reuse<'_>,
        traffic: &mut Traffic,
        counts: &mut GeometryCounts,
    ) -> Self {
        let mut kept = lists.primitives.clone();
        kept.sort_unstable();
        kept.dedup();
        let line_bytes = u64::from(machine.line_bytes);
        let sets = (machine.vertex_cache_bytes / line_bytes / 4) as u32;
        let mut fetch = Lru::<WaysOf<4>, u64>::new(sets, WaysOf);
        let mut shader = Shader::new(machine.post_transform_entries as usize);
        let bases = bases(geometry, line_bytes);
        let mut vertices = Vec::with_capacity(kept.len());
        let (mut written, mut next) = (0_u32, 0);
        for &draw in &lists.draws {
            let mesh = geometry.draw_meshes[draw as usize] as usize;
            let (of, first) = (
                &geometry.meshes[mesh],
                tables.draws[draw as usize].first_primitive,
            );
            counts.triangles_submitted += of.indices.len() as u64 / 3;
            let shared = matches!(reuse, Reuse::Of(other, _) if other.lists.draws.binary_search(&draw).is_ok());
            if !shared {
                let bytes = of.indices.len() as u64 * u64::from(of.index_bytes);
                traffic.read(Client::Index, lines(bytes, machine));
            }
            shader.start_draw();
            for (primitive, triangle) in (first..).zip(of.indices.chunks_exact(3)) {
                let is_kept = kept.get(next) == Some(&primitive);
                let mut slots = [0; 3];
                for (slot, &vertex) in slots.iter_mut().zip(triangle) {
                    let (entry, is_new) = shader.shade(vertex);
                    if is_new && !shared {
                        counts.vertices_shaded += 1;
                        let at = bases[mesh] + u64::from(vertex) * u64::from(of.vertex_bytes);
                        let last = at + u64::from(of.vertex_bytes) - 1;
                        for line in at / line_bytes..=last / line_bytes {
                            if !fetch.access(line) {
                                traffic.read(Client::Vertex, line_bytes);
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
        counts.triangles_binned += kept.len() as u64;
        counts.list_entries += lists.primitives.len() as u64;
        let varyings_of = match reuse {
            Reuse::Of(_, place) => Some(*place),
            Reuse::None => None,
        };
        if machine.machine != FrameMachine::Immediate {
            traffic.write(
                Client::ShadedVertex,
                lines(u64::from(written) * POSITION_BYTES, machine),
            );
            let varyings = u64::from(written) * u64::from(machine.varying_bytes);
            // A shadow map has depth alone.
            let is_picture = matches!(view.target, ViewTarget::Pass(_));
            if is_picture && varyings_of.is_none() {
                traffic.write(Client::ShadedVertex, lines(varyings, machine));
            }
            for tile in 0..view.tile_count() {
                let bytes = lists.tile(tile).len() as u64 * u64::from(machine.list_entry_bytes);
                traffic.write(Client::PrimitiveList, lines(bytes, machine));
            }
        }
        Self {
            view,
            lists,
            kept,
            vertices,
            varyings_of,
        }
    }

    /// The pass that the view renders; a shadow map has none.
    pub fn pass<'t>(&self, tables: &'t Tables) -> Option<&'t Pass> {
        match self.view.target {
            ViewTarget::Pass(pass) => tables.passes.get(pass as usize),
            ViewTarget::ShadowMap(_) => None,
        }
    }

    /// Shaded vertices of a primitive of the lists.
    pub fn vertices_of(&self, primitive: u32) -> Option<[u32; 3]> {
        let place = self.kept.binary_search(&primitive).ok()?;
        self.vertices.get(place).copied()
    }
}

/// First byte of each mesh's vertices, line by line.
fn bases(geometry: &Geometry, line_bytes: u64) -> Vec<u64> {
    let mut next = 0;
    let base = |mesh: &formats::textrace::geometry::MeshGeometry| {
        let base = next;
        next +=
            (u64::from(mesh.vertices) * u64::from(mesh.vertex_bytes)).next_multiple_of(line_bytes);
        base
    };
    geometry.meshes.iter().map(base).collect()
}

/// Shaded vertices that are still there, first in, first out (Hoppe 1999).
struct Shader {
    /// Vertex, and its place once it has been written.
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

    /// Another draw has other vertices.
    fn start_draw(&mut self) {
        self.recent.clear();
    }

    /// Its place in the queue, and whether the vertex had to be shaded.
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

    /// Number under which the vertex of an entry is written; a new one if it has none yet.
    fn written(&mut self, entry: usize, next: &mut u32) -> u32 {
        *self.recent[entry].1.get_or_insert_with(|| {
            *next += 1;
            *next - 1
        })
    }
}
