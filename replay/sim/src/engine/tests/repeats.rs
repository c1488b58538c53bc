//! Configurations that share a pass although their caches keep different lines between frames, and frames that
//! repeat an earlier one: results are those of a full replay of each configuration alone.

use super::*;
use crate::config::RunConfig;
use crate::stream::testing::different_frames;
use crate::stream::{TileSource, Walk};
use formats::textrace::{Tables, Tile};
use std::sync::atomic::{AtomicU64, Ordering};

/// A trace of these of three different frames.
fn frames(numbers: &[usize]) -> MemoryTrace {
    let different = different_frames();
    let passes = different.tables.passes.len() / 3;
    let mut trace = different.clone();
    trace.tables.passes.clear();
    trace.tables.meta.frames.clear();
    trace.tiles.clear();
    for (frame, &number) in (0..).zip(numbers) {
        let of_frame = number * passes..(number + 1) * passes;
        for pass in &different.tables.passes[of_frame.clone()] {
            let mut pass = *pass;
            pass.frame = frame;
            trace.tables.passes.push(pass);
        }
        trace.tiles.extend_from_slice(&different.tiles[of_frame]);
        let mut views = different.tables.meta.frames[0].clone();
        views.frame = frame;
        trace.tables.meta.frames.push(views);
    }
    trace
}

/// Replays a configuration frame by frame in plain caches.
fn plainly(trace: &MemoryTrace, config: &RunConfig) -> RunResult {
    let bins = Bins::new(&trace.tables, CountBy::Texture).unwrap();
    let counts = CacheCounts::new(&bins, config.tile_maps);
    let mut machine = Functional::new(Hierarchy::build(config).unwrap(), counts);
    let expander = Expander::new(trace, config).unwrap();
    let memory = LineMemory::new(1 << 30);
    let mut walk = Walk::new(&expander, &memory, config, [config.order]);
    for (index, number) in walk.frames().into_iter().enumerate() {
        if index > 0 {
            machine.between_frames(index, config);
        }
        let frame = walk.expand(number).unwrap();
        let phases = walk.plan(&frame).unwrap().phases(config);
        let mut cores = Cores::new(&frame, config.cores as usize);
        let work = FrameWork {
            identity: None,
            cores: &mut cores,
            phases: &phases,
            assign: config.dispatch(),
            clients: None,
        };
        machine.run(work).unwrap();
    }
    let outcome = machine.outcome(config);
    RunResult {
        memory: outcome.memory,
        ..summary(
            &trace.tables,
            expander.bins(),
            walk.counts(),
            &outcome.counts,
            config,
        )
    }
}

/// A trace that counts the tiles that are read, and may hide that frames are equal.
struct Counting<'t> {
    trace: &'t MemoryTrace,
    hides: bool,
    read: AtomicU64,
}

impl TileSource for Counting<'_> {
    fn tables(&self) -> &Tables {
        &self.trace.tables
    }

    fn records(&self) -> u64 {
        self.trace.records()
    }

    fn read_tile(&self, pass: u32, index: u32, tile: &mut Tile) -> Result<(), StreamError> {
        self.read.fetch_add(1, Ordering::Relaxed);
        self.trace.read_tile(pass, index, tile)
    }

    fn has_same_tiles(&self, a: u32, b: u32) -> bool {
        !self.hides && self.trace.has_same_tiles(a, b)
    }
}

/// Results of all configurations, and the number of tiles read.
fn counted(trace: &MemoryTrace, configs: &[RunConfig], hides: bool) -> (Vec<RunResult>, u64) {
    let source = Counting {
        trace,
        hides,
        read: AtomicU64::new(0),
    };
    let results = Mutex::new(vec![RunResult::default(); configs.len()]);
    let keep = |index: usize, result| results.lock().unwrap()[index] = result;
    let memory = LineMemory::new(1 << 30);
    replay_all(&source, configs, &memory, &keep).unwrap();
    (results.into_inner().unwrap(), source.read.into_inner())
}

#[test]
fn treatments_between_frames_and_equal_frames_have_the_counts_of_plain_replays() {
    let mut random = Random(5);
    let (mut shared, mut skipped) = (0, 0);
    let orders: Vec<Order> = Order::all().chain(composed()).collect();
    for set in 0..60 {
        let length = 2 + random.below(7);
        let numbers: Vec<usize> = (0..length).map(|_| random.below(3) as usize / 2).collect();
        let trace = frames(&numbers);
        let base = RunConfig {
            order: random.pick(&orders),
            cores: random.pick(&[1, 2, 2, 3]),
            assign: random.pick(&[Assign::FirstIdle, Assign::Static]),
            tile_maps: random.below(4) == 0,
            ..functional(Order::MORTON)
        };
        let treatments = [
            BetweenFrames::Keep,
            BetweenFrames::Flush,
            BetweenFrames::Lose(50),
            BetweenFrames::Lose(100),
        ];
        let levels: Vec<Levels> = (0..=random.below(2))
            .map(|_| {
                let mut l2 = random_cache(&mut random, 256);
                l2.set_index = random.pick(&crate::config::SetIndex::ALL);
                l2.ways = 4;
                l2.size_bytes = l2.size_bytes.next_power_of_two().max(1 << 10);
                Levels::two(random_cache(&mut random, 32), l2)
            })
            .collect();
        let some = 1 + random.below(4) as usize;
        let first = random.below(4) as usize;
        let treatments = (0..some).map(|index| treatments[(first + index) % 4]);
        let configs: Vec<RunConfig> = treatments
            .flat_map(|between_frames| {
                levels.iter().map(move |&level| RunConfig {
                    level,
                    between_frames,
                    ..base
                })
            })
            .collect();
        let (results, read) = counted(&trace, &configs, false);
        let (hidden, read_all) = counted(&trace, &configs, true);
        for ((config, result), hidden) in configs.iter().zip(&results).zip(&hidden) {
            assert_eq!(
                *result,
                plainly(&trace, config),
                "set {set}: {numbers:?} {config:?}"
            );
            assert_eq!(result, hidden, "set {set}");
        }
        shared += sharing(&configs)
            .iter()
            .flatten()
            .filter(|of| of.len() > levels.len())
            .count();
        skipped += u64::from(read < read_all);
    }
    assert!(shared > 24 && skipped > 3, "{shared} {skipped}");
}

#[test]
fn equal_frames_are_expanded_until_the_contents_repeat() {
    let trace = frames(&[0; 12]);
    let tiles = trace
        .tiles
        .iter()
        .map(|tiles| tiles.len() as u64)
        .sum::<u64>()
        / 12;
    let read = |config: RunConfig| counted(&trace, &[config], false).1;
    let base = functional(Order::MORTON);
    let with = |between_frames| RunConfig {
        between_frames,
        ..base
    };
    // The first frame starts with other contents than the second, and that with those of the third.
    assert_eq!(read(with(BetweenFrames::Keep)), 2 * tiles);
    assert_eq!(read(with(BetweenFrames::Flush)), tiles);
    // The direction of a boustrophedon alternates, so two different frames recur.
    let boustro = Order::find("zig-zag+sta+boustro").unwrap();
    let found = read(RunConfig {
        order: boustro,
        ..base
    });
    assert!(found <= 4 * tiles, "{found} of {tiles}");
    // Clocks, counters of the frame before, and other policies need every frame.
    for config in [
        RunConfig {
            mode: Mode::Timed,
            ..base
        },
        RunConfig {
            order: Order::find("zig-zag+sta+row-lines").unwrap(),
            ..base
        },
        RunConfig {
            level: Levels::two(
                LevelConfig {
                    replacement: Replacement::FIFO,
                    ..base.level.l1
                },
                base.level.l2,
            ),
            ..base
        },
    ] {
        assert!(read(config) >= 12 * tiles, "{config:?}");
    }
}
