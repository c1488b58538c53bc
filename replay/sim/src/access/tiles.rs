//! Tiles of a tile-based machine: reads of their primitive lists, of the positions of their primitives, and
//! of the varyings of visible primitives.

use super::Traffic;
use super::vertices::{POSITION_BYTES, ShadedView};
use crate::config::{FrameConfig, RunConfig};
use crate::memory::{Client, Lru, WaysOf};
use crate::order::{Interleave, TileRef, WorkItem};
use crate::stream::{ListEntry, ListedRun, StreamError, TileSource, interleaved};
use formats::textrace::Tile;
use formats::textrace::geometry::ViewTarget;

/// The cores' caches for shaded vertices.
pub(super) struct Tiles {
    machine: FrameConfig,
    caches: Vec<Lru<WaysOf<4>, u64>>,
    decoded: Tile,
}

impl Tiles {
    /// Empty caches.
    pub fn new(config: &RunConfig, machine: &FrameConfig) -> Self {
        let sets = (machine.shaded_vertex_cache_bytes / u64::from(machine.line_bytes) / 4) as u32;
        let caches = (0..config.cores).map(|_| Lru::new(sets, WaysOf));
        Self {
            machine: *machine,
            caches: caches.collect(),
            decoded: Tile::default(),
        }
    }

    /// Renders the shadow maps row by row, with tiles assigned round robin.
    pub fn shadow_maps(&mut self, views: &[ShadedView], traffic: &mut Traffic) {
        let shadow_maps = (0..)
            .zip(views)
            .filter(|(_, view)| matches!(view.view.target, ViewTarget::ShadowMap(_)));
        for (view, of) in shadow_maps {
            for tile in 0..of.tile_count() {
                let list = List::of_positions(view, of, tile);
                let core = tile % self.caches.len();
                self.render(core, [&list, &List::default()], None, views, traffic);
            }
        }
    }

    /// Renders an item of one or two tiles on a core. `shaded` has the quads that remain after hidden-surface removal.
    pub fn item(
        &mut self,
        core: usize,
        item: &WorkItem,
        shaded: &dyn TileSource,
        views: &[ShadedView],
        traffic: &mut Traffic,
    ) -> Result<(), StreamError> {
        let mut lists = [List::default(), List::default()];
        for (list, at) in lists.iter_mut().zip(item.tiles()) {
            shaded.read_tile(at.pass, at.tile, &mut self.decoded)?;
            *list = List::of_tile(views, at, &self.decoded);
        }
        let interleave = match item {
            WorkItem::Tile(_) => None,
            WorkItem::Pair(_, _, interleave) => Some(*interleave),
        };
        self.render(core, lists.each_ref(), interleave, views, traffic);
        Ok(())
    }

    /// A core's work item of one or two tiles.
    fn render(
        &mut self,
        core: usize,
        lists: [&List; 2],
        interleave: Option<Interleave>,
        views: &[ShadedView],
        traffic: &mut Traffic,
    ) {
        // Lists belong to whole tiles, so each half of an item reads them again.
        let times = 1 + usize::from(interleave == Some(Interleave::Halves));
        for list in lists.into_iter().cycle().take(times * lists.len()) {
            let bytes = list.primitives.len() as u64 * u64::from(self.machine.list_entry_bytes);
            traffic.read(Client::PrimitiveList, list.address, bytes);
        }
        let Some(interleave) = interleave else {
            for list in lists {
                for &entry in &list.primitives {
                    self.primitive(core, list.view, entry, views, traffic);
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
        for ListedRun { tile, run, .. } in order {
            let list = lists[usize::from(tile)];
            let entry = list.primitives[run as usize];
            self.primitive(core, list.view, entry, views, traffic);
        }
    }

    /// Reads the shaded vertices of a primitive.
    fn primitive(
        &mut self,
        core: usize,
        view: usize,
        (primitive, has_fragments): (u32, bool),
        views: &[ShadedView],
        traffic: &mut Traffic,
    ) {
        let of = &views[view];
        let Some(vertices) = of.vertices_of(primitive) else {
            return;
        };
        let varying_bytes = u64::from(self.machine.varying_bytes);
        let line_bytes = u64::from(self.machine.line_bytes);
        let mut read = |first: u64, bytes: u64| {
            for line in first / line_bytes..=(first + bytes - 1) / line_bytes {
                if !self.caches[core].access(line) {
                    traffic.read(Client::ShadedVertex, line * line_bytes, line_bytes);
                }
            }
        };
        for vertex in vertices.map(u64::from) {
            read(of.positions + vertex * POSITION_BYTES, POSITION_BYTES);
            if has_fragments && varying_bytes > 0 {
                let varyings = views[of.varyings_of.unwrap_or(view)].varyings;
                read(varyings + vertex * varying_bytes, varying_bytes);
            }
        }
    }
}

/// The primitives of a tile, and whether each has fragments.
#[derive(Default)]
struct List {
    view: usize,
    primitives: Vec<(u32, bool)>,
    /// First byte of the list.
    address: u64,
}

impl List {
    /// The list of a shadow map's tile, which needs no varyings.
    fn of_positions(view: usize, of: &ShadedView, tile: usize) -> Self {
        let list = of.lists.tile(tile).iter();
        Self {
            view,
            address: of.list_address(tile),
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
            address: views[view].list_address(at.tile as usize),
            primitives: list.map(|p| (*p, has_fragments(p))).collect(),
        }
    }
}
