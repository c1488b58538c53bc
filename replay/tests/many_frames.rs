//! Measures the memory of long traces.
//! `FRAMES=300 cargo test --release -p replay --test many_frames -- --nocapture` also prints the time per
//! frame; `TEXTRACE` names a trace whose first frame is repeated.

use formats::textrace::{Pass, Tables, Textrace, TextraceWriter, Tile};
use formats::view::FrameViews;
use replay::config::{LevelConfig, Levels, Mode, Order, RunConfig, TmuModel};
use replay::engine::replay_all;
use replay::stream::testing::Synthetic;
use replay::stream::{LineMemory, TileSource};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Writes the first frame of a trace `frames` times, with its views.
fn write(source: &dyn TileSource, frames: u32, path: &Path) {
    let old = source.tables();
    let first = old.passes.iter().map(|pass| pass.frame).min().unwrap();
    let of_frame = (0..)
        .zip(&old.passes)
        .filter(|(_, pass)| pass.frame == first);
    let of_frame: Vec<(u32, &Pass)> = of_frame.collect();
    let mut tables = Tables {
        passes: Vec::new(),
        ..old.clone()
    };
    let views = old.meta.frames[first as usize].clone();
    let view = |frame| FrameViews {
        frame,
        ..views.clone()
    };
    tables.meta.frames = (0..frames).map(view).collect();
    for frame in 0..frames {
        let again = of_frame.iter().map(|(_, pass)| Pass { frame, ..**pass });
        tables.passes.extend(again);
    }
    let mut writer = TextraceWriter::create(path, &tables).unwrap();
    let mut tile = Tile::default();
    for frame in 0..frames as usize {
        for (number, (pass, info)) in of_frame.iter().enumerate() {
            for index in 0..info.tile_count() {
                source.read_tile(*pass, index, &mut tile).unwrap();
                let to = frame * of_frame.len() + number;
                writer.write_tile(to, index as usize, &tile).unwrap();
            }
        }
    }
    writer.finish().unwrap();
}

/// Memory of this process without mapped files, in bytes; `None` if the system does not report it.
fn own_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("RssAnon:"))?;
    let kib: u64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kib << 10)
}

/// Time of `work` in seconds, and the peak memory during it.
fn watched(work: impl FnOnce()) -> (f64, u64) {
    let done = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let watch = scope.spawn(|| {
            let mut most = 0;
            while !done.load(Ordering::Relaxed) {
                most = most.max(own_bytes().unwrap_or(0));
                std::thread::sleep(Duration::from_millis(5));
            }
            most
        });
        let start = Instant::now();
        work();
        let seconds = start.elapsed().as_secs_f64();
        done.store(true, Ordering::Relaxed);
        (seconds, watch.join().unwrap())
    })
}

#[test]
fn memory_does_not_grow_with_the_number_of_frames() {
    let asked: Option<u32> = (std::env::var("FRAMES").ok()).map(|frames| frames.parse().unwrap());
    let frames = asked.unwrap_or(40);
    let given = std::env::var_os("TEXTRACE").map(|path| Textrace::open(Path::new(&path)).unwrap());
    let size_px = asked.map_or([160, 192], |_| [480, 540]);
    let generated = Synthetic::one_layer(size_px, 120);
    let source: Box<dyn TileSource> = match given {
        Some(trace) => Box::new(trace),
        None => Box::new(generated.generate()),
    };
    let folder = tempfile::tempdir().unwrap();
    let [short, long] = [frames / 10, frames].map(|frames| {
        let path = folder.path().join(format!("{frames}.textrace"));
        write(&*source, frames, &path);
        (frames, Textrace::open(&path).unwrap())
    });
    drop(source);
    let first_miss = |mut config: RunConfig| {
        config.tmu.model = TmuModel::FirstMiss;
        config
    };
    let config = |mode, l1_kib: u64| RunConfig {
        mode,
        order: Order::Z2_STA,
        level: Levels::two(LevelConfig::lru(l1_kib << 10), LevelConfig::lru(128 << 10)),
        ..RunConfig::default()
    };
    let batches: [(&str, Vec<RunConfig>); 5] = [
        ("functional", vec![config(Mode::Functional, 8)]),
        ("timed", vec![config(Mode::Timed, 8)]),
        ("first miss", vec![first_miss(config(Mode::Timed, 8))]),
        ("both, three caches each", {
            let modes = [Mode::Functional, Mode::Timed];
            let all = modes
                .into_iter()
                .flat_map(|m| [8, 16, 32].map(|kib| config(m, kib)));
            all.collect()
        }),
        ("functional, two line sizes", {
            let lines = [16, 64].map(|line_bytes| RunConfig {
                line_bytes,
                ..config(Mode::Functional, 8)
            });
            lines.to_vec()
        }),
    ];
    for (name, configs) in batches {
        let run = |(frames, trace): &(u32, Textrace)| {
            let memory = LineMemory::new(LineMemory::USUAL_BYTES);
            let (seconds, bytes) = watched(|| {
                replay_all(trace, &configs, &memory, &|_, _| {}).unwrap();
            });
            (1e3 * seconds / f64::from(*frames), bytes)
        };
        let ((short_ms, short_bytes), (long_ms, long_bytes)) = (run(&short), run(&long));
        println!(
            "{name}: {} frames {short_ms:.1} ms each, {} MB; {} frames {long_ms:.1} ms each, {} MB",
            short.0,
            short_bytes / 1_000_000,
            long.0,
            long_bytes / 1_000_000
        );
        // The line lists of one frame take about 250 kB, so 36 of them would be detected.
        let most = if asked.is_some() {
            2 * short_bytes + 256_000_000
        } else {
            short_bytes + short_bytes / 4 + 4_000_000
        };
        assert!(
            long_bytes <= most,
            "{name}: {} frames take {short_bytes} bytes, {} take {long_bytes}",
            short.0,
            long.0
        );
        // Times are only meaningful on an otherwise idle machine.
        let grows = asked.is_some() && long_ms > 1.5 * short_ms;
        assert!(!grows, "{short_ms} ms, then {long_ms} ms");
    }
}
