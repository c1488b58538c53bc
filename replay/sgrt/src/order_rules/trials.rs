//! Tries other orders and keeps the one that fetches least. Consecutive frames often differ by more than orders do, so
//! frames of both orders alternate, and the differences are added up until one order is clearly better.

use super::{Choice, Count, Counted, RuleRow, Setting};
use sim::config::Order;

/// The first order of sequences that trace both eyes in full: where the eyes share much, a frame in another order costs most.
const START: Order = Order::Z2_STA;
/// The same with reprojection. This order loses least where few right rays are left.
const START_REPROJECTED: Order = Order::Z2_LRTA;
/// The sum of differences above which the other order is rejected, and the one below which it replaces the current one.
const WORSE: f64 = 0.01;
const BETTER: f64 = -0.03;
/// The same as `WORSE` for a sum whose last difference has no frame of the current order after it yet.
const CLEARLY_WORSE: f64 = 0.03;
/// Whole frames of the other order in a round. After them, the sign of the sum decides.
const MOST_TRIALS: u32 = 3;
/// A whole frame is traced in a new order whose sampled pairs fetch at most so much more (logarithm). An order that was
/// compared before needs a sample that fetches no more.
const LARGEST_RISK: f64 = 0.05;
/// Least frames between two rounds, and before the first one with `morton`, which loses much where the eyes share much.
const LEAST_WAIT: usize = 10;
const FIRST_MORTON: usize = 14;
/// Most lines that a trial costs if it ends with its first frame, as a share of the lines since the last trial of that
/// order.
const BUDGET: f64 = 1.0 / 1600.0;
/// The first frame is compared if it fetches so many times the lines of the L2, because a frame that starts with empty
/// caches fetches at most the lines of one L2 more.
const COLD_FRAME_L2S: u64 = 2;

pub(super) const ROW: RuleRow = RuleRow {
    name: "trials",
    help: "morton, z2-lrta or z2-sta: the one that fetches least when it is tried; morton for frames that fit into the L2",
    choose,
};

/// A round of trials of another order.
struct Round {
    other: Order,
    largest_risk: f64,
    /// The frames so far that have the other order, whole or in the sample.
    trials: Vec<usize>,
}

/// The result of a round.
struct Decided {
    replaces: bool,
    /// Lines that the trials fetched more, in frames of the current order. A sample counts like a whole frame.
    cost: f64,
}

fn choose(frames: &[Counted], setting: &Setting) -> Choice {
    let start = if setting.reprojects {
        START_REPROJECTED
    } else {
        START
    };
    let is_small = |of: &Counted| of.fetched() <= setting.l2_lines;
    // The first frame in which an order may be tried. With both eyes in full, `morton` is hardly better in large frames.
    let mut due = vec![(Order::Z2_LRTA, 1), (Order::Z2_STA, 1)];
    if setting.reprojects {
        due.push((Order::MORTON, FIRST_MORTON));
    }
    let mut compared: Vec<Order> = Vec::new();
    let (mut current, mut round) = (start, None::<Round>);
    for (at, frame) in frames.iter().enumerate() {
        if is_small(frame) {
            round = None;
            continue;
        }
        let tried = frame.choice.sampled.unwrap_or(frame.choice.order);
        let is_trial = tried != current;
        if let Some(of_round) = &mut round {
            if is_trial {
                of_round.trials.push(at);
            }
            if let Some(decided) = decide(&frames[..=at], current, of_round, is_trial) {
                compared.extend([current, of_round.other]);
                // The next round starts with a sample, and most rounds end with it.
                let share = if setting.reprojects {
                    1.0
                } else {
                    Counted::SAMPLE_SHARE
                };
                let wait = LEAST_WAIT.max((decided.cost * share / BUDGET).ceil() as usize);
                for (order, first) in &mut due {
                    let least = if decided.replaces {
                        LEAST_WAIT
                    } else if *order == of_round.other {
                        wait
                    } else {
                        0
                    };
                    *first = (*first).max(at + 1 + least);
                }
                current = if decided.replaces {
                    of_round.other
                } else {
                    current
                };
                round = None;
            }
        }
        let is_cold = at == 0 && frame.fetched() < COLD_FRAME_L2S * setting.l2_lines;
        if round.is_none() && frame.choice == Choice::whole(current) && !is_cold {
            let others = due
                .iter()
                .filter(|(order, first)| *order != current && *first <= at + 1);
            round = others
                .min_by_key(|(_, first)| *first)
                .map(|(other, _)| Round {
                    other: *other,
                    largest_risk: if compared.contains(other) {
                        0.0
                    } else {
                        LARGEST_RISK
                    },
                    trials: Vec::new(),
                });
        }
    }
    // The L2 keeps most lines of a small frame until the next frame, and neighbours on the curve matter more than the
    // other eye.
    if frames.last().is_some_and(is_small) {
        return Choice::whole(Order::MORTON);
    }
    match round {
        Some(of) if of.trials.is_empty() && !setting.reprojects => Choice {
            order: current,
            sampled: Some(of.other),
        },
        Some(of) if frames.last().map(|last| last.choice.order) == Some(current) => {
            Choice::whole(of.other)
        }
        _ => Choice::whole(current),
    }
}

/// Whether the round's order replaces the current one; none if that is open.
fn decide(known: &[Counted], current: Order, round: &Round, is_trial: bool) -> Option<Decided> {
    let (mut sum, mut trials, mut cost) = (0.0, 0, 0.0_f64);
    let mut is_risky = false;
    for at in &round.trials {
        let more = difference(known, *at, current);
        if known[*at].choice.sampled.is_some() {
            is_risky = more > round.largest_risk;
            cost += more.max(0.0);
        } else {
            sum += more;
            trials += 1;
        }
    }
    let worse = if is_trial { CLEARLY_WORSE } else { WORSE };
    let replaces = if trials == 0 {
        is_risky.then_some(false)
    } else if sum > worse || sum < BETTER {
        Some(sum < BETTER)
    } else {
        (!is_trial && trials == MOST_TRIALS).then_some(sum < 0.0)
    };
    replaces.map(|replaces| Decided {
        replaces,
        cost: cost + sum.max(0.0),
    })
}

/// The logarithm of the lines that a trial fetches per line read, relative to the mean of the nearest frames before and
/// after it in the current order. A trial in a sample is compared with the same pairs.
fn difference(known: &[Counted], at: usize, current: Order) -> f64 {
    let is_sampled = known[at].choice.sampled.is_some();
    let of = |frame: &Counted| {
        let mut sum = Count::default();
        let parts = if is_sampled { 1 } else { frame.parts.len() };
        frame.parts[..parts].iter().for_each(|part| sum.add(part));
        sum
    };
    let is_plain = |frame: &&Counted| frame.choice == Choice::whole(current);
    let before = known[..at].iter().rfind(is_plain);
    let after = known[at + 1..].iter().find(is_plain);
    let differences = before.into_iter().chain(after);
    let (sum, count) = differences.fold((0.0, 0), |(sum, count), plain| {
        (sum + of(&known[at]).over(&of(plain)).ln(), count + 1)
    });
    sum / f64::from(count.max(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAMES: usize = 400;
    const ORDERS: [Order; 3] = [Order::MORTON, Order::Z2_LRTA, Order::Z2_STA];

    /// Frames in which an order fetches so many of 1000 lines, times what the frame itself adds. Returns the orders, and
    /// the lines that are fetched of 1000 in the mean.
    fn play(
        setting: Setting,
        fetched: [u64; 3],
        noise: impl Fn(usize) -> f64,
    ) -> (Vec<Choice>, f64) {
        let of = |order: Order| fetched[ORDERS.iter().position(|of| *of == order).unwrap()];
        let mut known: Vec<Counted> = Vec::new();
        for at in 0..FRAMES {
            let choice = choose(&known, &setting);
            assert_eq!(choice, choose(&known, &setting));
            let part = |order: Order, quarters: u64| Count {
                read: 1_000_000 * quarters,
                fetched: (1000.0 * (quarters * of(order)) as f64 * noise(at)) as u64,
            };
            let sampled = choice.sampled.unwrap_or(choice.order);
            known.push(Counted {
                choice,
                parts: [part(sampled, 1), part(choice.order, 3)],
            });
        }
        let lines: u64 = known.iter().map(Counted::fetched).sum();
        let choices = known.iter().map(|of| of.choice).collect();
        (choices, lines as f64 / (4000 * FRAMES) as f64)
    }

    const FULL: Setting = Setting {
        l2_lines: 16,
        reprojects: false,
    };
    const REPROJECTED: Setting = Setting {
        reprojects: true,
        ..FULL
    };

    /// Repeats every seven frames, with a mean of 1 and a standard deviation of 2 %.
    fn uneven(at: usize) -> f64 {
        1.0 + [0.03, -0.02, 0.01, -0.03, 0.02, 0.0, -0.01][at % 7]
    }

    #[test]
    fn all_frames_together_fetch_hardly_more_than_the_best_order() {
        let levels = [500, 503, 530, 600, 1000];
        for setting in [FULL, REPROJECTED] {
            for (morton, lrta) in levels.into_iter().flat_map(|a| levels.map(|b| (a, b))) {
                for sta in levels {
                    let (_, lines) = play(setting, [morton, lrta, sta], |_| 1.0);
                    // With both eyes in full, Morton is tried in small frames only.
                    let least = if setting.reprojects { morton } else { lrta };
                    let least = least.min(lrta).min(sta);
                    // The first frame and the first trials of both other orders have no limit. A better order may take -3 % to be seen.
                    let dearest = morton.max(lrta).max(sta);
                    let waits = (FIRST_MORTON + 2 * LEAST_WAIT) as u64;
                    let late = if setting.reprojects {
                        waits * (lrta.min(sta) - least)
                    } else {
                        0
                    };
                    let start = (3 * (dearest - least) + late) as f64 + 0.03 * least as f64;
                    let most = least as f64 * (1.0 + 2.0 * BUDGET) + start / FRAMES as f64 + 0.5;
                    assert!(
                        lines <= most,
                        "{setting:?} {morton} {lrta} {sta}: {lines} {most}"
                    );
                }
            }
        }
    }

    #[test]
    fn the_better_order_is_found_although_frames_differ() {
        for setting in [FULL, REPROJECTED] {
            for (lrta, sta) in [(400, 440), (440, 400), (400, 415), (415, 400)] {
                let better = if lrta < sta {
                    Order::Z2_LRTA
                } else {
                    Order::Z2_STA
                };
                let (choices, _) = play(setting, [480, lrta, sta], uneven);
                let found = choices.iter().filter(|of| of.order == better).count();
                assert!(found > FRAMES * 4 / 5, "{setting:?} {lrta} {sta}: {found}");
            }
        }
    }

    #[test]
    fn an_order_with_bad_samples_never_has_a_whole_frame() {
        for worse in [530, 600, 1000] {
            let (choices, _) = play(FULL, [1000, worse, 500], |_| 1.0);
            assert!(choices.iter().all(|of| of.order == START));
            let trials = choices.iter().filter(|of| of.sampled.is_some()).count();
            assert!((2..FRAMES / 20).contains(&trials), "{worse}: {trials}");
        }
    }

    #[test]
    fn frames_that_fit_into_the_l2_have_morton_order() {
        for setting in [FULL, REPROJECTED] {
            let large = Setting {
                l2_lines: 4_000_000,
                ..setting
            };
            let (choices, _) = play(large, [900, 500, 500], uneven);
            assert!(
                choices[1..]
                    .iter()
                    .all(|of| *of == Choice::whole(Order::MORTON))
            );
        }
    }

    #[test]
    fn a_first_frame_that_may_owe_its_lines_to_empty_caches_is_not_compared() {
        let first = Counted {
            choice: Choice::whole(START_REPROJECTED),
            parts: [Count {
                read: 100,
                fetched: 20,
            }; 2],
        };
        let next = |frames: &[Counted], l2_lines| {
            choose(
                frames,
                &Setting {
                    l2_lines,
                    ..REPROJECTED
                },
            )
            .order
        };
        assert_eq!(next(&[first], 20), Order::Z2_STA);
        assert_eq!(next(&[first], 21), Order::Z2_LRTA);
        assert_eq!(next(&[first; 2], 21), Order::Z2_STA);
    }
}
