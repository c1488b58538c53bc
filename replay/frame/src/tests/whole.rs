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
    let point = |scheduler| Point {
        scheduler,
        settings,
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

#[test]
fn more_instructions_and_less_bandwidth_take_longer() {
    let (trace, config) = (trace(), RunConfig::default());
    let ms = |settings| {
        let point = Point {
            scheduler: named("z2-sta"),
            settings,
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
