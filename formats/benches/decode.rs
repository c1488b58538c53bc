//! Decoding speed and size of the tile encodings.
//!
//! `cargo bench -p formats` uses generated tiles; `TEXTRACE=file cargo bench -p formats` uses a trace.

use criterion::{Criterion, Throughput};
use formats::random::Random;
use formats::textrace::{
    Draw, Encoding, Pass, PassKind, PrimitiveRun, QuadRecord, Tables, Textrace, TextraceWriter,
    Tile, TraceMeta, UvGroup, encode_tile_as, quad_morton,
};
use formats::view::{FovTangents, FrameViews};
use std::hint::black_box;
use std::path::Path;

/// Uniform in `low..high`.
fn between(random: &mut Random, low: f64, high: f64) -> f64 {
    low + (high - low) * random.unit_f64()
}

/// Texture coordinates in perspective: `(a x + b y + c) / w` for u and v.
struct Plane {
    numerators: [[f64; 3]; 2],
    w: [f64; 3],
}

impl Plane {
    fn at(&self, x: f64, y: f64) -> [f32; 2] {
        let dot = |k: [f64; 3]| k[0] * x + k[1] * y + k[2];
        // Shaders use f32 coordinates, so the differences include their rounding.
        self.numerators.map(|n| (dot(n) / dot(self.w)) as f32)
    }
}

/// A tile of a finely tessellated surface: cells of `cell` pixels with two triangles each. The planes of
/// the triangles differ slightly.
fn generated_tile(random: &mut Random, cell: f64) -> Tile {
    let base = Plane {
        numerators: [0, 1].map(|_| {
            let slope = |r: &mut Random| between(r, -0.002, 0.002);
            [slope(random), slope(random), between(random, 0.0, 1.0)]
        }),
        w: [
            between(random, -0.004, 0.004),
            between(random, -0.004, 0.004),
            1.0,
        ],
    };
    let mut tile = Tile::default();
    let cells = (16.0 / cell).ceil() as i32 + 1;
    let offset = [between(random, -cell, 0.0), between(random, -cell, 0.0)];
    let first_primitive = between(random, 0.0, 1000.0) as u32;
    for triangle in 0..cells * cells * 2 {
        let (column, row) = (triangle / 2 % cells, triangle / 2 / cells);
        let wobble = |r: &mut Random, n: f64| n * between(r, 0.95, 1.05);
        let plane = Plane {
            numerators: base
                .numerators
                .map(|n| [wobble(random, n[0]), wobble(random, n[1]), n[2]]),
            w: [wobble(random, base.w[0]), wobble(random, base.w[1]), 1.0],
        };
        let inside = |x: i32, y: i32| {
            let u = (f64::from(x) + 0.5 - offset[0]) / cell - f64::from(column);
            let v = (f64::from(y) + 0.5 - offset[1]) / cell - f64::from(row);
            (0.0..1.0).contains(&u)
                && (0.0..1.0).contains(&v)
                && (u + v < 1.0) == (triangle % 2 == 0)
        };
        let first = tile.records.len();
        for quad in 0..64 {
            let (x, y) = (quad % 8, quad / 8);
            let mask = (0..4)
                .filter(|l| inside(x * 2 + l % 2, y * 2 + l / 2))
                .fold(0, |m, l| m | 1 << l);
            if mask != 0 {
                tile.records.push(record(&plane, x as u8, y as u8, mask));
            }
        }
        let count = (tile.records.len() - first) as u32;
        if let Some(of_run) = tile.records.get_mut(first..).filter(|r| !r.is_empty()) {
            of_run.sort_by_key(|r| quad_morton(r.x, r.y));
            let first = first as u32;
            tile.runs.push(PrimitiveRun {
                primitive: first_primitive + triangle as u32,
                draw: 0,
                first,
                count,
            });
        }
    }
    tile
}

fn record(plane: &Plane, x: u8, y: u8, mask: u8) -> QuadRecord {
    let lane = |i: u8, j: u8| plane.at(f64::from(x * 2 + i), f64::from(y * 2 + j));
    let (o, r, d, c) = (lane(0, 0), lane(1, 0), lane(0, 1), lane(1, 1));
    let fixed = |f: &dyn Fn(usize) -> f32| [0, 1].map(|a| (f(a) * 2048.0 * 1024.0).round() as i32);
    QuadRecord {
        x,
        y,
        mask,
        group: 0,
        uv: fixed(&|a| o[a]),
        dx: fixed(&|a| r[a] - o[a]),
        dy: fixed(&|a| d[a] - o[a]),
        cross: fixed(&|a| (c[a] - d[a]) - (r[a] - o[a])),
    }
}

/// A trace of generated tiles, half of them with small triangles.
fn generated_trace() -> Textrace {
    let mut meta = TraceMeta::default();
    meta.frames.push(FrameViews::default());
    meta.hmd.eye_size_px = [512; 2];
    meta.hmd.fov = [FovTangents::new(1.0, 1.0, 1.0, 1.0); 2];
    let tables = Tables {
        meta,
        draws: vec![Draw {
            material: String::new(),
            first_primitive: 0,
            primitives: u32::MAX,
            groups: vec![UvGroup {
                extent: [1024; 2],
                samples: vec![],
            }],
        }],
        passes: vec![Pass {
            frame: 0,
            kind: PassKind::Main,
            eye: None,
            layer: 0,
            size_px: [512; 2],
            tiles: [32; 2],
        }],
        ..Tables::default()
    };
    let mut random = Random(1);
    let mut writer = TextraceWriter::in_memory(&tables).expect("the tables are well formed");
    for index in 0..32 * 32 {
        let cell = if index % 2 == 0 { 4.5 } else { 9.0 };
        let tile = generated_tile(&mut random, cell);
        writer
            .write_tile(0, index, &tile)
            .expect("the tile is well formed");
    }
    Textrace::from_bytes(writer.into_bytes().expect("memory takes it")).expect("just written")
}

fn every_tile(trace: &Textrace, mut visit: impl FnMut(usize, usize)) {
    for (pass, info) in trace.tables().passes.iter().enumerate() {
        (0..info.tile_count() as usize).for_each(|index| visit(pass, index));
    }
}

fn reencoded(trace: &Textrace, encoding: Encoding) -> Textrace {
    let tables = trace.tables();
    let mut writer = TextraceWriter::in_memory(tables).expect("the tables were read");
    let mut tile = Tile::default();
    every_tile(trace, |pass, index| {
        trace
            .decode_tile(pass, index, &mut tile)
            .expect("an undamaged trace");
        let encoded = encode_tile_as(encoding, tables, &tile).expect("a decoded tile");
        writer
            .append(pass, index, encoded)
            .expect("memory takes it");
    });
    Textrace::from_bytes(writer.into_bytes().expect("memory takes it")).expect("just written")
}

fn main() {
    let source = std::env::var_os("TEXTRACE").map_or_else(generated_trace, |path| {
        Textrace::open(Path::new(&path)).expect("TEXTRACE names a readable trace")
    });
    let mut criterion = Criterion::default().sample_size(10).configure_from_args();
    let mut group = criterion.benchmark_group("decode");
    for encoding in Encoding::ALL {
        let trace = reencoded(&source, encoding);
        let (mut records, mut runs, mut bytes) = (0u64, 0u64, 0u64);
        every_tile(&trace, |pass, index| {
            let stats = trace.tile_stats(pass, index);
            records += u64::from(stats.records);
            runs += u64::from(stats.runs);
            bytes += u64::from(stats.bytes);
        });
        println!(
            "{encoding:?}: {records} quads, {:.2} a run, {:.2} bytes a quad",
            records as f64 / runs as f64,
            bytes as f64 / records as f64
        );
        group.throughput(Throughput::Elements(records));
        group.bench_function(format!("{encoding:?}"), |bencher| {
            let mut tile = Tile::default();
            bencher.iter(|| {
                every_tile(&trace, |pass, index| {
                    trace
                        .decode_tile(pass, index, &mut tile)
                        .expect("an undamaged trace");
                    black_box(&tile);
                });
            });
        });
    }
    group.finish();
    criterion.final_summary();
}
