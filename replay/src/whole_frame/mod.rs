//! All memory traffic of a frame: what vertex processing, tiles, attachments and composition read and write beside the
//! texture units, whose traffic the engine counts.
//!
//! Each client has caches of its own, so that no client evicts another's lines. Traffic is counted in whole lines.

mod attachments;
mod pixels;
mod tiles;
mod vertices;
mod write_back;

#[cfg(test)]
mod tests;

use crate::config::RunConfig;
use crate::memory::clients::{Client, ClientTraffic, FrameConfig, FrameMachine, GeometryCounts};
use crate::order::{self, Known};
use crate::stream::{StreamError, TileSource, shaded};
use formats::textrace::PassKind;
use formats::textrace::geometry::{Geometry, ViewTarget};
use vertices::{Reuse, ShadedView};

/// Traffic by client, and what vertex processing did.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WholeFrame {
    /// Traffic of each client that has any.
    pub clients: Vec<ClientTraffic>,
    /// Counts of vertex processing.
    pub geometry: GeometryCounts,
}

/// Bytes by client while they are counted.
#[derive(Debug, Default)]
struct Traffic([[u64; 2]; Client::ALL.len()]);

impl Traffic {
    fn read(&mut self, client: Client, bytes: u64) {
        self.0[client as usize][0] += bytes;
    }

    fn write(&mut self, client: Client, bytes: u64) {
        self.0[client as usize][1] += bytes;
    }
}

/// Counts the traffic of all frames of a trace with geometry; `texture_bytes` is what the texture units read.
///
/// # Errors
/// Lists or tiles that cannot be read.
pub fn traffic(
    source: &dyn TileSource,
    config: &RunConfig,
    machine: &FrameConfig,
    texture_bytes: u64,
) -> Result<WholeFrame, StreamError> {
    let mut traffic = Traffic::default();
    let mut counts = GeometryCounts::default();
    traffic.read(Client::Texture, texture_bytes);
    let Some(geometry) = source.geometry() else {
        return Err(missing());
    };
    let passes = &source.tables().passes;
    let mut frames: Vec<u32> = geometry.views.iter().map(|view| view.frame).collect();
    frames.dedup();
    for frame in frames {
        let views = shade(source, geometry, machine, frame, &mut traffic, &mut counts)?;
        let known = Known::new(config, &source.tables().meta);
        let phases = order::plan_frame(config.order, &known, passes, frame);
        let shaded = shaded(source, config.hsr)?;
        if machine.machine == FrameMachine::Immediate {
            pixels::render(&shaded, config, machine, frame, &phases, &mut traffic)?;
        } else {
            tiles::render(&shaded, &views, config, machine, &phases, &mut traffic)?;
        }
        attachments::count(&views, passes, machine, &mut traffic);
    }
    let dram = config.dram.unwrap_or_default();
    let pj_per_byte = dram.preset.device().pj_per_byte();
    let clients = Client::ALL.into_iter().zip(traffic.0);
    Ok(WholeFrame {
        clients: clients
            .map(|(client, [read_bytes, write_bytes])| ClientTraffic {
                client,
                read_bytes,
                write_bytes,
                energy_mj: (read_bytes + write_bytes) as f64 * pj_per_byte * 1e-9,
            })
            .filter(|client| client.bytes() > 0)
            .collect(),
        geometry: counts,
    })
}

/// A trace whose geometry is asked for and absent.
#[must_use]
pub fn missing() -> StreamError {
    StreamError::Tables(
        "expected geometry for the traffic of a whole frame (`tracegen raster --geometry`), found none".to_owned(),
    )
}

/// Runs vertex processing and binning for the views of a frame.
fn shade(
    source: &dyn TileSource,
    geometry: &Geometry,
    machine: &FrameConfig,
    frame: u32,
    traffic: &mut Traffic,
    counts: &mut GeometryCounts,
) -> Result<Vec<ShadedView>, StreamError> {
    let tables = source.tables();
    let mut shaded: Vec<ShadedView> = Vec::new();
    for (number, view) in geometry.views.iter().enumerate() {
        if view.frame != frame {
            continue;
        }
        let lists = source.tile_lists(number)?;
        let pass = match view.target {
            ViewTarget::Pass(pass) => tables.passes.get(pass as usize),
            ViewTarget::ShadowMap(_) => None,
        };
        // With multiview, a later picture or layer of the same number takes over what an earlier one read.
        let partner = shaded.iter().position(|other| {
            machine.multiview
                && pass.zip(other.pass(tables)).is_some_and(|(a, b)| {
                    a.eye != b.eye
                        && (a.kind, a.layer) == (b.kind, b.layer)
                        && a.kind != PassKind::Shadow
                })
        });
        let reuse = match partner {
            Some(partner) => Reuse::Of(&shaded[partner], partner),
            None => Reuse::None,
        };
        let view = ShadedView::new(
            geometry, tables, *view, lists, machine, &reuse, traffic, counts,
        );
        shaded.push(view);
    }
    Ok(shaded)
}

/// Whole lines.
fn lines(bytes: u64, machine: &FrameConfig) -> u64 {
    bytes.next_multiple_of(machine.line_bytes.into())
}
