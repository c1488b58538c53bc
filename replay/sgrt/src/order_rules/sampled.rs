//! Replays the recorded sets of the L2 in each order, and takes the order with fewest misses.

use super::super::cache::lru;
use super::super::config::SgrtConfig;
use super::{LastFrame, RuleRow};
use sim::config::Order;
use sim::order::rays::tiles_of;

/// The orders to choose from. The first wins if several miss equally.
const CHOICES: [Order; 3] = [Order::MORTON, Order::Z2_LRTA, Order::Z2_STA];

/// Sets that are recorded, if the L2 has so many times the largest stride.
const SETS: u64 = 16;
const LARGEST_STRIDE: u64 = 64;

pub(super) const ROW: RuleRow = RuleRow {
    name: "sampled",
    help: "morton, z2-lrta or z2-sta: the one that misses least in sampled sets of the L2, replayed from the last frame",
    stride,
    choose,
};

fn stride(config: &SgrtConfig) -> u32 {
    let c = &config.cache;
    let sets = c.l2_bytes / (c.line_bytes * u64::from(c.l2_ways));
    (sets / SETS).clamp(1, LARGEST_STRIDE) as u32
}

fn choose(last: &LastFrame<'_>) -> Order {
    let misses = |order: &Order| {
        let c = &last.config.cache;
        let mut l2 = lru(c.l2_bytes, c.l2_ways, c.line_bytes);
        let plan = (last.plan)(*order);
        let mut replay = || {
            let mut misses = 0;
            for batch in plan.batches() {
                let lists: Vec<_> = tiles_of(batch).map(|at| last.recorded.of(at)).collect();
                let pixels =
                    |list: &&[(u16, u32)]| list.last().map_or(0, |last| last.0 as usize + 1);
                let pixels: Vec<usize> = lists.iter().map(pixels).collect();
                let mut next = vec![0; lists.len()];
                for turn in plan.turns(batch, &pixels) {
                    let rest = &lists[turn.tile][next[turn.tile]..];
                    let own = rest.iter().take_while(|of| of.0 as usize == turn.pixel);
                    for (_, line) in own {
                        next[turn.tile] += 1;
                        misses += u64::from(!l2.access(*line));
                    }
                }
            }
            misses
        };
        // With lines of the frame before, the second replay counts.
        let cold = replay();
        if last.keeps_lines { replay() } else { cold }
    };
    let chosen = CHOICES.iter().min_by_key(|order| misses(order));
    chosen.copied().unwrap_or(Order::MORTON)
}

#[cfg(test)]
mod tests {
    use super::super::Recorded;
    use super::*;
    use crate::testing::{View, frame};
    use sim::order::rays::RayPlan;
    use sim::order::{PlanInputs, TileRef};

    /// The first pixel of each tile reads `lines(eye, tile)`.
    fn chosen(lines: impl Fn(u32, u32) -> Vec<u32>) -> Order {
        let tables = frame(&[], View::default()).tables;
        let mut config = SgrtConfig::default();
        // Four sets of four lines: all are recorded.
        (config.cache.l2_bytes, config.cache.l2_ways) = (1024, 4);
        let mut recorded = Recorded::new(stride(&config), &tables);
        for (pass, tile) in (0..2).flat_map(|pass| (0..15).map(move |tile| (pass, tile))) {
            for line in lines(pass, tile) {
                recorded.add(TileRef { pass, tile }, 0, line);
            }
        }
        choose(&LastFrame {
            recorded: &recorded,
            tables: &tables,
            config: &config,
            keeps_lines: false,
            plan: &|order| RayPlan::new(order, &PlanInputs::default(), &tables, 0),
        })
    }

    #[test]
    fn lines_that_both_eyes_share_favour_pairs_and_lines_of_one_eye_do_not() {
        let shared = chosen(|_, tile| (tile * 8..tile * 8 + 8).collect());
        assert_eq!(shared, Order::Z2_LRTA);
        // Each eye reads nine lines again and again: pairs of tiles need more than the L2 holds.
        let own = chosen(|pass, _| (pass * 9..pass * 9 + 9).collect());
        assert_eq!(own, Order::MORTON);
    }
}
