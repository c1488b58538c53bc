//! An experiment with made-up but consistent numbers: the paper's own miss rates.

use super::model::{PaperReport, Run, TraceInfo};
use crate::config::{CacheConfig, RunConfig};
use crate::paper::{Z2_CACHES_KIB, Z2_ORDERS, z2_row};
use crate::result::{LevelCounters, LevelResult, Part, RunResult, TileMap, TmuResult, TraceId};
use formats::textrace::TraceMeta;
use formats::view::{FovTangents, Hmd};

pub(crate) const TILES: [u32; 2] = [60, 68];

/// Two scenes that replay exactly as the paper's table says.
pub(crate) fn report() -> PaperReport {
    let (traces, config, runs) = inputs();
    let functional: Vec<Run> = runs.clone();
    PaperReport::new(traces, config, &runs, &functional)
}

pub(crate) fn inputs() -> (Vec<TraceInfo>, RunConfig, Vec<Run>) {
    let scenes = ["crytek-sponza", "l-bench-sponza-shadows"];
    let traces = scenes.iter().map(|s| info(s)).collect();
    let mut runs = Vec::new();
    for (trace, scene) in scenes.iter().enumerate() {
        for (l1, l2) in Z2_CACHES_KIB {
            for order in Z2_ORDERS {
                let config = RunConfig {
                    order,
                    l1: CacheConfig::lru(u64::from(l1) << 10),
                    l2: CacheConfig::lru(u64::from(l2) << 10),
                    tile_maps: true,
                    ..RunConfig::default()
                };
                let row = z2_row(scene, l1, l2, order).unwrap();
                let maps = (l1, l2) == Z2_CACHES_KIB[0];
                runs.push(Run {
                    trace,
                    config,
                    result: result(row.l1_miss_pct, row.l2_miss_pct, row.tmu_util_pct, maps),
                });
            }
        }
    }
    (traces, RunConfig::default(), runs)
}

fn result(l1_pct: f64, l2_pct: f64, tmu_pct: f64, maps: bool) -> RunResult {
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
    let level = |lookups: u64, misses: u64| LevelResult {
        miss_rate: misses as f64 / lookups as f64,
        misses,
        counters: counters(lookups, misses),
    };
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
        by_view: parts(&["left", "right"]),
        by_texture: parts(&textures),
        by_level: parts(&["level 0", "level 1", "level 2", "level 3", "level 4"]),
        tile_maps: if maps {
            vec![map(0), map(1)]
        } else {
            Vec::new()
        },
    }
}

/// A bump that sits a little further left in the right eye.
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

fn info(scene: &str) -> TraceInfo {
    let fov = FovTangents {
        left: 1.19,
        right: 1.19,
        up: 1.34,
        down: 1.34,
    };
    TraceInfo {
        label: scene.to_owned(),
        trace: TraceId {
            scene: format!("scenes/{scene}/sponza.gltf"),
            checksum: "1234abcd".to_owned(),
        },
        twin: Some(scene.to_owned()),
        frames: 1,
        quads: 2_000_000,
        lanes: 7_600_000,
        footprints: 20_000_000,
        textures: 24,
        tiles: TILES,
        eye_passes: vec![0, 1],
        meta: TraceMeta {
            tool: "tracegen 0.1.0".to_owned(),
            command_line: vec!["raster".to_owned(), format!("{scene}.gltf")],
            scene: scene.to_owned(),
            scene_triangles: 262_267,
            camera: "default".to_owned(),
            backend: "lavapipe".to_owned(),
            driver: "llvmpipe".to_owned(),
            seed: 1,
            hmd: Hmd {
                name: "symmetric".to_owned(),
                source: "Z2 paper, section 4.2".to_owned(),
                eye_size_px: [960, 1080],
                fov: [fov; 2],
                ipd_m: 0.064,
                cant_deg: 0.0,
            },
            frames: Vec::new(),
        },
    }
}
