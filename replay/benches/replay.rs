//! Replay speed on a generated stereo frame: footprints per second by mode and order.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use replay::config::{Mode, Order, RunConfig};
use replay::engine::synthetic::Synthetic;

fn replay_modes(criterion: &mut Criterion) {
    let trace = Synthetic {
        size_px: [480, 540],
        ..Synthetic::default()
    }
    .generate();
    let mut group = criterion.benchmark_group("replay");
    group.sample_size(10);
    for mode in [Mode::Functional, Mode::Timed] {
        for order in [Order::MORTON, Order::Z2_STA] {
            let config = RunConfig {
                mode,
                order,
                ..RunConfig::default()
            };
            let run =
                || replay::engine::replay(&trace, &config).expect("a generated trace replays");
            group.throughput(Throughput::Elements(run().footprints));
            group.bench_function(format!("{mode:?} {}", order.name()), |bencher| {
                bencher.iter(run)
            });
        }
    }
    group.finish();
}

criterion_group!(benches, replay_modes);
criterion_main!(benches);
