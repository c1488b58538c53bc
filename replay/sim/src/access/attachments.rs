//! Tile writes to attachments, the G-buffer in memory, and composition.

use super::Traffic;
use super::buffers::Buffers;
use super::vertices::ShadedView;
use crate::config::{FrameConfig, FrameMachine, RunConfig};
use crate::memory::Client;
use formats::textrace::geometry::ViewTarget;
use formats::textrace::{Pass, PassKind};

/// The attachments of a frame's views. Tiles are cleared on chip, so nothing is loaded. An immediate
/// machine writes its pictures pixel by pixel instead.
#[derive(Default)]
pub(super) struct Attachments {
    machine: FrameConfig,
    tile_px: u32,
    views: Vec<AttachmentView>,
    /// The display's pictures, per composed view.
    displays: Vec<u64>,
}

/// A view's buffers.
struct AttachmentView {
    /// None for a shadow map.
    pass: Option<u32>,
    size_px: [u32; 2],
    columns: u32,
    colour: u64,
    depth: u64,
    g_buffer: u64,
    /// Tiles already written, by number.
    is_resolved: Vec<bool>,
}

impl Attachments {
    pub fn new(
        views: &[ShadedView],
        machine: &FrameConfig,
        config: &RunConfig,
        buffers: &mut Buffers,
    ) -> Self {
        let mut view = |of: &ShadedView| {
            let tiles = of.view.size_px.map(|size| size.div_ceil(config.tile_px));
            let count = u64::from(tiles[0]) * u64::from(tiles[1]);
            let tile_bytes = |pixel: u32| u64::from(config.tile_px).pow(2) * u64::from(pixel);
            let mut place = |pixel: u32| buffers.place(count * tile_bytes(pixel));
            AttachmentView {
                pass: match of.view.target {
                    ViewTarget::Pass(pass) => Some(pass),
                    ViewTarget::ShadowMap(_) => None,
                },
                size_px: of.view.size_px,
                columns: tiles[0],
                colour: place(machine.color_bytes),
                depth: place(machine.depth_bytes),
                g_buffer: place(machine.g_buffer_bytes),
                is_resolved: vec![false; count as usize],
            }
        };
        let views: Vec<AttachmentView> = views.iter().map(&mut view).collect();
        let displays = views.iter().map(|view| {
            let pixels = view.size_px.map(u64::from);
            buffers.place(pixels[0] * pixels[1] * u64::from(machine.color_bytes))
        });
        Self {
            machine: *machine,
            tile_px: config.tile_px,
            displays: displays.collect(),
            views,
        }
    }

    /// First byte and number of bytes inside the picture of a tile of an attachment. The tiles of an
    /// attachment are stored consecutively.
    fn tile(&self, view: &AttachmentView, base: u64, pixel_bytes: u32, tile: u32) -> [u64; 2] {
        let at = [tile % view.columns, tile / view.columns];
        let side = |axis: usize| (view.size_px[axis] - at[axis] * self.tile_px).min(self.tile_px);
        let whole = u64::from(self.tile_px).pow(2) * u64::from(pixel_bytes);
        let bytes = u64::from(side(0)) * u64::from(side(1)) * u64::from(pixel_bytes);
        [base + u64::from(tile) * whole, bytes]
    }

    /// A tile of a picture in memory.
    fn picture_tile(&self, view: &AttachmentView, tile: u32) -> [u64; 2] {
        let [first, bytes] = self.tile(view, view.colour, self.machine.color_bytes, tile);
        let permille = u64::from(self.machine.color_compressed_permille);
        [first, (bytes * permille).div_ceil(1000)]
    }

    /// Writes the depth of the shadow maps.
    pub fn shadow_maps(&self, traffic: &mut Traffic) {
        for view in self.views.iter().filter(|view| view.pass.is_none()) {
            for tile in 0..view.is_resolved.len() as u32 {
                let [first, bytes] = self.tile(view, view.depth, self.machine.depth_bytes, tile);
                traffic.write(Client::Depth, first, bytes);
            }
        }
    }

    /// Writes a finished tile.
    pub fn resolve(&mut self, pass: u32, tile: u32, traffic: &mut Traffic) {
        let Some(index) = self.views.iter().position(|view| view.pass == Some(pass)) else {
            return;
        };
        let is_resolved = self.views[index].is_resolved.get_mut(tile as usize);
        if is_resolved.is_none_or(|is_resolved| std::mem::replace(is_resolved, true)) {
            return;
        }
        let (view, machine) = (&self.views[index], &self.machine);
        if machine.machine != FrameMachine::Immediate {
            let [first, bytes] = self.picture_tile(view, tile);
            traffic.write(Client::Colour, first, bytes);
        }
        let mut write = |client, base, pixel_bytes| {
            let [first, bytes] = self.tile(view, base, pixel_bytes, tile);
            traffic.write(client, first, bytes);
        };
        if machine.machine != FrameMachine::Immediate && machine.store_depth {
            write(Client::Depth, view.depth, machine.depth_bytes);
        }
        if machine.machine == FrameMachine::TileBasedGBuffer {
            write(Client::GBuffer, view.g_buffer, machine.g_buffer_bytes);
            if !machine.store_depth {
                write(Client::Depth, view.depth, machine.depth_bytes);
            }
        }
    }

    /// Writes the tiles that no core rendered, reads the G-buffer for lighting, and composes the shown pictures.
    pub fn finish(&mut self, passes: &[Pass], traffic: &mut Traffic) {
        for index in 0..self.views.len() {
            if let Some(pass) = self.views[index].pass {
                for tile in 0..self.views[index].is_resolved.len() as u32 {
                    self.resolve(pass, tile, traffic);
                }
            }
        }
        let machine = &self.machine;
        if machine.machine == FrameMachine::TileBasedGBuffer {
            for view in self.views.iter().filter(|view| view.pass.is_some()) {
                for tile in 0..view.is_resolved.len() as u32 {
                    let mut read = |client, base, pixel_bytes| {
                        let [first, bytes] = self.tile(view, base, pixel_bytes, tile);
                        traffic.read(client, first, bytes);
                    };
                    read(Client::GBuffer, view.g_buffer, machine.g_buffer_bytes);
                    // Lighting also reads depth.
                    read(Client::Depth, view.depth, machine.depth_bytes);
                }
            }
        }
        if machine.composition {
            self.compose(passes, traffic);
        }
    }

    /// Composition reads layers and writes pictures; the warp then reads pictures and writes the display's.
    fn compose(&self, passes: &[Pass], traffic: &mut Traffic) {
        let is_layer = |view: &AttachmentView| {
            let pass = view.pass.and_then(|pass| passes.get(pass as usize));
            pass.is_some_and(|pass| pass.kind == PassKind::Layer)
        };
        let shown =
            || (self.views.iter().zip(&self.displays)).filter(|(view, _)| view.pass.is_some());
        let has_layers = shown().any(|(view, _)| is_layer(view));
        let has_pictures = shown().any(|(view, _)| !is_layer(view));
        for (view, &display) in shown() {
            let tiles = 0..view.is_resolved.len() as u32;
            let mut picture = |write: bool| {
                for tile in tiles.clone() {
                    let [first, bytes] = self.picture_tile(view, tile);
                    traffic.access(Client::Composition, write, first, bytes);
                }
            };
            let is_layer = is_layer(view);
            if is_layer {
                picture(false);
            }
            // If only layers were rendered, each is as large as its picture.
            let is_picture = !is_layer || !has_pictures;
            if is_picture && has_layers {
                picture(true);
            }
            if is_picture {
                picture(false);
                for tile in tiles {
                    let colour = self.machine.color_bytes;
                    let [first, bytes] = self.tile(view, display, colour, tile);
                    traffic.write(Client::Composition, first, bytes);
                }
            }
        }
    }
}
