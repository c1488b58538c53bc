//! dev only
use replay::config::*;
use replay::engine::{replay, synthetic::Synthetic};
fn main() {
    let t = Synthetic::default().generate();
    for mode in [Mode::Functional, Mode::Timed] {
        for order in [
            OrderKind::Morton,
            OrderKind::Z2Lrta,
            OrderKind::Z2Sta,
            OrderKind::Random,
        ] {
            let c = RunConfig {
                order,
                mode,
                ..RunConfig::default()
            };
            let s = std::time::Instant::now();
            let r = replay(&t, &c).unwrap();
            let e = s.elapsed().as_secs_f64();
            println!(
                "{:?} {:12} {:.1} M fp/s fp {} m1 {:.4} m2 {:.4} bytes {} unique {} hash {} u {:?} cf {:.4}",
                mode,
                order.name(),
                r.footprints as f64 / e / 1e6,
                r.footprints,
                r.l1.miss_rate,
                r.l2.miss_rate,
                r.external_bytes,
                r.unique_lines * 16,
                r.access_hash,
                r.tmu.map(|t| t.utilization),
                replay::tmu::closed_form(r.l1.miss_rate, r.l2.miss_rate)
            );
        }
    }
}
