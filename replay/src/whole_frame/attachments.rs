//! What tiles write when they are done, the G-buffer in memory, and composition.

use super::vertices::ShadedView;
use super::{Traffic, lines};
use crate::access::{Client, FrameConfig, FrameMachine};
use formats::textrace::geometry::ViewTarget;
use formats::textrace::{Pass, PassKind};
use formats::view::TILE_SIZE_PX;

/// Counts the attachments of a frame's views. Tiles are cleared on chip, so nothing is loaded; an immediate machine
/// has counted its pictures pixel by pixel.
pub(super) fn count(
    views: &[ShadedView],
    passes: &[Pass],
    machine: &FrameConfig,
    traffic: &mut Traffic,
) {
    let immediate = machine.machine == FrameMachine::Immediate;
    let mut composed = [0; 2];
    for view in views {
        let of = |bytes| attachment_bytes(view.view.size_px, bytes, machine);
        let ViewTarget::Pass(pass) = view.view.target else {
            // Depth alone.
            traffic.write(Client::Depth, of(machine.depth_bytes));
            continue;
        };
        if !immediate {
            traffic.write(Client::Colour, of(machine.color_bytes));
            if machine.store_depth {
                traffic.write(Client::Depth, of(machine.depth_bytes));
            }
        }
        if machine.machine == FrameMachine::TileBasedGBuffer {
            traffic.write(Client::GBuffer, of(machine.g_buffer_bytes));
            traffic.read(Client::GBuffer, of(machine.g_buffer_bytes));
            // Lighting needs depth again.
            traffic.read(Client::Depth, of(machine.depth_bytes));
            if !machine.store_depth {
                traffic.write(Client::Depth, of(machine.depth_bytes));
            }
        }
        let is_layer = passes
            .get(pass as usize)
            .is_some_and(|pass| pass.kind == PassKind::Layer);
        composed[usize::from(is_layer)] += of(machine.color_bytes);
    }
    if machine.composition {
        let [pictures, layers] = composed;
        // Layers are read and pictures made of them; then the warp reads pictures and writes the display's.
        let pictures = if layers > 0 && pictures == 0 {
            layers
        } else {
            pictures
        };
        traffic.read(Client::Composition, layers + pictures);
        traffic.write(
            Client::Composition,
            pictures + if layers > 0 { pictures } else { 0 },
        );
    }
}

/// Bytes of an attachment whose tiles lie one behind the other, each in whole lines; the last ones are cut by the picture.
fn attachment_bytes(size_px: [u32; 2], pixel_bytes: u32, machine: &FrameConfig) -> u64 {
    let parts = |size: u32| {
        [
            (size / TILE_SIZE_PX, TILE_SIZE_PX),
            (
                u32::from(!size.is_multiple_of(TILE_SIZE_PX)),
                size % TILE_SIZE_PX,
            ),
        ]
    };
    let mut bytes = 0;
    for (columns, width) in parts(size_px[0]) {
        for (rows, height) in parts(size_px[1]) {
            let tile = u64::from(width) * u64::from(height) * u64::from(pixel_bytes);
            bytes += u64::from(columns) * u64::from(rows) * lines(tile, machine);
        }
    }
    bytes
}
