//! Frames of traces.

use super::schedulers::Scheduler;
use super::*;
use sim::config::{Levels, Mode, RunConfig};
use sim::stream::MemoryTrace;
use sim::stream::testing::{Synthetic, different_frames, repeated};

fn trace() -> MemoryTrace {
    Synthetic {
        materials: 4,
        seed: 3,
        ..Synthetic::new([160, 96], 25)
    }
    .generate()
}

fn times(
    trace: &MemoryTrace,
    config: &RunConfig,
    settings: Settings,
) -> Vec<(Scheduler, FrameTime)> {
    with_timelines(trace, config, settings, false)
}

fn with_timelines(
    trace: &MemoryTrace,
    config: &RunConfig,
    settings: Settings,
    records: bool,
) -> Vec<(Scheduler, FrameTime)> {
    let point = |scheduler| Point {
        scheduler,
        settings,
        records,
    };
    let points: Vec<Point> = Scheduler::all().map(point).collect();
    let times = replay(trace, config, &points, &|_| {}).unwrap();
    Scheduler::all().zip(times).collect()
}

fn sum(time: &FrameTime, of: impl Fn(&Counts) -> u64) -> u64 {
    time.frames.iter().map(|(_, counts)| of(counts)).sum()
}

fn named(name: &str) -> Scheduler {
    Scheduler::find(name).unwrap()
}

/// Caches that hold all textures, so that no set is crowded and the order of accesses changes no count.
#[test]
fn counts_equal_those_of_functional_replay_where_no_set_is_crowded() {
    let trace = trace();
    let level = sim::config::LevelConfig::lru(64 << 20);
    let config = RunConfig {
        mode: Mode::Functional,
        cores: 1,
        level: Levels::two(level, level),
        ..RunConfig::default()
    };
    let functional = sim::replay(&trace, &config).unwrap();
    let settings = Settings {
        dram: DramModel::Fixed,
        l1_mshrs: 1 << 20,
        l2_mshrs: 1 << 20,
        merges: 1 << 20,
        ..Settings::default()
    };
    for (scheduler, time) in times(&trace, &config, settings) {
        let name = scheduler.name();
        let l1 = &functional.l1.counters;
        assert_eq!(sum(&time, |of| of.footprints), l1.footprints, "{name}");
        assert_eq!(sum(&time, |of| of.l1[2]), l1.line_misses, "{name}");
        assert_eq!(
            sum(&time, |of| of.dram_lines[0]),
            functional.l2.counters.line_misses
        );
        assert_eq!(time.unique_lines, functional.unique_lines, "{name}");
        let pixels = 2 * 160 * 96 * 4 / u64::from(config.line_bytes);
        assert_eq!(sum(&time, |of| of.dram_lines[1]), pixels, "{name}");
    }
}

#[test]
fn every_scheduler_filters_everything_and_keeps_the_bound() {
    let trace = trace();
    for cores in [1, 2, 3, 4] {
        let config = RunConfig {
            cores,
            ..RunConfig::default()
        };
        let times = times(&trace, &config, Settings::default());
        let footprints = sum(&times[0].1, |of| of.footprints);
        for (scheduler, time) in &times {
            let name = scheduler.name();
            assert_eq!(sum(time, |of| of.footprints), footprints, "{name}");
            let figures = Figures::of(time);
            assert!(
                figures.bound.cycles <= figures.cycles as f64,
                "{name} {figures:?}"
            );
            let energy = figures.energy;
            assert!(energy.chip_mj[0] > 0.0 && energy.dram_mj[0] < energy.dram_mj[1]);
        }
    }
}

#[test]
fn equal_frames_are_skipped_and_different_ones_are_not() {
    let config = RunConfig::default();
    let skipped = |trace: &MemoryTrace| {
        let times = times(trace, &config, Settings::default());
        let of = |name: &str| {
            let (_, time) = times.iter().find(|(of, _)| of.name() == name).unwrap();
            time.skipped_tiles
        };
        assert_eq!(of("first-idle")[0], 0);
        of("skip-equal")
    };
    let tiles = 2 * 10 * 6;
    assert_eq!(skipped(&repeated(&trace(), 3)), [2 * tiles, 3 * tiles]);
    let [some, all] = skipped(&different_frames());
    assert!(some < all / 4, "{some} of {all}");
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let trace = different_frames();
    let config = RunConfig::default();
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.unwrap()
            .install(|| times(&trace, &config, Settings::default()))
    };
    assert!(
        with(1)
            .iter()
            .map(|(_, time)| time)
            .eq(with(3).iter().map(|(_, time)| time))
    );
}

/// Each cycle of a core has one cause, a core without a tile has no work, and a tile is in one span of each of its cores.
#[test]
fn a_timeline_accounts_for_every_cycle_and_tile() {
    let trace = different_frames();
    let config = RunConfig {
        cores: 3,
        ..RunConfig::default()
    };
    let plain = times(&trace, &config, Settings::default());
    let recorded = with_timelines(&trace, &config, Settings::default(), true);
    for ((scheduler, mut time), (_, plain)) in recorded.into_iter().zip(plain) {
        let name = scheduler.name();
        let timeline = time.timeline.take().unwrap();
        assert_eq!(time, plain, "{name}");
        let all: u64 = time.frames.iter().map(|(cycles, _)| cycles).sum();
        let of_cause = |causes: &[[u16; 9]], at: usize| -> u64 {
            causes.iter().map(|of| u64::from(of[at])).sum()
        };
        let mut no_work = 0;
        for (core, causes) in timeline.causes.iter().enumerate() {
            let full = &causes[..(all / 1024) as usize];
            assert!(full.iter().all(|of| of.iter().sum::<u16>() == 1024));
            let spans = timeline.spans.iter().filter(|span| span.core == core);
            let mut spans: Vec<&TileSpan> = spans.collect();
            spans.sort_by_key(|span| span.cycles);
            let (mut held, mut until, mut free) = (0, 0, [0; 8]);
            for span in spans {
                let [start, end] = span.cycles;
                assert!(free[span.slot] <= start, "{name} {span:?}");
                free[span.slot] = end;
                held += end.max(until) - start.max(until);
                until = until.max(end);
            }
            assert_eq!(held, all - of_cause(causes, 2), "{name}, core {core}");
            no_work += all - held;
        }
        assert_eq!(no_work, sum(&time, |of| of.cycles.no_work), "{name}");
        for at in 0..CoreCycles::NAMES.len() {
            let of_cores: u64 = timeline.causes.iter().map(|of| of_cause(of, at)).sum();
            assert_eq!(sum(&time, |of| of.cycles.list()[at]), of_cores, "{name}");
        }
        let mut tiles = std::collections::BTreeMap::new();
        for tile in timeline.spans.iter().flat_map(|span| &span.tiles) {
            *tiles.entry(*tile).or_insert(0) += 1;
        }
        let cores = if name.starts_with("quads") { 3 } else { 1 };
        let [skipped, of_trace] = time.skipped_tiles;
        assert_eq!(tiles.len() as u64, of_trace - skipped, "{name}");
        assert!(tiles.values().all(|spans| *spans == cores), "{name}");
    }
}

#[test]
fn more_instructions_and_less_bandwidth_take_longer() {
    let (trace, config) = (trace(), RunConfig::default());
    let ms = |settings| {
        let point = Point {
            scheduler: named("z2-sta"),
            settings,
            records: false,
        };
        Figures::of(&replay(&trace, &config, &[point], &|_| {}).unwrap()[0]).ms()
    };
    let usual = Settings {
        dram: DramModel::Rate,
        ..Settings::default()
    };
    let many = Settings {
        instructions: 1000.0,
        ..usual
    };
    let narrow = Settings {
        bandwidth_gb_s: Some(0.1),
        ..usual
    };
    assert!(ms(many) > 2.0 * ms(usual) && ms(narrow) > 2.0 * ms(usual));
}

#[test]
fn an_impossible_machine_is_refused_by_the_name_of_its_value() {
    let settings = Settings {
        l2_banks: 3,
        ..Settings::default()
    };
    let error = Machine::new(&RunConfig::default(), &settings).unwrap_err();
    assert_eq!(
        error.to_string(),
        "l2_banks: expected a power of two up to 256, found 3"
    );
}
