//! Replay speed on a generated stereo frame, in footprints per second: quads to lines alone, and
//! the whole replay by mode and order.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use replay::config::{Mode, Order, RunConfig};
use replay::engine::replay;
use replay::stream::synthetic::Synthetic;
use replay::stream::{Expander, LineMemory, MemoryTrace, TraceCounts};

/// Distinct lines of the trace, without caches.
fn lines(trace: &MemoryTrace, config: &RunConfig) -> u64 {
    let expander = Expander::new(trace, config).expect("a generated trace expands");
    let memory = LineMemory::new(LineMemory::USUAL_BYTES);
    let mut counts = TraceCounts::new(expander.bins());
    let frame = expander.frame(0, &memory, &mut counts);
    assert!(frame.is_ok());
    counts.unique_lines
}

fn replay_modes(criterion: &mut Criterion) {
    let trace = Synthetic {
        size_px: [480, 540],
        ..Synthetic::default()
    }
    .generate();
    let mut group = criterion.benchmark_group("replay");
    group.sample_size(10);
    for order in [Order::MORTON, Order::Z2_STA] {
        let config = |mode| RunConfig {
            mode,
            order,
            ..RunConfig::default()
        };
        let [functional, timed] = [Mode::Functional, Mode::Timed].map(config);
        let run = |config| replay(&trace, config).expect("a generated trace replays");
        group.throughput(Throughput::Elements(run(&functional).footprints));
        group.bench_function(format!("lines {}", order.name()), |bencher| {
            bencher.iter(|| lines(&trace, &functional));
        });
        for config in [&functional, &timed] {
            let name = format!("{:?} {}", config.mode, order.name());
            group.bench_function(name, |bencher| bencher.iter(|| run(config)));
        }
    }
    group.finish();
}

criterion_group!(benches, replay_modes);
criterion_main!(benches);
