//! Measures the stages of a replay one by one.

use crate::plain_lru;
use crate::table::Row;
use formats::textrace::{Encoding, Textrace, TextraceWriter, Tile, encode_tile_as};
use replay::config::{LevelConfig, Levels, Mode, Order, RunConfig};
use replay::engine::replay_all;
use replay::memory::AnyCache;
use replay::order::{self, Phase, PlanInputs, WorkItem};
use replay::stream::{
    Consumer, Cores, Expander, Frame, LineMemory, QuadLines, TraceCounts, interleave,
};
use std::hint::black_box;
use std::io::Write;
use std::time::{Duration, Instant};

/// Memory limit that fits the lines of any frame.
const ROOM_BYTES: u64 = 8 << 30;

/// The shortest of at least two runs.
pub fn seconds(mut run: impl FnMut()) -> f64 {
    const WHILE: Duration = Duration::from_secs(3);
    let start = Instant::now();
    let mut shortest = f64::INFINITY;
    for runs in 0.. {
        if runs >= 2 && start.elapsed() > WHILE {
            break;
        }
        let start = Instant::now();
        run();
        shortest = shortest.min(start.elapsed().as_secs_f64());
    }
    shortest
}

/// A stream of lines without any other data.
struct Lines(Vec<u32>);

impl Consumer for Lines {
    fn quad(&mut self, _core: usize, quad: QuadLines<'_>) {
        self.0.extend_from_slice(quad.lines);
    }
}

/// One core's caches. Misses fill at once. Without an L2, only the L1 is used.
struct Caches {
    l1: AnyCache,
    l2: Option<AnyCache>,
    misses: u64,
}

impl Consumer for Caches {
    fn quad(&mut self, _core: usize, quad: QuadLines<'_>) {
        let AnyCache::FourWayLru(l1) = &mut self.l1 else {
            unreachable!("a four-way LRU cache was asked for")
        };
        for &line in quad.lines {
            if !l1.access(line) {
                match &mut self.l2 {
                    Some(AnyCache::FourWayLru(l2)) => self.misses += u64::from(!l2.access(line)),
                    _ => self.misses += 1,
                }
            }
        }
    }
}

/// Measures every row of the table.
pub fn measure(trace: &Textrace) -> Vec<Row> {
    let config = RunConfig {
        cores: 1,
        ..RunConfig::default()
    };
    let mut rows: Vec<Row> = [Encoding::Delta, Encoding::Planes]
        .into_iter()
        .map(|encoding| decode(&encoded(trace, encoding), encoding))
        .collect();
    let expander = Expander::new(trace, &config).expect("the trace's tables fit together");
    let memory = LineMemory::new(ROOM_BYTES);
    let mut counts = TraceCounts::new(expander.bins());
    let first = trace.tables().passes.iter().map(|pass| pass.frame).min();
    let number = first.expect("a trace has a pass");
    let expand = || {
        let mut counts = TraceCounts::new(expander.bins());
        expander.frame(number, &memory, &mut counts).map(|_| counts)
    };
    let took = seconds(|| {
        black_box(expand().expect("an undamaged trace"));
    });
    let frame = expander.frame(number, &memory, &mut counts);
    let frame = frame.expect("an undamaged trace");
    let inputs = PlanInputs::default();
    let phases = order::plan_frame(Order::MORTON, &inputs, &trace.tables().passes, number);
    let mut lines = Lines(Vec::new());
    pass(&frame, &phases, &mut lines);
    let lines = lines.0;
    let listed = lines.len() as u64;
    rows.push(Row::new("expansion", listed, 8 * listed, took));
    rows.push(orders(trace, number));
    let mut cores = || pass(&frame, &phases, &mut Skip(0));
    rows.push(Row::new(
        "lines by core",
        listed,
        4 * listed,
        seconds(&mut cores),
    ));
    for (name, l2) in [("L1", None), ("L1 and L2", Some(config.level.l2))] {
        let took = seconds(|| {
            let mut caches = Caches {
                l1: cache(&config.level.l1, "L1"),
                l2: l2.map(|l2| cache(&l2, "L2")),
                misses: 0,
            };
            pass(&frame, &phases, &mut caches);
            black_box(caches.misses);
        });
        rows.push(Row::new(name, listed, 4 * listed, took));
    }
    rows.push(yardstick(&lines, &config));
    drop(frame);
    rows.extend(whole(trace, listed));
    rows
}

fn cache(config: &LevelConfig, level: &'static str) -> AnyCache {
    AnyCache::build(config, level, 16, 1).expect("a usual cache")
}

/// Reads every line, so that the compiler keeps the whole stream.
struct Skip(u32);

impl Consumer for Skip {
    fn quad(&mut self, _core: usize, quad: QuadLines<'_>) {
        self.0 ^= quad.lines.iter().fold(0, |sum, line| sum ^ line);
        black_box(self.0);
    }
}

fn pass(frame: &Frame<'_>, phases: &[Phase], consumer: &mut impl Consumer) {
    let mut cores = Cores::new(frame, 1);
    interleave(&mut cores, phases, RunConfig::default().assign, consumer)
        .expect("the tiles were expanded before");
}

/// Pass and index of every tile.
fn tiles(trace: &Textrace) -> Vec<(usize, usize)> {
    (0..)
        .zip(&trace.tables().passes)
        .flat_map(|(pass, info)| (0..info.tile_count() as usize).map(move |tile| (pass, tile)))
        .collect()
}

/// The trace in memory with another encoding of its tiles.
fn encoded(trace: &Textrace, encoding: Encoding) -> Textrace {
    let tables = trace.tables();
    let mut writer = TextraceWriter::in_memory(tables).expect("the tables were read");
    let mut tile = Tile::default();
    for (pass, index) in tiles(trace) {
        let decoded = trace.decode_tile(pass, index, &mut tile);
        decoded.expect("an undamaged trace");
        let encoded = encode_tile_as(encoding, tables, &tile).expect("a decoded tile");
        let appended = writer.append(pass, index, encoded);
        appended.expect("memory takes it");
    }
    let bytes = writer.into_bytes().expect("memory takes it");
    Textrace::from_bytes(bytes).expect("just written")
}

/// Decodes every tile to records. Counts quads, and bytes of the file.
fn decode(trace: &Textrace, encoding: Encoding) -> Row {
    let mut tile = Tile::default();
    let (mut quads, mut bytes) = (0, 0);
    let tiles = tiles(trace);
    for &(pass, index) in &tiles {
        let stats = trace.tile_stats(pass, index);
        quads += u64::from(stats.records);
        bytes += u64::from(stats.bytes);
    }
    let took = seconds(|| {
        for &(pass, index) in &tiles {
            let decoded = trace.decode_tile(pass, index, &mut tile);
            decoded.expect("an undamaged trace");
            black_box(&tile);
        }
    });
    let bytes_a_quad = bytes as f64 / quads as f64;
    let name = format!("decode {encoding:?}, {bytes_a_quad:.2} B a quad (quads)").to_lowercase();
    Row::new(name, quads, bytes, took)
}

/// Lists the work items of all orders for a frame.
fn orders(trace: &Textrace, frame: u32) -> Row {
    let passes = &trace.tables().passes;
    let inputs = PlanInputs::default();
    let plan = || -> usize {
        let plans = Order::all().map(|order| order::plan_frame(order, &inputs, passes, frame));
        plans.flatten().map(|phase| phase.len()).sum()
    };
    let items = plan() as u64;
    let took = seconds(|| {
        black_box(plan());
    });
    let bytes = items * size_of::<WorkItem>() as u64;
    Row::new("orders (items)", items, bytes, took)
}

/// The plain LRU, including opening the file.
fn yardstick(lines: &[u32], config: &RunConfig) -> Row {
    let file = tempfile::NamedTempFile::new().and_then(|mut file| {
        let bytes: Vec<u8> = lines.iter().flat_map(|line| line.to_le_bytes()).collect();
        file.write_all(&bytes).map(|()| file)
    });
    let file = file.expect("the temporary folder takes a file");
    let sets = config.level.l1.sets("L1", config.line_bytes);
    let sets = sets.expect("a usual cache");
    let took = seconds(|| {
        let misses = plain_lru::misses(file.path(), sets);
        black_box(misses.expect("the file was just written"));
    });
    let listed = lines.len() as u64;
    Row {
        yardstick: true,
        ..Row::new("plain LRU, mapped file", listed, 4 * listed, took)
    }
}

/// Whole replays, including decoding and expansion. Counts lines times configurations.
fn whole(trace: &Textrace, listed: u64) -> Vec<Row> {
    let replay = |mode, l1_kib: &[u64], l2_kib: &[u64]| {
        let config = |(l1, l2)| RunConfig {
            mode,
            level: Levels::two(LevelConfig::lru(l1 << 10), LevelConfig::lru(l2 << 10)),
            ..RunConfig::default()
        };
        let pairs = l1_kib
            .iter()
            .flat_map(|&l1| l2_kib.iter().map(move |&l2| (l1, l2)));
        let configs: Vec<RunConfig> = pairs.map(config).collect();
        let took = seconds(|| {
            let memory = LineMemory::new(ROOM_BYTES);
            let done = replay_all(trace, &configs, &memory, &|_, result| {
                black_box(result);
            });
            assert!(done.is_ok(), "an undamaged trace replays");
        });
        (configs.len() as u64, took)
    };
    let l2: Vec<u64> = (0..4).map(|n| 64 << n).collect();
    let cases: [(&'static str, Mode, &[u64], &[u64]); 4] = [
        ("replay, 1 configuration", Mode::Functional, &[32], &[512]),
        (
            "replay, 12 in one pass",
            Mode::Functional,
            &[8, 16, 32],
            &l2,
        ),
        ("replay, 1 timed", Mode::Timed, &[8], &[128]),
        ("replay, 4 timed", Mode::Timed, &[8, 16], &[128, 256]),
    ];
    let row = |(name, mode, l1, l2): (_, _, &[u64], &[u64])| {
        let (configs, took) = replay(mode, l1, l2);
        Row::new(name, listed * configs, 4 * listed * configs, took)
    };
    cases.into_iter().map(row).collect()
}
