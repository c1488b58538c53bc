//! Size and speed of the columns of ray traces.
//!
//! `cargo bench -p formats --bench ray_columns -- TRACE...` takes traces captured with
//! `tracegen rays --all-columns` and prints, for each, a line per column: trace, column, items, coded bytes,
//! uncoded bytes, seconds to write, seconds to read. One thread. Each tile is timed in every round, and its least
//! time counts, so that other programs disturb the sum little.

use formats::container::ChunkTag;
use formats::raytrace::{
    EncodedRayTile, GEOMETRY_INDEX, GEOMETRY_TILES, NODES, RAY_INDEX, RAY_TILES, RayTile, Raytrace,
    RaytraceTables, RaytraceWriter, SLOTS, encode_ray_tile, encode_ray_tile_with_geometry,
};
use formats::view::Eye;
use std::path::{Path, PathBuf};
use std::time::Instant;

const ROUNDS: usize = 5;
/// A ray in memory: kind, outcome, depth, parent, steps, triangle tests and alpha tests.
const RECORD_BYTES: u64 = 3 + 4 * 4;
/// Nine coordinates and limits, distance, slot and stack depth of 4 bytes each.
const GEOMETRY_BYTES: u64 = 11 * 4;
/// A visit: kind and index.
const VISIT_BYTES: u64 = 5;

/// Seconds of a tile for records, with visits, and with visits and geometry.
#[derive(Clone, Copy, Debug)]
struct Times {
    write: [f64; 3],
    read: [f64; 3],
}

const UNTIMED: Times = Times {
    write: [f64::MAX; 3],
    read: [f64::MAX; 3],
};

/// Keeps the least time.
fn timed<T>(least: &mut f64, work: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let result = work();
    *least = least.min(start.elapsed().as_secs_f64());
    result
}

fn places(tables: &RaytraceTables) -> impl Iterator<Item = (Eye, u32)> {
    let tiles = tables.tile_count();
    let of_eye = move |eye| (0..tiles).map(move |tile| (eye, tile));
    [Eye::Left, Eye::Right].into_iter().flat_map(of_eye)
}

/// The trace without visits, geometry and hierarchy.
fn records_alone(trace: &Raytrace) -> Raytrace {
    let mut tables = trace.tables().clone();
    tables.meta.has_visits = false;
    let mut writer = RaytraceWriter::in_memory().expect("in memory");
    let mut tile = RayTile::default();
    for (eye, number) in places(&tables) {
        trace.decode_tile(eye, number, &mut tile).expect("decodes");
        tile.visits.clear();
        let encoded = encode_ray_tile(&tile, false).expect("encodes");
        writer.tile(&encoded).expect("in memory");
    }
    let bytes = writer.into_bytes(&tables).expect("writes");
    Raytrace::from_bytes(bytes).expect("opens")
}

/// Times every tile once.
fn round(trace: &Raytrace, plain: &Raytrace, times: &mut [Times]) {
    let tables = trace.tables();
    let mut tile = RayTile::default();
    let size = |tile: EncodedRayTile| assert!(tile.size_bytes() > 0);
    for ((eye, number), times) in places(tables).zip(times) {
        let [records, visits, geometry] = &mut times.read;
        timed(records, || plain.decode_tile(eye, number, &mut tile)).expect("decodes");
        timed(visits, || trace.decode_tile(eye, number, &mut tile)).expect("decodes");
        let whole = timed(geometry, || {
            trace.decode_tile_with_geometry(eye, number, &mut tile)
        });
        whole.expect("decodes");
        let camera = tables.camera(eye);
        let [records, visits, geometry] = &mut times.write;
        timed(geometry, || {
            encode_ray_tile_with_geometry(tables, camera, &tile).map(size)
        })
        .expect("encodes");
        timed(visits, || encode_ray_tile(&tile, true).map(size)).expect("encodes");
        tile.visits.clear();
        timed(records, || encode_ray_tile(&tile, false).map(size)).expect("encodes");
    }
}

fn chunks(trace: &Raytrace, tags: &[ChunkTag]) -> u64 {
    let of = |tag: &ChunkTag| trace.container().entry(*tag).map_or(0, |e| e.length_bytes);
    tags.iter().map(of).sum()
}

fn line(path: &Path, column: &str, items: u64, bytes: [u64; 2], seconds: [f64; 2]) {
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    let [coded, uncoded] = bytes;
    let [write, read] = seconds;
    println!("{name},{column},{items},{coded},{uncoded},{write:.6},{read:.6}");
}

fn measure(path: &Path) {
    let trace = Raytrace::open(path).expect("a ray trace");
    assert!(
        trace.has_geometry() && trace.has_hierarchy() && trace.tables().meta.has_visits,
        "{}: expected a trace with all columns",
        path.display()
    );
    let plain = records_alone(&trace);
    let (mut rays, mut visits, mut tile) = (0, 0, RayTile::default());
    for (eye, number) in places(trace.tables()) {
        trace.decode_tile(eye, number, &mut tile).expect("decodes");
        rays += tile.rays.len() as u64;
        visits += tile.visits.len() as u64;
    }
    let mut times = vec![UNTIMED; places(trace.tables()).count()];
    for _ in 0..ROUNDS {
        round(&trace, &plain, &mut times);
    }
    let sum = |of: &dyn Fn(&Times) -> f64| times.iter().map(of).sum::<f64>();
    let seconds = |part: usize| [sum(&|t| t.write[part]), sum(&|t| t.read[part])];
    let [records, with_visits, with_geometry] = [0, 1, 2].map(seconds);
    let more = |a: [f64; 2], b: [f64; 2]| [a[0] - b[0], a[1] - b[1]];
    let tiles = [RAY_TILES, RAY_INDEX];
    let of_records = chunks(&plain, &tiles);
    let of_visits = chunks(&trace, &tiles) - of_records;
    let of_geometry = chunks(&trace, &[GEOMETRY_TILES, GEOMETRY_INDEX]);
    let [extra_visits, extra_geometry] =
        [more(with_visits, records), more(with_geometry, with_visits)];
    for (column, items, coded, plain_bytes, seconds) in [
        ("records", rays, of_records, RECORD_BYTES, records),
        ("visits", visits, of_visits, VISIT_BYTES, extra_visits),
        (
            "geometry",
            rays,
            of_geometry,
            GEOMETRY_BYTES,
            extra_geometry,
        ),
    ] {
        line(path, column, items, [coded, items * plain_bytes], seconds);
    }

    let bvh = &trace.tables().bvh;
    let (mut write, mut read) = (f64::MAX, f64::MAX);
    for _ in 0..ROUNDS {
        let hierarchy = timed(&mut read, || trace.read_hierarchy());
        let (hierarchy, _) = hierarchy.expect("decodes").expect("it was there");
        let bytes = timed(&mut write, || hierarchy.encoded_bytes(bvh));
        assert_eq!(bytes as u64, chunks(&trace, &[NODES, SLOTS]));
    }
    let nodes = [
        chunks(&trace, &[NODES]),
        bvh.nodes * u64::from(bvh.bytes_per_node),
    ];
    line(path, "nodes", bvh.nodes, nodes, [write, read]);
    let slots = [
        chunks(&trace, &[SLOTS]),
        bvh.triangles * u64::from(bvh.bytes_per_triangle),
    ];
    line(path, "triangles", bvh.triangles, slots, [write, read]);
}

fn main() {
    // Cargo passes options of its own, which begin with a dash.
    let traces = std::env::args()
        .skip(1)
        .filter(|word| !word.starts_with('-'));
    traces.map(PathBuf::from).for_each(|path| measure(&path));
}
