//! `look-ups first-miss loop_cycles=N`: one footprint of two lines that share the only way of an L1.

use super::{Settings, one_picture};
use formats::textrace::{PrimitiveRun, QuadRecord, SUBTEXELS, Tile};
use formats::texture::{MipFilter, Sampler, TexelFormat};
use replay::config::RunConfig;
use replay::engine::replay;

pub fn output(settings: &Settings) -> Vec<String> {
    let mut trace = one_picture([16, 16]);
    trace.tables.samplers = vec![Sampler {
        mip: MipFilter::None,
        ..Sampler::TRILINEAR_REPEAT
    }];
    trace.tables.textures[0].format = TexelFormat::Bc1;
    // Between the second and the third block of a row: the end of one line and the start of the next.
    let record = QuadRecord {
        mask: 1,
        uv: [8 * SUBTEXELS, 2 * SUBTEXELS],
        ..QuadRecord::default()
    };
    let runs = vec![PrimitiveRun {
        count: 1,
        ..PrimitiveRun::default()
    }];
    trace.tiles = vec![vec![Tile {
        runs,
        records: vec![record],
    }]];
    let text = format!(
        "cores = 1\n[[level]]\nsize_bytes = 16\nways = 1\n[[level]]\nsize_bytes = 1024\n[tmu]\nmodel = \"{}\"\nloop_cycles = {}\n",
        settings.subject,
        settings.number("loop_cycles", 24)
    );
    let config: RunConfig = toml::from_str(&text).unwrap();
    let result = replay(&trace, &config).unwrap();
    let first = result.first_lookups.unwrap();
    vec![
        format!("footprints: {}", result.footprints),
        format!(
            "lines requested by the L1: {}",
            result.l1.counters.line_misses
        ),
        format!("lines from memory: {}", result.l2.counters.line_misses),
        format!("look-ups served by the fill: {}", first.forwarded),
        format!("cycles: {}", result.cycles.unwrap()),
    ]
}
