//! Tries other orders, at first on few pairs of tiles, and keeps the order that fetches least. The next trials wait until
//! the lines that the last ones cost are few beside those of the frames between. With reprojection, [`alternating`] chooses.

use super::{Choice, Count, Counted, RuleRow, Setting, alternating};
use sim::config::Order;
use std::ops::Range;

/// Orders in which they are tried. The first wins if several fetch equally.
const CHOICES: [Order; 3] = [Order::MORTON, Order::Z2_LRTA, Order::Z2_STA];
/// The order of the first frame.
const START: Order = Order::Z2_STA;
/// Most lines that trials cost, as a share of the lines of all frames.
const BUDGET: f64 = 1.0 / 400.0;
/// Least frames between two rounds of trials.
const LEAST_WAIT: usize = 4;
/// A whole frame is traced in an order whose sampled pairs fetch at most so many times the lines of the current order.
const LARGEST_RISK: f64 = 1.05;
/// With a smaller difference, the frame after a trial is compared as well, because frames differ by themselves.
const CLEAR: f64 = 0.02;

pub(super) const ROW: RuleRow = RuleRow {
    name: "trials",
    help: "morton, z2-lrta or z2-sta: the one that fetches least when it is tried, first on two quarters of the pairs of tiles; \
           with reprojection z2-lrta or z2-sta",
    choose,
};

/// The end of a round of trials.
struct Settled {
    order: Order,
    /// Lines that the trials fetched more than the current order would have, in frames of that order.
    cost: f64,
}

fn choose(frames: &[Counted], setting: &Setting) -> Choice {
    let l2_lines = setting.l2_lines;
    if setting.reprojects {
        return Choice::whole(alternating::choose(frames, l2_lines));
    }
    let mut rest = frames;
    while !rest.is_empty() {
        let mut next = Choice::whole(START);
        let settled = (1..=rest.len()).find_map(|known| match trial(&rest[..known], l2_lines) {
            Ok(settled) => Some((known, settled)),
            Err(choice) => {
                next = choice;
                None
            }
        });
        let Some((known, Settled { order, cost })) = settled else {
            return next;
        };
        // The last frame that waits is the first one of the next round.
        let wait = LEAST_WAIT.max((cost / BUDGET).ceil() as usize);
        match rest.get(known + wait - 1..) {
            Some(following) if !following.is_empty() => rest = following,
            _ => return Choice::whole(order),
        }
    }
    Choice::whole(START)
}

/// The next trial of a round, whose first frame has the current order alone.
fn trial(frames: &[Counted], l2_lines: u64) -> Result<Settled, Choice> {
    let current = frames[0].choice.order;
    let now = frames.iter().rfind(|of| of.choice.order == current);
    let now = now.unwrap_or(&frames[0]);
    // Then the L2 keeps most of a frame's lines until the next frame, and neighbours on the curve matter more than the
    // other eye. Otherwise, `morton` is hardly better than `z2-lrta`, and often much worse.
    let is_small = now.fetched() <= l2_lines;
    let (mut best, mut least, mut cost) = (current, 1.0, 0.0);
    'orders: for order in CHOICES.into_iter().filter(|order| *order != current) {
        if order == Order::MORTON && !is_small {
            continue;
        }
        let mut sum = 0.0;
        for sample in 0..if is_small { 0 } else { Counted::SAMPLES } {
            let trial = Choice {
                order: current,
                sampled: Some((sample, order)),
            };
            let Some(at) = frames.iter().position(|of| of.choice == trial) else {
                return Err(trial);
            };
            let (ratio, has_after) = ratio(frames, at, sample..sample + 1);
            sum += ratio;
            cost += (ratio - 1.0).max(0.0) * Counted::SAMPLE_SHARE;
            let largest = if has_after { LARGEST_RISK } else { 1.0 };
            if sum / (sample + 1) as f64 > largest {
                if has_after {
                    continue 'orders;
                }
                return Err(Choice::whole(current));
            }
        }
        let Some(at) = frames.iter().position(|of| of.choice.order == order) else {
            return Err(Choice::whole(order));
        };
        let (ratio, has_after) = ratio(frames, at, 0..Counted::SAMPLES + 1);
        if (ratio - 1.0).abs() < CLEAR && !has_after {
            return Err(Choice::whole(current));
        }
        cost += (ratio - 1.0).max(0.0);
        if ratio < least {
            (best, least) = (order, ratio);
        }
    }
    Ok(Settled { order: best, cost })
}

/// The lines of some parts of the frame `at` relative to those of the last frames before without a trial in them, or to the
/// mean with the first ones after, if there are any (then true). Frames differ by themselves, most of all in few pairs.
fn ratio(frames: &[Counted], at: usize, parts: Range<usize>) -> (f64, bool) {
    let current = frames[0].choice.order;
    let is_plain = |of: &Counted, part: usize| {
        let sample = of.choice.sampled.map(|(sample, _)| sample);
        of.choice.order == current && sample != Some(part)
    };
    let sum = |frame_of: &dyn Fn(usize) -> Option<usize>| {
        let mut sum = Count::default();
        for part in parts.clone() {
            sum.add(&frames[frame_of(part)?].parts[part]);
        }
        Some(sum)
    };
    let own = sum(&|_| Some(at)).unwrap_or_default();
    let earlier = |part| {
        frames[..at]
            .iter()
            .rposition(|of| is_plain(of, part))
            .or(Some(0))
    };
    let later = |part| (at..frames.len()).find(|number| is_plain(&frames[*number], part));
    let before = own.over(&sum(&earlier).unwrap_or_default());
    match sum(&later) {
        Some(after) => (2.0 / (1.0 / before + 1.0 / own.over(&after)), true),
        None => (before, false),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAMES: usize = 400;

    /// Frames in which only the order decides how many of 1000 lines are fetched (of each of [`CHOICES`]). Returns the
    /// order of each frame, and the lines that are fetched of 1000 in the mean.
    fn play(l2_lines: u64, fetched: [u64; 3]) -> (Vec<Choice>, f64) {
        let of = |order: Order| fetched[CHOICES.iter().position(|of| *of == order).unwrap()];
        let setting = Setting {
            l2_lines,
            reprojects: false,
        };
        let mut known: Vec<Counted> = Vec::new();
        for _ in 0..FRAMES {
            let choice = choose(&known, &setting);
            assert_eq!(choice, choose(&known, &setting));
            let part = |part, quarters| {
                let tried = choice.sampled.filter(|(sample, _)| *sample == part);
                Count {
                    read: 1000 * quarters,
                    fetched: quarters * of(tried.map_or(choice.order, |(_, order)| order)),
                }
            };
            known.push(Counted {
                choice,
                parts: [part(0, 1), part(1, 1), part(2, 2)],
            });
        }
        let lines: u64 = known.iter().map(Counted::fetched).sum();
        let choices = known.iter().map(|of| of.choice).collect();
        (choices, lines as f64 / (4 * FRAMES) as f64)
    }

    #[test]
    fn all_frames_together_fetch_hardly_more_than_the_best_order() {
        let levels = [500, 503, 530, 600, 1000];
        for (morton, lrta) in levels.into_iter().flat_map(|a| levels.map(|b| (a, b))) {
            for (sta, l2_lines) in levels
                .into_iter()
                .flat_map(|sta| [(sta, 16), (sta, 1 << 20)])
            {
                let (_, lines) = play(l2_lines, [morton, lrta, sta]);
                // Small frames may use Morton order.
                let least = if l2_lines > 16 {
                    morton.min(lrta)
                } else {
                    lrta
                }
                .min(sta);
                // The start and the first trials have no limit.
                let start = 4.0 * (1000.0 - least as f64) / FRAMES as f64;
                let most = least as f64 * (1.0 + BUDGET) + start;
                assert!(lines <= most, "{morton} {lrta} {sta} {l2_lines}: {lines}");
            }
        }
    }

    /// However bad the other order is, and although trials never end.
    #[test]
    fn trials_of_bad_orders_keep_their_budget() {
        for worse in [501, 505, 524, 526, 600, 1000] {
            let (choices, lines) = play(16, [1000, worse, 500]);
            assert!(choices.iter().all(|of| of.order == START || worse < 526));
            let trials = choices.iter().filter(|of| of.sampled.is_some()).count();
            assert!(
                trials > FRAMES / 200 && choices[FRAMES - 1].order == START,
                "{worse}"
            );
            // The last round may have waited for less than its share.
            let last_round = 500.0 * 0.05 + (worse as f64 - 500.0) / 2.0;
            let most = 500.0 * (1.0 + BUDGET) + last_round / FRAMES as f64;
            assert!(lines <= most, "{worse}: {lines}");
        }
    }
}
