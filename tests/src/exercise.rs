//! Runs everything that the commands do with a trace.

use crate::repair::validate;
use formats::Trace;
use formats::footprint::SamplingOptions;
use formats::interop::{Expander, Granularity, Origin, ray_samples};
use formats::layout::{Layout, LayoutConfig};
use formats::raytrace::{RayTile, Raytrace, check_relations};
use formats::textrace::{Textrace, Tile, with_operands};
use formats::view::Eye;
use replay::config::{FrameConfig, FrameMachine};
use replay::config::{Hsr, Levels, Mode, PrefetchConfig, RunConfig, TmuConfig, TmuModel};
use replay::memory::dram::DramConfig;
use replay::sgrt::compose::Reuse;
use replay::sgrt::config::SgrtConfig;
use replay::sgrt::loaded::LoadedTrace;

/// Reads a file and processes it as the commands do; returns whether it is valid.
///
/// # Panics
/// A valid trace does not behave as one.
pub fn exercise(bytes: Vec<u8>) -> bool {
    let Ok(trace) = Trace::from_bytes(bytes) else {
        return false;
    };
    if validate(&trace).is_err() {
        return false;
    }
    match trace {
        Trace::Texture(trace) => {
            expand(&trace);
            let machines = [
                (Mode::Functional, TmuModel::Looping, Hsr::EarlyZ),
                (Mode::Timed, TmuModel::Looping, Hsr::Deferred),
                (Mode::Timed, TmuModel::FirstMiss, Hsr::None),
            ];
            let frames = [
                FrameMachine::TileBased,
                FrameMachine::TileBasedGBuffer,
                FrameMachine::Immediate,
            ];
            for ((mode, model, hsr), machine) in machines.into_iter().zip(frames) {
                let machine = FrameConfig {
                    machine,
                    multiview: mode == Mode::Functional,
                    ..FrameConfig::default()
                };
                let config = RunConfig {
                    mode,
                    hsr,
                    frame: trace.geometry().map(|_| machine),
                    prefetch: (mode != Mode::Functional).then(PrefetchConfig::default),
                    level: Levels::default()
                        .over(&[Levels::usual(2, 64 << 10)])
                        .unwrap_or_default(),
                    dram: (model == TmuModel::Looping).then(DramConfig::default),
                    tmu: TmuConfig {
                        model,
                        ..TmuConfig::default()
                    },
                    ..RunConfig::default()
                };
                // Textures may be too large for a layout, which must be an error without a panic.
                let _result = replay::engine::replay(&*trace, &config);
            }
        }
        Trace::Ray(trace) => reproject(&trace),
    }
    true
}

/// Every access of a texture trace, as `replay convert` writes them.
fn expand(trace: &Textrace) {
    let tables = trace.tables();
    let Ok(layout) = Layout::new(&tables.textures, &LayoutConfig::default()) else {
        return;
    };
    let expander = Expander {
        tables,
        layout: &layout,
        sampling: SamplingOptions::default(),
        granularity: Granularity::Line,
        line_bytes: 64,
    };
    let mut tile = Tile::default();
    for (pass, info) in tables.passes.iter().enumerate() {
        for index in 0..info.tile_count() {
            trace
                .decode_tile(pass, index as usize, &mut tile)
                .expect("it was decoded before");
            for run in &tile.runs {
                let origin = Origin {
                    draw: run.draw,
                    ..Origin::default()
                };
                let records = run.first as usize..(run.first + run.count) as usize;
                for (record, operands) in with_operands(&tile.records[records]) {
                    expander
                        .expand(origin, record, operands, |_| Ok(()))
                        .expect("nothing fails here");
                }
            }
        }
    }
}

fn reproject(trace: &Raytrace) {
    let tables = trace.tables();
    let mut tile = RayTile::default();
    trace
        .decode_tile_with_geometry(Eye::Right, 0, &mut tile)
        .expect("it was decoded before");
    let hierarchy = trace.read_hierarchy().expect("it was read before");
    // Columns of different traces need not belong together, but checking them must not panic.
    let _result = check_relations(&tile, hierarchy.as_ref());
    for sample in ray_samples(tables, Eye::Right, 0, &tile) {
        sample.to_json(&tables.bvh).expect("JSON");
        sample
            .accesses(&tables.bvh, |access| {
                access.lines(64).for_each(drop);
                Ok(())
            })
            .expect("nothing fails here");
    }
    let Ok(loaded) = LoadedTrace::load(trace) else {
        return;
    };
    for rule in ["none", replay::sgrt::DEFAULT_RULE] {
        let rule = rule.parse().expect("a known rule");
        // A trace that the model cannot score must be an error without a panic.
        let _result = loaded.run(&rule, Reuse::Color, &SgrtConfig::default());
    }
}
