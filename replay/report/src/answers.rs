//! The sentences at the top of pages and of texts for a terminal, computed from the figures.

mod replays;

pub use replays::{
    MACHINE, Sampled, Scheme, Traffic, hardware, machine, replayed, sampled, schemes,
};

use super::html::{change, count, list};
use super::lists::{geometric_mean, mean};
use sim::config::Order;
use studies::techniques::{LEAST_SAMPLES, Spread};

/// Least and largest of named values; `None` if there are none.
fn ends<T>(rows: &[T], value: impl Fn(&T) -> f64) -> Option<(&T, &T)> {
    let least = rows.iter().min_by(|a, b| value(a).total_cmp(&value(b)))?;
    let most = rows.iter().max_by(|a, b| value(a).total_cmp(&value(b)))?;
    Some((least, most))
}

/// A change of traffic in words, and the word before what it is compared with.
fn traffic(pct: f64) -> (String, &'static str) {
    let words = change(pct, "less", "more", "as much");
    let than = if words == "as much" { "as" } else { "than" };
    (words, than)
}

/// A value as tables print it.
fn rounded(value: f64) -> f64 {
    format!("{value:.1}").parse().unwrap_or(0.0)
}

/// Orders against a baseline: names, and the percentage of the baseline's traffic that each saves. `over`
/// says what the means are taken over.
pub(super) fn tile_orders(baseline: &str, over: &str, orders: &[(String, f64)]) -> Vec<String> {
    let Some((worst, best)) = ends(orders, |o| o.1) else {
        return vec![format!(
            "Only {baseline} was replayed, so no order is compared with another."
        )];
    };
    let than = |pct: f64| {
        let (words, than) = traffic(-pct);
        format!("{words} {than} {baseline}")
    };
    let mut out = vec![match (orders.len(), rounded(best.1) > 0.0) {
        (1, _) => {
            let (words, than) = traffic(-best.1);
            format!(
                "{} fetches {words} texture data from memory {than} {baseline} ({over}).",
                best.0
            )
        }
        (others, true) => format!(
            "Of {}, {} fetches the least texture data from memory: {} ({over}).",
            count(others + 1, "tile order"),
            best.0,
            than(best.1)
        ),
        (others, false) => format!(
            "None of the {others} other orders fetches less texture data from memory than {baseline}; {} comes closest with {} ({over}).",
            best.0,
            traffic(-best.1).0
        ),
    }];
    // Where every order saves, the baseline itself fetches the most.
    if orders.len() > 1 && rounded(worst.1) < 0.0 {
        out.push(format!("{} fetches the most: {}.", worst.0, than(worst.1)));
    }
    out
}

/// An axis of a sweep: its key, and the mean traffic at each of its values.
pub type Effect = (String, Vec<(String, f64)>);

/// The points of a sweep with their traffic in MB per frame, and the axes.
pub fn sweep(points: &[(String, f64)], effects: &[Effect]) -> Vec<String> {
    let Some((least, most)) = ends(points, |p| p.1) else {
        return vec!["No point was replayed.".to_owned()];
    };
    let mb = |value: f64| format!("{value:.2} MB per frame");
    if points.len() == 1 {
        return vec![format!(
            "One point was replayed: it fetches {} from memory.",
            mb(least.1)
        )];
    }
    if mb(least.1) == mb(most.1) {
        return vec![format!(
            "All {} points fetch {} from memory: none of the settings changes it.",
            points.len(),
            mb(least.1)
        )];
    }
    let mut out = vec![format!(
        "Over {} points, external texture traffic ranges from {} ({}) to {} ({}).",
        points.len(),
        mb(least.1),
        least.0,
        mb(most.1),
        most.0
    )];
    let spread = |effect: &Effect| {
        ends(&effect.1, |v| v.1).map_or(0.0, |(low, high)| high.1 / low.1.max(f64::MIN_POSITIVE))
    };
    let largest = effects.iter().filter(|e| e.1.len() > 1);
    let largest = largest.max_by(|a, b| spread(a).total_cmp(&spread(b)));
    if let Some((key, values)) = largest
        && let Some((low, high)) = ends(values, |v| v.1)
        && mb(low.1) != mb(high.1)
    {
        let which = match effects.iter().filter(|e| e.1.len() > 1).count() {
            1 => format!("{key} changes the mean"),
            axes => format!("Of {axes} axes, {key} changes the mean most:"),
        };
        out.push(format!(
            "{which} from {} at {} to {} at {}.",
            mb(low.1),
            low.0,
            mb(high.1),
            high.0
        ));
    }
    out
}

/// Misses of the configured cache under one order, percent of line accesses: LRU as configured, and OPT of
/// the same size.
pub struct Misses {
    /// Name of the order.
    pub order: String,
    /// As configured.
    pub miss_pct: f64,
    /// Under OPT, fully associative.
    pub opt_pct: f64,
}

/// The misses of one stream.
pub fn misses(cache: &str, rows: &[Misses]) -> Option<String> {
    let (least, most) = ends(rows, |r| r.miss_pct)?;
    let bound = format!("{:.2} % under optimal replacement", least.opt_pct);
    let pct = |row: &Misses| format!("{:.2} %", row.miss_pct);
    Some(match rows {
        [_] => format!(
            "{cache}: {} of line accesses miss; it would be {bound}.",
            pct(least)
        ),
        _ if pct(least) == pct(most) => format!(
            "{cache}: {} of line accesses miss in each of the {} orders; it would be {bound}.",
            pct(least),
            rows.len()
        ),
        _ => format!(
            "{cache}: {} has the fewest misses of {} orders, {} of line accesses ({bound}), and {} the most, {}.",
            least.order,
            rows.len(),
            pct(least),
            most.order,
            pct(most)
        ),
    })
}

/// An order of a study.
pub(super) struct Studied {
    /// Name.
    pub name: String,
    /// Change of the bytes against the baseline, percent.
    pub change_pct: f64,
    /// Whether hardware can have it.
    pub is_buildable: bool,
    /// Least and most change over the rows or over a machine's ranges.
    pub range_pct: Option<[f64; 2]>,
    /// Change against Morton order, percent, if it was replayed.
    pub over_morton_pct: Option<f64>,
    /// Bytes of its registers.
    pub state_bytes: u64,
}

/// Orders whose means differ by at most this many points are called equal.
const TIE_POINTS: f64 = 0.1;

/// A study of orders and bounds against Morton order if it was replayed, else against `baseline`. `over` says what
/// means and ranges are taken over.
pub(super) fn studied(baseline: &str, orders: &[Studied], over: &str) -> Vec<String> {
    let morton = Order::MORTON.name();
    let has_morton = orders
        .iter()
        .any(|o| o.name == morton && o.over_morton_pct.is_some());
    let reference = if has_morton { morton } else { baseline };
    let against = |order: &Studied| match has_morton {
        true => order.over_morton_pct.unwrap_or(0.0),
        false => order.change_pct,
    };
    let compare = |order: &Studied| {
        let (words, than) = traffic(against(order));
        format!(
            "{} reads {words} from memory {than} {reference}",
            order.name
        )
    };
    let range = |order: &Studied| match order.range_pct {
        Some([low, high]) if rounded(low) < rounded(high) => {
            format!("{low:+.1} to {high:+.1} %, {over}")
        }
        _ => over.to_owned(),
    };
    let of_baseline = |order: &Studied| {
        let is_other = has_morton && order.name != baseline;
        is_other
            .then(|| traffic(order.change_pct))
            .map_or_else(String::new, |(words, than)| {
                format!(", and {words} {than} {baseline}")
            })
    };
    let others = |buildable: bool| {
        let of = move |o: &&Studied| o.is_buildable == buildable && o.name != reference;
        orders.iter().filter(of)
    };
    let best = |buildable: bool| others(buildable).min_by(|a, b| against(a).total_cmp(&against(b)));
    let lows = others(true).filter_map(|o| Some((o.name.as_str(), o.range_pct?[0])));
    let saves_over_ranges = lows
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .filter(|(_, low)| rounded(*low) < 0.0);
    let mut out = Vec::new();
    match best(true) {
        Some(_)
            if others(true).all(|o| rounded(against(o)) == 0.0) && saves_over_ranges.is_some() =>
        {
            let (order, low) = saves_over_ranges.unwrap_or_default();
            out.push(format!(
                "All orders read as much from memory as {reference} here; {order} reads up to {:.1} % less in the best case ({over}).",
                -low
            ));
        }
        Some(_) if others(true).all(|o| rounded(against(o)) == 0.0) => out.push(format!(
            "No order can save here: {} as much from memory as {reference} ({over}).",
            match others(true).count() {
                1 => "the other order reads".to_owned(),
                2 => "both other orders read".to_owned(),
                all => format!("all {all} other orders read"),
            }
        )),
        Some(best) => {
            let verdict = if rounded(against(best)) < 0.0 {
                "Best buildable order"
            } else {
                "No other buildable order reads less. The closest"
            };
            out.push(format!(
                "{verdict}: {} ({}){}.",
                compare(best),
                range(best),
                of_baseline(best)
            ));
            let near: Vec<&Studied> = others(true)
                .filter(|o| o.name != best.name && against(o) - against(best) <= TIE_POINTS)
                .collect();
            let simplest = near.iter().min_by_key(|o| o.state_bytes);
            out.extend(simplest.map(|simplest| {
                let least = match simplest.state_bytes < best.state_bytes {
                    true => format!(
                        "; {} has the least state of them, {} instead of {} bytes",
                        simplest.name, simplest.state_bytes, best.state_bytes
                    ),
                    false => String::new(),
                };
                format!(
                    "{} within {TIE_POINTS} points of it{least}.",
                    match near.len() {
                        1 => "One other is".to_owned(),
                        all => format!("{all} others are"),
                    }
                )
            }));
        }
        None => out.push(format!(
            "Only {reference} is an order that hardware can follow ({over})."
        )),
    }
    if let Some(best) = best(false) {
        out.push(format!(
            "With knowledge of the frame's accesses, which no hardware has, {}.",
            compare(best)
        ));
    }
    out
}

/// Stereo reprojection of one scene.
pub struct Reprojected {
    /// Name of the scene.
    pub scene: String,
    /// Frames per second over those of tracing both eyes.
    pub performance: f64,
    /// Energy over that of tracing both eyes.
    pub energy: f64,
    /// Least and most energy at 14 nm.
    pub energy_bounds: [f64; 2],
    /// Right pixels that are reused, percent.
    pub reuse_pct: f64,
    /// Mean FLIP of the right image.
    pub flip: f64,
    /// The paper's performance and energy.
    pub paper: Option<[f64; 2]>,
}

/// Performance, energy and error of reprojection.
pub fn reprojected(scenes: &[Reprojected]) -> Vec<String> {
    if scenes.is_empty() {
        return Vec::new();
    }
    let geometric = |of: fn(&Reprojected) -> f64| {
        let values = scenes.iter().map(|s| of(s).max(f64::MIN_POSITIVE));
        geometric_mean(values).unwrap_or(1.0)
    };
    let plain = |of: fn(&Reprojected) -> f64| mean(scenes.iter().map(of)).unwrap_or(0.0);
    let of = match scenes {
        [one] => one.scene.clone(),
        _ => format!("the mean of {}", count(scenes.len(), "scene")),
    };
    let (speed, energy) = (geometric(|s| s.performance), geometric(|s| s.energy));
    let range = match ends(scenes, |s| s.energy) {
        Some((least, most)) if scenes.len() > 1 => {
            format!(
                "{:.2} to {:.2} times, by scene; ",
                least.energy, most.energy
            )
        }
        _ => String::new(),
    };
    let bounds = [0, 1].map(|end| {
        let ends = scenes
            .iter()
            .map(|s| s.energy_bounds[end].max(f64::MIN_POSITIVE));
        geometric_mean(ends).unwrap_or(1.0)
    });
    let open = match bounds[0] < 1.0 && bounds[1] > 1.0 {
        true => ": whether it saves energy is open",
        false => "",
    };
    let range = format!(
        " ({range}{:.2} to {:.2} times at 14 nm{open})",
        bounds[0], bounds[1]
    );
    let energy = 100.0 * (energy - 1.0);
    let mut out = vec![
        format!(
            "In {of}, reprojection reuses {:.1} % of the right pixels: {speed:.2} times the frames per second of tracing both eyes, {} energy{range}.",
            plain(|s| s.reuse_pct),
            change(energy, "less", "more", "the same"),
        ),
        format!(
            "The right image differs from the traced one by a mean FLIP of {:.4}.",
            plain(|s| s.flip)
        ),
    ];
    let known: Vec<[f64; 2]> = scenes.iter().filter_map(|s| s.paper).collect();
    if !known.is_empty() {
        let mean = |i: usize| geometric_mean(known.iter().map(|p| p[i])).unwrap_or(1.0);
        let of = match known.len() {
            1 => "the scene that stands for one of its own".to_owned(),
            scenes => format!("the {scenes} scenes that stand for its own"),
        };
        out.push(format!(
            "The paper has {:.2} times the frames per second and {:.2} times the energy for {of}.",
            mean(0),
            mean(1)
        ));
    }
    out
}

/// A technique against the baseline.
pub struct Timed {
    /// Name.
    pub name: String,
    /// Frame time over that of the baseline.
    pub time: Spread,
    /// Mean FLIP.
    pub flip: f64,
}

impl Timed {
    /// Whether the measurements tell the technique from the baseline: enough of them, and both quartiles on one
    /// side of 1.
    fn is_told_apart(&self) -> bool {
        self.time.samples >= LEAST_SAMPLES && (self.time.q3 < 1.0 || self.time.q1 > 1.0)
    }

    /// Its frame time against the baseline, with quartiles.
    fn takes(&self) -> String {
        let Spread {
            q1,
            median,
            q3,
            samples,
            ..
        } = self.time;
        let spread = format!(
            "quartiles {q1:.2} to {q3:.2} times, {}",
            count(samples, "measurement")
        );
        match change(100.0 * (median - 1.0), "less", "more", "").as_str() {
            "" => format!("as much frame time as the baseline ({spread})"),
            words => format!("{words} frame time than the baseline ({spread})"),
        }
    }
}

/// Techniques of one scene, without the baseline; its name, and its measurements against itself.
pub fn timed(scene: &str, techniques: &[Timed], baseline: (&str, Option<Spread>)) -> Vec<String> {
    let fastest = |without_error: bool| {
        let of = techniques
            .iter()
            .filter(|of| !without_error || of.flip == 0.0);
        of.min_by(|a, b| a.time.median.total_cmp(&b.time.median))
    };
    let error = |flip: f64| match flip {
        0.0 => "without any image error".to_owned(),
        flip => format!("with a mean FLIP of {flip:.4}"),
    };
    let Some(best) = fastest(false) else {
        return vec![format!("Only the baseline was measured on {scene}.")];
    };
    let of = match techniques.len() {
        1 => format!("On {scene}, {} takes", best.name),
        many => format!(
            "Of {many} techniques on {scene}, {} is the fastest:",
            best.name
        ),
    };
    let mut out = vec![format!("{of} {} {}.", best.takes(), error(best.flip))];
    if !best.is_told_apart() {
        out.push(format!(
            "These measurements do not tell it from the baseline: expected {LEAST_SAMPLES} or more with both quartiles on one side of 1."
        ));
    }
    if best.flip > 0.0 {
        match fastest(true) {
            Some(of) => out.push(format!(
                "{} is the fastest without any image error: it takes {}.",
                of.name,
                of.takes()
            )),
            None => out.push("Each of them changes the image.".to_owned()),
        }
    }
    let noise = baseline.1.map_or_else(String::new, |own| {
        format!(
            ", which measured against itself takes {:.2} times its time (quartiles {:.2} to {:.2}): smaller differences are noise",
            own.median, own.q1, own.q3
        )
    });
    if techniques.len() == 1 && out.last().is_some_and(|last| last.starts_with("Each")) {
        out.pop();
    }
    out.push(format!("The baseline is {}{noise}.", baseline.0));
    out
}

/// Recommended choices: study, time over the reference's, mean error with its unit. A choice that is the
/// reference itself has no error.
pub fn recommended(studies: &[(String, Option<f64>, bool)]) -> Vec<String> {
    if studies.is_empty() {
        return vec!["No study had its inputs.".to_owned()];
    }
    let references: Vec<&str> = (studies.iter().filter(|s| s.2).map(|s| s.0.as_str())).collect();
    let mut out = vec![match (studies.len(), references.len()) {
        (1, 0) => {
            "The recommended choice of the study is a faster or simpler method than its reference."
                .to_owned()
        }
        (1, _) => "The recommended choice of the study is its reference.".to_owned(),
        (all, 0) => format!("All {all} studies recommend another method than the reference."),
        (all, some) if all == some => {
            format!("All {all} studies recommend the reference.")
        }
        (all, some) => format!(
            "{} of {all} studies recommend another method than the reference; the reference stays in {}.",
            all - some,
            list(&references, 3)
        ),
    }];
    let timed: Vec<(&str, f64)> = (studies.iter().filter(|s| !s.2))
        .filter_map(|s| Some((s.0.as_str(), s.1?)))
        .filter(|s| s.1 > 0.0)
        .collect();
    if let Some((fastest, _)) = ends(&timed, |t| t.1) {
        out.push(match fastest.1 < 0.995 {
            true => format!(
                "The largest saving of time is in \u{201c}{}\u{201d}: {:.2} times the time of the reference.",
                fastest.0, fastest.1
            ),
            false => "None of them saves time on this machine.".to_owned(),
        });
    }
    out
}

#[cfg(test)]
mod tests;
