//! `cores ORDER cores=N items=...`: which core runs which quad when, in functional mode. An item is the
//! footprints of its quads, as `4.1.2`.

use super::{Settings, one_picture};
use formats::textrace::{PrimitiveRun, QuadRecord, Tile};
use formats::texture::{MipFilter, Sampler};
use replay::config::{Mode, RunConfig};
use replay::order::{Order, PlanInputs, plan_frame};
use replay::stream::{
    Consumer, Cores, Expander, LineMemory, MemoryTrace, QuadLines, TraceCounts, interleave,
};

/// One row of tiles, each with one-texel quads. A nearest filter makes a footprint of each lane.
fn trace(items: &[Vec<u32>]) -> MemoryTrace {
    let size_px = [16 * items.len() as u32, 16];
    let mut trace = one_picture(size_px);
    trace.tables.samplers = vec![Sampler {
        mip: MipFilter::None,
        ..Sampler::TRILINEAR_REPEAT
    }];
    let tile = |quads: &Vec<u32>| {
        let records = (0..).zip(quads).map(|(x, footprints)| QuadRecord {
            x,
            mask: ((1_u32 << footprints) - 1) as u8,
            uv: [1024; 2],
            ..QuadRecord::default()
        });
        Tile {
            runs: vec![PrimitiveRun {
                count: quads.len() as u32,
                ..PrimitiveRun::default()
            }],
            records: records.collect(),
        }
    };
    trace.tiles = vec![items.iter().map(tile).collect()];
    trace
}

/// The quads that each core runs, in the order in which they run.
struct Log(Vec<String>);

impl Consumer for Log {
    fn quad(&mut self, core: usize, quad: QuadLines<'_>) {
        self.0.push(format!(
            "core {core}: item {}, {} footprints",
            quad.tile(),
            quad.footprints
        ));
    }
}

pub fn output(settings: &Settings) -> Vec<String> {
    let items: Vec<Vec<u32>> = (settings.list("items").iter())
        .map(|item| item.split('.').map(|n| n.parse().unwrap()).collect())
        .collect();
    let trace = trace(&items);
    let config = RunConfig {
        mode: Mode::Functional,
        order: Order::by_name(&settings.subject).unwrap_or_else(|why| panic!("{why:?}")),
        cores: settings.number("cores", 2) as u32,
        tile_maps: true,
        ..RunConfig::default()
    };
    let expander = Expander::new(&trace, &config).unwrap();
    let memory = LineMemory::new(LineMemory::USUAL_BYTES);
    let mut counts = TraceCounts::new(expander.bins());
    let frame = expander.frame(0, &memory, &mut counts).unwrap();
    let inputs = PlanInputs::new(&config, &trace.tables.meta);
    let phases = plan_frame(config.order, &inputs, &trace.tables.passes, 0);
    let mut cores = Cores::new(&frame, config.cores as usize);
    let mut log = Log(Vec::new());
    interleave(&mut cores, &phases, config.dispatch(), &mut log).unwrap();
    log.0
}
