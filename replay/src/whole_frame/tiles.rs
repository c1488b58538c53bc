//! The tiles of a tile-based machine: they read their primitive list, the positions of its primitives, and the varyings
//! of those that have fragments left.

use super::vertices::{POSITION_BYTES, ShadedView};
use super::{Traffic, lines};
use crate::cache::{Lru, WaysOf};
use crate::config::RunConfig;
use crate::memory::clients::{Client, FrameConfig};
use crate::order::{Interleave, Phase, TileRef, WorkItem};
use crate::stream::{ListEntry, Listed, StreamError, TileSource, interleaved};
use formats::textrace::Tile;
use formats::textrace::geometry::ViewTarget;

/// Renders the shadow maps row by row, then the phases of the order; work items go to the cores in turn. `shaded` has the
/// quads that hidden-surface removal leaves.
pub(super) fn render(
    shaded: &dyn TileSource,
    views: &[ShadedView],
    config: &RunConfig,
    machine: &FrameConfig,
    phases: &[Phase],
    traffic: &mut Traffic,
) -> Result<(), StreamError> {
    let sets = (machine.shaded_vertex_cache_bytes / u64::from(machine.line_bytes) / 4) as u32;
    let cores = config.cores as usize;
    let caches = (0..cores).map(|_| Lru::<WaysOf<4>, u64>::new(sets, WaysOf));
    let mut tiles = Tiles {
        views,
        machine,
        caches: caches.collect(),
        traffic,
    };
    let shadow_maps = (0..)
        .zip(views)
        .filter(|(_, view)| matches!(view.view.target, ViewTarget::ShadowMap(_)));
    for (view, of) in shadow_maps {
        for tile in 0..of.view.tile_count() {
            let list = List::of_positions(view, of, tile);
            tiles.render(tile % cores, [&list, &List::default()], None);
        }
    }
    let mut decoded = Tile::default();
    for (number, item) in phases.iter().flatten().enumerate() {
        let mut lists = [List::default(), List::default()];
        for (list, at) in lists.iter_mut().zip(item.tiles()) {
            shaded.read_tile(at.pass, at.tile, &mut decoded)?;
            *list = List::of_tile(views, at, &decoded);
        }
        let interleave = match item {
            WorkItem::Tile(_) => None,
            WorkItem::Pair(_, _, interleave) => Some(*interleave),
        };
        tiles.render(number % cores, lists.each_ref(), interleave);
    }
    Ok(())
}

/// The primitives of a tile, and which of them have fragments.
#[derive(Default)]
struct List {
    view: usize,
    primitives: Vec<(u32, bool)>,
}

impl List {
    /// Of a shadow map, which needs no varyings.
    fn of_positions(view: usize, of: &ShadedView, tile: usize) -> Self {
        let list = of.lists.tile(tile).iter();
        Self {
            view,
            primitives: list.map(|&primitive| (primitive, false)).collect(),
        }
    }

    fn of_tile(views: &[ShadedView], at: TileRef, decoded: &Tile) -> Self {
        let target = ViewTarget::Pass(at.pass);
        let Some(view) = views.iter().position(|view| view.view.target == target) else {
            return Self::default();
        };
        let has_fragments = |primitive: &u32| {
            let runs = &decoded.runs;
            runs.binary_search_by_key(primitive, |run| run.primitive)
                .is_ok()
        };
        let list = views[view].lists.tile(at.tile as usize).iter();
        Self {
            view,
            primitives: list.map(|p| (*p, has_fragments(p))).collect(),
        }
    }
}

struct Tiles<'a> {
    views: &'a [ShadedView],
    machine: &'a FrameConfig,
    caches: Vec<Lru<WaysOf<4>, u64>>,
    traffic: &'a mut Traffic,
}

impl Tiles<'_> {
    /// A core's work item of one tile or two.
    fn render(&mut self, core: usize, lists: [&List; 2], interleave: Option<Interleave>) {
        // Lists are those of whole tiles: they are read for each half.
        let times = 1 + u64::from(interleave == Some(Interleave::Halves));
        for list in lists {
            let bytes = list.primitives.len() as u64 * u64::from(self.machine.list_entry_bytes);
            let bytes = times * lines(bytes, self.machine);
            self.traffic.read(Client::PrimitiveList, bytes);
        }
        let Some(interleave) = interleave else {
            for list in lists {
                for &entry in &list.primitives {
                    self.primitive(core, list.view, entry);
                }
            }
            return;
        };
        let mut order = Vec::new();
        let [mut left, mut right] = lists.map(|list| {
            let primitives = list.primitives.iter();
            primitives.map(|&(primitive, _)| ListEntry {
                primitive,
                in_half: [true; 2],
            })
        });
        interleaved(interleave, [&mut left, &mut right], &mut order);
        for Listed { tile, run, .. } in order {
            let list = lists[usize::from(tile)];
            self.primitive(core, list.view, list.primitives[run as usize]);
        }
    }

    /// Reads the shaded vertices of a primitive.
    fn primitive(&mut self, core: usize, view: usize, (primitive, has_fragments): (u32, bool)) {
        let of = &self.views[view];
        let Some(vertices) = of.vertices_of(primitive) else {
            return;
        };
        let varying_bytes = u64::from(self.machine.varying_bytes);
        for vertex in vertices.map(u64::from) {
            let positions = stream(view, 0);
            self.range(core, positions, vertex * POSITION_BYTES, POSITION_BYTES);
            if has_fragments && varying_bytes > 0 {
                let varyings = stream(of.varyings_of.unwrap_or(view), 1);
                self.range(core, varyings, vertex * varying_bytes, varying_bytes);
            }
        }
    }

    fn range(&mut self, core: usize, base: u64, offset: u64, bytes: u64) {
        let line_bytes = u64::from(self.machine.line_bytes);
        for line in offset / line_bytes..=(offset + bytes - 1) / line_bytes {
            if !self.caches[core].access(base + line) {
                self.traffic.read(Client::ShadedVertex, line_bytes);
            }
        }
    }
}

/// First line of the positions (0) or varyings (1) of a view: apart from all others, and in other sets.
const fn stream(view: usize, kind: u64) -> u64 {
    let number = 2 * view as u64 + kind;
    (number << 40) + number * 37
}
