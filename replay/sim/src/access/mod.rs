//! The clients of memory other than the texture units: reads and writes of vertex processing, tiles,
//! attachments and composition, in rendering order.
//!
//! [`FrameClients`] follows the engine: a frame starts, cores take work items, the frame ends. Each step
//! produces accesses of whole lines, in order. Each client has its own caches, so that clients do not evict
//! each other's lines there. Misses and write-backs go to the levels shared by all clients, if configured,
//! and to DRAM.

mod attachments;
mod buffers;
mod compression;
mod lists;
mod pixels;
mod tiles;
mod vertices;
mod write_back;

#[cfg(test)]
mod tests;

use crate::config::{FrameConfig, FrameMachine, RunConfig};
use crate::memory::{Access, Client};
use crate::order::{TileRef, WorkItem};
use crate::result::{ClientTraffic, GeometryCounts};
use crate::stream::{Rendered, StreamError, TileSource, rendered};
pub use compression::permille as compressed_permille;

use attachments::Attachments;
use buffers::Buffers;
use formats::textrace::PassKind;
use formats::textrace::geometry::{Geometry, ViewTarget};
use pixels::Pixels;
use tiles::Tiles;
use vertices::{Reuse, ShadedView};

/// Bytes by client, and the accesses since the last transfer to memory.
#[derive(Debug)]
struct Traffic {
    /// Bytes read and written.
    bytes: [[u64; 2]; Client::ALL.len()],
    accesses: Vec<Access>,
    line_bytes: u64,
}

impl Traffic {
    fn read(&mut self, client: Client, address: u64, bytes: u64) {
        self.access(client, false, address, bytes);
    }

    fn write(&mut self, client: Client, address: u64, bytes: u64) {
        self.access(client, true, address, bytes);
    }

    /// Accesses whole lines, starting with the line of the first byte.
    fn access(&mut self, client: Client, write: bool, address: u64, bytes: u64) {
        if bytes == 0 {
            return;
        }
        let first = address / self.line_bytes * self.line_bytes;
        let bytes = (address + bytes - first).next_multiple_of(self.line_bytes);
        self.bytes[client as usize][usize::from(write)] += bytes;
        self.accesses.push(Access {
            client,
            write,
            address: first,
            bytes,
        });
    }
}

/// The clients of one replay.
pub struct FrameClients<'a> {
    source: &'a dyn TileSource,
    geometry: &'a Geometry,
    /// The quads that remain after hidden-surface removal, in tiles of the configured size.
    rendered: Rendered<'a>,
    config: RunConfig,
    machine: FrameConfig,
    buffers: Buffers,
    traffic: Traffic,
    counts: GeometryCounts,
    views: Vec<ShadedView>,
    attachments: Attachments,
    /// Present on a tile-based machine.
    tiles: Option<Tiles>,
    /// Present on an immediate machine.
    pixels: Option<Pixels>,
    /// The unresolved item of each core.
    current: Vec<Option<WorkItem>>,
}

impl<'a> FrameClients<'a> {
    /// The clients of a machine that renders `source`, whose textures lie below `texture_bytes`.
    ///
    /// # Errors
    /// A trace without geometry, or without the fragments that hidden-surface removal needs.
    pub fn new(
        source: &'a dyn TileSource,
        config: &RunConfig,
        machine: FrameConfig,
        texture_bytes: u64,
    ) -> Result<Self, StreamError> {
        let geometry = source.geometry().ok_or_else(missing)?;
        Ok(Self {
            source,
            geometry,
            rendered: rendered(source, config)?,
            config: *config,
            machine,
            buffers: Buffers::new(geometry, texture_bytes, machine.line_bytes.into()),
            traffic: Traffic {
                bytes: Default::default(),
                accesses: Vec::new(),
                line_bytes: machine.line_bytes.into(),
            },
            counts: GeometryCounts::default(),
            views: Vec::new(),
            attachments: Attachments::default(),
            tiles: None,
            pixels: None,
            current: vec![None; config.cores as usize],
        })
    }

    /// Performs vertex processing and binning for the views of a frame, and renders its shadow maps.
    ///
    /// # Errors
    /// Unreadable lists.
    pub fn start_frame(&mut self, frame: u32) -> Result<(), StreamError> {
        self.views.clear();
        self.buffers.start_frame();
        let tables = self.source.tables();
        for (number, view) in self.geometry.views.iter().enumerate() {
            if view.frame != frame {
                continue;
            }
            let recorded = self.source.tile_lists(number)?;
            let lists = lists::regrouped(recorded, view.size_px, self.config.tile_px);
            let pass = match view.target {
                ViewTarget::Pass(pass) => tables.passes.get(pass as usize),
                ViewTarget::ShadowMap(_) => None,
            };
            // With multiview, a later picture or layer with the same number reuses the reads of an earlier one.
            let partner = self.views.iter().position(|other| {
                self.machine.multiview
                    && pass.zip(other.pass(tables)).is_some_and(|(a, b)| {
                        a.eye != b.eye
                            && (a.kind, a.layer) == (b.kind, b.layer)
                            && a.kind != PassKind::Shadow
                    })
            });
            let reuse = match partner {
                Some(partner) => Reuse::Of(&self.views[partner], partner),
                None => Reuse::None,
            };
            let mut vertices = vertices::VertexStage {
                geometry: self.geometry,
                tables,
                machine: &self.machine,
                buffers: &mut self.buffers,
                traffic: &mut self.traffic,
                counts: &mut self.counts,
            };
            let shaded = vertices.shade(*view, lists, &reuse);
            self.views.push(shaded);
        }
        self.attachments =
            Attachments::new(&self.views, &self.machine, &self.config, &mut self.buffers);
        if self.machine.machine == FrameMachine::Immediate {
            self.pixels = Some(Pixels::new(
                tables,
                &self.views,
                &self.config,
                &self.machine,
                &mut self.buffers,
            ));
        } else {
            let mut tiles = Tiles::new(&self.config, &self.machine);
            tiles.shadow_maps(&self.views, &mut self.traffic);
            self.tiles = Some(tiles);
        }
        self.attachments.shadow_maps(&mut self.traffic);
        Ok(())
    }

    /// Ends the core's item and starts another.
    ///
    /// # Errors
    /// An unreadable tile.
    pub fn start_item(&mut self, core: usize, item: &WorkItem) -> Result<(), StreamError> {
        self.resolve(core);
        self.current[core] = Some(*item);
        if let Some(tiles) = &mut self.tiles {
            tiles.item(core, item, &self.rendered, &self.views, &mut self.traffic)?;
        }
        if let Some(pixels) = &mut self.pixels {
            pixels.item(core, item, &self.rendered, &mut self.traffic)?;
        }
        Ok(())
    }

    /// Writes the finished tiles of the core's item.
    fn resolve(&mut self, core: usize) {
        if let Some(item) = self.current[core].take() {
            for TileRef { pass, tile } in item.tiles() {
                self.attachments.resolve(pass, tile, &mut self.traffic);
            }
        }
    }

    /// Ends the frame: writes the last tiles, which lighting and composition then read.
    pub fn end_frame(&mut self) {
        for core in 0..self.current.len() {
            self.resolve(core);
        }
        let passes = &self.source.tables().passes;
        if let Some(pixels) = self.pixels.take() {
            pixels.finish(&mut self.traffic);
        }
        self.attachments.finish(passes, &mut self.traffic);
        self.tiles = None;
    }

    /// Sends the accesses since the last call to `memory`, in order. `memory` returns the bytes that caches
    /// on chip serve, which are not traffic.
    pub fn send(&mut self, mut memory: impl FnMut(&Access) -> u64) {
        for access in self.traffic.accesses.drain(..) {
            let served = memory(&access);
            self.traffic.bytes[access.client as usize][usize::from(access.write)] -= served;
        }
    }

    /// Traffic of each active client, given the texture units' bytes, and the counts of vertex processing.
    pub fn result(&self, texture_bytes: u64) -> (Vec<ClientTraffic>, GeometryCounts) {
        let dram = self.config.dram.unwrap_or_default();
        let pj_per_byte = dram.preset.device().pj_per_byte();
        let mut bytes = self.traffic.bytes;
        bytes[Client::Texture as usize][0] += texture_bytes;
        let clients = Client::ALL.into_iter().zip(bytes);
        let clients = clients.map(|(client, [read_bytes, write_bytes])| ClientTraffic {
            client,
            read_bytes,
            write_bytes,
            energy_mj: (read_bytes + write_bytes) as f64 * pj_per_byte * 1e-9,
        });
        (
            clients.filter(|client| client.bytes() > 0).collect(),
            self.counts,
        )
    }
}

/// The error for a trace without the requested geometry.
pub fn missing() -> StreamError {
    StreamError::Tables(
        "expected geometry for the traffic of a whole frame (`tracegen raster --geometry`), found none".to_owned(),
    )
}
