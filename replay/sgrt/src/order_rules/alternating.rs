//! With reprojection, `z2-lrta` and `z2-sta` often differ by less than consecutive frames differ by themselves. The rule
//! alternates between the two orders, and adds up the differences until one of the orders is clearly better.

use super::{Count, Counted};
use sim::config::Order;

/// The order of the first frame, which loses least where few right rays are left.
const START: Order = Order::Z2_LRTA;
/// The sum of differences at which the other order is rejected, and the one at which it replaces the current one.
const WORSE: f64 = 0.01;
const BETTER: f64 = -0.03;
/// The same for a sum whose last difference has no frame of the current order after it yet.
const CLEARLY_WORSE: f64 = 0.08;
const CLEARLY_BETTER: f64 = -0.12;
/// Most frames of the other order in a round. After them, the sign of the sum decides.
const MOST_TRIALS: u32 = 6;
/// Least frames between two rounds.
const LEAST_WAIT: usize = 8;
/// Most lines that trials cost, as a share of the lines of all frames.
const BUDGET: f64 = 1.0 / 1000.0;
/// The first frame is compared if it fetches so many times the lines of the L2, because a frame that starts with empty
/// caches fetches at most the lines of one L2 more.
const COLD_FRAME_L2S: u64 = 8;

/// A round of trials.
#[derive(Default)]
struct Round {
    /// The last frame of the current order.
    before: usize,
    trials: u32,
    /// Logarithms of the fetched lines per line read, relative to those of the current order.
    sum: f64,
    /// Lines that the trials fetched more, in frames of the current order.
    cost: f64,
}

/// The order of the next frame.
pub(super) fn choose(frames: &[Counted], l2_lines: u64) -> Order {
    let of = |frame: &Counted| {
        let mut sum = Count::default();
        frame.parts.iter().for_each(|part| sum.add(part));
        sum
    };
    let difference = |a: usize, b: usize| of(&frames[a]).over(&of(&frames[b])).ln();
    let (mut current, mut due, mut round) = (START, 1, None::<Round>);
    for at in 0..frames.len() {
        let is_current = frames[at].choice.order == current;
        if let Some(of_round) = &mut round {
            let decided = if is_current {
                let own = at - 1;
                of_round.sum += (difference(own, of_round.before) + difference(own, at)) / 2.0;
                of_round.trials += 1;
                of_round.before = at;
                let is_last = of_round.trials == MOST_TRIALS;
                decide(of_round.sum, WORSE, BETTER).or(is_last.then_some(of_round.sum < 0.0))
            } else {
                let so_far = difference(at, of_round.before);
                of_round.cost += so_far.max(0.0);
                decide(of_round.sum + so_far, CLEARLY_WORSE, CLEARLY_BETTER)
            };
            if let Some(replaces) = decided {
                let wait = (of_round.cost / BUDGET).ceil() as usize;
                due = at
                    + 1
                    + if replaces {
                        LEAST_WAIT
                    } else {
                        LEAST_WAIT.max(wait)
                    };
                current = if replaces { other(current) } else { current };
                round = None;
            }
        } else if is_current && due <= at + 1 {
            let is_cold = at == 0 && frames[0].fetched() < COLD_FRAME_L2S * l2_lines;
            round = (!is_cold).then(|| Round {
                before: at,
                ..Round::default()
            });
        }
    }
    let is_turn = |of: &Round| of.before + 1 == frames.len();
    if round.is_some_and(|of| is_turn(&of)) {
        other(current)
    } else {
        current
    }
}

fn other(order: Order) -> Order {
    if order == Order::Z2_LRTA {
        Order::Z2_STA
    } else {
        Order::Z2_LRTA
    }
}

/// Whether the other order replaces the current one; none if that is open.
fn decide(sum: f64, worse: f64, better: f64) -> Option<bool> {
    (sum > worse || sum < better).then_some(sum < better)
}

#[cfg(test)]
mod tests {
    use super::super::Choice;
    use super::*;

    const FRAMES: usize = 300;

    /// Orders of frames in which an order fetches so many of 100,000 lines, times what the frame itself adds. Also returns
    /// the lines that are fetched more than in the better order, in frames.
    fn play(lrta: u64, sta: u64, noise: impl Fn(usize) -> f64) -> (Vec<Order>, f64) {
        let mut known: Vec<Counted> = Vec::new();
        for at in 0..FRAMES {
            let order = choose(&known, 1);
            let lines = if order == Order::Z2_LRTA { lrta } else { sta };
            let mut frame = Counted {
                choice: Choice::whole(order),
                parts: Default::default(),
            };
            frame.parts[0] = Count {
                read: 100_000,
                fetched: (lines as f64 * noise(at)) as u64,
            };
            known.push(frame);
        }
        let least = lrta.min(sta) as f64;
        let orders: Vec<Order> = known.iter().map(|of| of.choice.order).collect();
        let lines = |order: &Order| if *order == Order::Z2_LRTA { lrta } else { sta };
        let more = orders.iter().map(|of| lines(of) as f64 / least - 1.0).sum();
        (orders, more)
    }

    /// Repeats every seven frames, with a mean of 1 and a standard deviation of 2 %.
    fn uneven(at: usize) -> f64 {
        1.0 + [0.03, -0.02, 0.01, -0.03, 0.02, 0.0, -0.01][at % 7]
    }

    #[test]
    fn the_better_order_is_found_although_frames_differ() {
        for (lrta, sta) in [
            (40_000, 44_000),
            (44_000, 40_000),
            (40_000, 41_500),
            (41_500, 40_000),
        ] {
            let better = if lrta < sta {
                Order::Z2_LRTA
            } else {
                Order::Z2_STA
            };
            for (name, noise) in [
                ("even", &(|_| 1.0) as &dyn Fn(usize) -> f64),
                ("uneven", &uneven),
            ] {
                let (orders, more) = play(lrta, sta, noise);
                let found = orders.iter().filter(|of| **of == better).count();
                assert!(found > FRAMES * 9 / 10, "{name} {lrta} {sta}: {found}");
                assert!(
                    more < 0.01 * FRAMES as f64 / 2.0,
                    "{name} {lrta} {sta}: {more}"
                );
            }
        }
    }

    #[test]
    fn trials_of_a_worse_order_keep_their_budget() {
        for worse in [40_500, 42_000, 50_000, 80_000] {
            let (orders, more) = play(40_000, worse, |_| 1.0);
            assert_eq!(orders[..2], [Order::Z2_LRTA, Order::Z2_STA], "{worse}");
            // The first round has no limit.
            let first = worse as f64 / 40_000.0 - 1.0;
            assert!(
                more <= 2.0 * first + 2.0 * BUDGET * FRAMES as f64,
                "{worse}: {more}"
            );
        }
    }

    #[test]
    fn a_first_frame_that_may_owe_its_lines_to_empty_caches_is_not_compared() {
        let first = Counted {
            choice: Choice::whole(START),
            parts: [Count {
                read: 100,
                fetched: 30,
            }; 3],
        };
        assert_eq!(choose(&[first], 11), Order::Z2_STA);
        assert_eq!(choose(&[first], 12), Order::Z2_LRTA);
        assert_eq!(choose(&[first; 2], 12), Order::Z2_STA);
    }
}
