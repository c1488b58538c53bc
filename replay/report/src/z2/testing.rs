//! An experiment with made-up but consistent numbers: the paper's own miss rates.

use super::model::PaperReport;
use sim::config::RunConfig;
use sim::engine::Work;
use sim::paper::z2;
use sim::preset::Preset;
use sim::result::{
    FirstLookups, LevelCounters, LevelResult, MemoryResult, Part, RunResult, TileMap, TmuResult,
    TraceId,
};
use sim::stream::MemoryTrace;
use sim::stream::testing::tables;
use studies::experiment::{Outcome, Plan, Subject};

const TILES: [u32; 2] = [60, 68];

/// Two scenes whose results equal the paper's table, in both modes.
pub(crate) fn with_report<T>(check: impl FnOnce(&PaperReport) -> T) -> T {
    with_edited(|_, _| (), check)
}

/// The same, each result changed by its point's index.
pub(crate) fn with_edited<T>(
    edit: impl Fn(usize, &mut RunResult),
    check: impl FnOnce(&PaperReport) -> T,
) -> T {
    let scenes = ["crytek-sponza", "l-bench-sponza-shadows"];
    let trace = trace();
    let subjects = scenes.map(|scene| Subject {
        stand_in_for: z2::SCENES.into_iter().find(|s| *s == scene),
        ..Subject::new(&trace, TraceId::default(), scene.to_owned())
    });
    let caches = z2::CACHES_KIB.map(|(l1, l2)| (u64::from(l1) << 10, u64::from(l2) << 10));
    let base = RunConfig::default();
    let preset = Preset::Z2_PAPER;
    let plan = Plan::paper(base, &caches, &z2::ORDERS, true)
        .and_then(|plan| plan.beside(preset, preset.over(base)))
        .unwrap()
        .with_tile_maps();
    let mut results = Vec::new();
    for scene in scenes {
        for (index, point) in plan.points.iter().enumerate() {
            let [l1, l2] =
                [&point.config.level.l1, &point.config.level.l2].map(|c| c.size_bytes as u32 >> 10);
            let row = z2::row(scene, l1, l2, point.config.order).unwrap();
            let rates = [
                row.l1_footprint_miss_pct,
                row.l2_line_miss_pct,
                row.tmu_util_pct,
            ];
            let mut result = result(rates, point.config.tile_maps);
            edit(index, &mut result);
            results.push(result);
        }
    }
    check(&PaperReport::new(&Outcome::new(
        &plan,
        &subjects,
        results,
        Work::default(),
    )))
}

fn trace() -> MemoryTrace {
    let mut tables = tables(&[]);
    tables.meta.driver = "llvmpipe".to_owned();
    for pass in &mut tables.passes {
        pass.tiles = TILES;
    }
    MemoryTrace {
        tables,
        tiles: Vec::new(),
    }
}

fn result([l1_pct, l2_pct, tmu_pct]: [f64; 3], maps: bool) -> RunResult {
    let footprints = 20_000_000u64;
    let l1_misses = (footprints as f64 * l1_pct / 100.0) as u64;
    let l2_misses = (l1_misses as f64 * l2_pct / 100.0) as u64;
    let counters = |lookups: u64, misses: u64| LevelCounters {
        footprints: lookups,
        footprint_misses: misses,
        line_lookups: lookups,
        line_misses: misses,
        secondary_misses: 0,
    };
    let level = |lookups: u64, misses: u64| LevelResult::new(counters(lookups, misses));
    let parts = |names: &[&str]| {
        names
            .iter()
            .enumerate()
            .map(|(i, name)| {
                let share = 2 + i as u64;
                Part {
                    name: (*name).to_owned(),
                    l1: counters(footprints / share, l1_misses / share),
                    l2: counters(l1_misses / share, l2_misses / share),
                }
            })
            .collect::<Vec<_>>()
    };
    let textures: Vec<String> = (0..24)
        .map(|i| format!("textures/sponza_curtain_{i}_diff.png"))
        .collect();
    let textures: Vec<&str> = textures.iter().map(String::as_str).collect();
    RunResult {
        quads: 2_000_000,
        lanes: 7_600_000,
        footprints,
        l1: level(footprints, l1_misses),
        l2: level(l1_misses, l2_misses),
        external_bytes: l2_misses * 16,
        unique_lines: 400_000,
        access_hash: "00c0ffee".to_owned(),
        tmu: Some(TmuResult {
            utilization: tmu_pct / 100.0,
            ..TmuResult::default()
        }),
        cycles: Some(30_000_000),
        memory: MemoryResult::default(),
        timeline: None,
        clients: Vec::new(),
        geometry: None,
        first_lookups: Some(FirstLookups {
            l1_footprint_miss_rate: l1_pct / 100.0,
            l2_line_miss_rate: l2_pct / 100.0,
            ..FirstLookups::default()
        }),
        by_view: parts(&["left", "right"]),
        by_draw: Vec::new(),
        by_texture: parts(&textures),
        by_level: parts(&["level 0", "level 1", "level 2", "level 3", "level 4"]),
        tile_maps: if maps {
            vec![map(0), map(1)]
        } else {
            Vec::new()
        },
    }
}

/// A peak that is further left in the right eye.
fn map(pass: u32) -> TileMap {
    let value = |x: u32, y: u32| {
        let dx = f64::from(x) - 30.0 + 4.0 * f64::from(pass);
        let dy = f64::from(y) - 34.0;
        (-(dx * dx + dy * dy) / 300.0).exp()
    };
    let cells: Vec<f64> = (0..TILES[1])
        .flat_map(|y| (0..TILES[0]).map(move |x| (x, y)))
        .map(|(x, y)| value(x, y))
        .collect();
    let counts = |scale: f64| cells.iter().map(|v| (v * scale) as u32).collect();
    TileMap {
        pass,
        tiles: TILES,
        overdraw: cells.iter().map(|v| (1.0 + 3.0 * v) as f32).collect(),
        footprints: counts(9000.0),
        l1_misses: counts(900.0),
        l2_misses: counts(300.0),
    }
}
