//! Frame times, compared with those of the baseline measured next to them.

use super::manifest::{ManifestRow, numbers};
use super::pacing::{Pacing, RATES_HZ};

/// Refresh rates of displays, with periods of 11.1 and 13.9 ms.
pub const REFRESH_HZ: [f64; 2] = [90.0, 72.0];

/// Distribution of measurements.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// 1st percentile.
    pub p1: f64,
    /// Lower quartile.
    pub q1: f64,
    /// Median.
    pub median: f64,
    /// Upper quartile.
    pub q3: f64,
    /// 99th percentile.
    pub p99: f64,
    /// Number of measurements.
    pub samples: usize,
}

impl Spread {
    /// The distribution of these values, with linear interpolation between ranks; `None` without values.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Option<Self> {
        let mut sorted: Vec<f64> = values.into_iter().collect();
        sorted.sort_by(f64::total_cmp);
        let last = sorted.len().checked_sub(1)?;
        let at = |share: f64| {
            let rank = share * last as f64;
            let (low, part) = (rank.floor() as usize, rank.fract());
            sorted[low] + part * (sorted[(low + 1).min(last)] - sorted[low])
        };
        Some(Self {
            p1: at(0.01),
            q1: at(0.25),
            median: at(0.5),
            q3: at(0.75),
            p99: at(0.99),
            samples: sorted.len(),
        })
    }
}

/// Frame times of a technique.
#[derive(Clone, Debug, PartialEq)]
pub struct Timing {
    /// Time over that of the baseline measured next to it, over all frames and repeats.
    pub ratio: Spread,
    /// Processor time over the baseline's, summed over frames. Each frame counts with its fastest repeat,
    /// which was disturbed least. `None` if the system did not report it.
    pub processor_ratio: Option<f64>,
    /// The same ratio by frame, as a distribution over the frames.
    pub processor_ratios: Option<Spread>,
    /// Time in ms over all frames and repeats.
    pub frame_ms: Spread,
    /// Percent of all measurements longer than the period of each of [`REFRESH_HZ`], with times scaled so
    /// that the baseline's median equals the first period.
    pub beyond_pct: [f64; 2],
    /// Every measurement, unscaled, against each of [`RATES_HZ`].
    pub pacing: Vec<Pacing>,
    /// Median of each frame's repeats in ms.
    pub frames_ms: Vec<f64>,
    /// Median of each stage over the frames in ms, in the manifest's order.
    pub stages_ms: Vec<(String, f64)>,
    /// Median culling time per frame in ms.
    pub cull_ms: f64,
}

impl Timing {
    /// The times of a row. Every frame needs a time; baseline times must be as many or none.
    pub fn of(row: &ManifestRow) -> Option<Self> {
        let times = || row.frames.iter().flat_map(|f| f.frame_s.iter().copied());
        let beside = || {
            let own = |f: &super::manifest::Frame| {
                // The baseline's own row may omit the baseline times.
                if f.baseline_s.is_empty() {
                    f.frame_s.clone()
                } else {
                    f.baseline_s.clone()
                }
            };
            row.frames.iter().flat_map(own)
        };
        let baseline_s = Spread::of(beside())?.median;
        let [period_s, _] = REFRESH_HZ.map(|hz| 1.0 / hz);
        let scale = period_s / baseline_s;
        let count = times().count();
        let beyond = |hz: f64| {
            let late = times().filter(|s| s * scale > 1.0 / hz).count();
            100.0 * late as f64 / count.max(1) as f64
        };
        let ms = |s: f64| 1e3 * s;
        let mut stages: Vec<(String, Vec<f64>)> = Vec::new();
        for (name, seconds) in row.frames.iter().flat_map(|f| numbers(&f.stages_s)) {
            match stages.iter_mut().find(|(known, _)| known == name) {
                Some((_, list)) => list.push(ms(seconds)),
                None => stages.push((name.to_owned(), vec![ms(seconds)])),
            }
        }
        let measured_ms: Vec<f64> = times().map(ms).collect();
        let median = |values: Vec<f64>| Spread::of(values).map_or(0.0, |s| s.median);
        let of_frame =
            |f: &super::manifest::Frame| median(f.frame_s.iter().map(|s| ms(*s)).collect());
        let least = |times: &[f64]| times.iter().copied().reduce(f64::min);
        let worked: Vec<(f64, f64)> = (row.frames.iter())
            .filter_map(|f| least(&f.processor_s).zip(least(&f.baseline_processor_s)))
            .collect();
        let (own_s, base_s) = (worked.iter()).fold((0.0, 0.0), |(a, b), (x, y)| (a + x, b + y));
        Some(Self {
            processor_ratio: (base_s > 0.0).then(|| own_s / base_s),
            processor_ratios: Spread::of(worked.iter().map(|(own, base)| own / base)),
            ratio: Spread::of(times().zip(beside()).map(|(own, base)| own / base))?,
            frame_ms: Spread::of(times().map(ms))?,
            beyond_pct: REFRESH_HZ.map(beyond),
            pacing: (RATES_HZ.iter())
                .filter_map(|hz| Pacing::of(*hz, &measured_ms))
                .collect(),
            frames_ms: row.frames.iter().map(of_frame).collect(),
            stages_ms: stages.into_iter().map(|(n, v)| (n, median(v))).collect(),
            cull_ms: median(row.frames.iter().map(|f| ms(f.cull_s)).collect()),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::row;
    use super::*;

    #[test]
    fn quartiles_of_one_to_five_are_two_three_and_four() {
        let spread = Spread::of([5.0, 1.0, 4.0, 2.0, 3.0]).unwrap();
        assert_eq!((spread.q1, spread.median, spread.q3), (2.0, 3.0, 4.0));
        assert!((spread.p1 - 1.04).abs() < 1e-12 && (spread.p99 - 4.96).abs() < 1e-12);
        assert_eq!(Spread::of([]), None);
    }

    #[test]
    fn a_machine_that_slows_down_leaves_the_ratio_unchanged() {
        // Every repeat takes four fifths of the baseline's time, which grows.
        let mut row = row("a", 1);
        row.frames[0].baseline_s = (1..=9).map(|i| 0.1 * f64::from(i)).collect();
        row.frames[0].frame_s = row.frames[0].baseline_s.iter().map(|s| 0.8 * s).collect();
        let timing = Timing::of(&row).unwrap();
        assert!((timing.ratio.median - 0.8).abs() < 1e-12);
        assert!((timing.ratio.p99 - timing.ratio.p1).abs() < 1e-12);
        assert!((timing.frame_ms.median - 400.0).abs() < 1e-9);
    }

    #[test]
    fn processor_time_counts_each_frames_fastest_repeat() {
        let mut row = row("a", 2);
        assert_eq!(Timing::of(&row).unwrap().processor_ratio, None);
        for (frame, [own, base]) in row.frames.iter_mut().zip([[1.0, 2.0], [3.0, 4.0]]) {
            frame.processor_s = vec![own, 9.0, own];
            frame.baseline_processor_s = vec![7.0, base, base];
        }
        let timing = Timing::of(&row).unwrap();
        assert_eq!(timing.processor_ratio, Some(4.0 / 6.0));
        assert_eq!(timing.processor_ratios.unwrap().median, 0.625);
    }

    #[test]
    fn pacing_counts_frames_longer_than_the_baselines_median_plus_a_quarter() {
        // Scaled, the baseline takes 11.1 ms: 1.0 is on time, 1.1 is late for 90 Hz, 1.3 also for 72 Hz.
        let mut row = row("a", 4);
        for (frame, time) in row.frames.iter_mut().zip([1.0, 1.1, 1.3, 0.5]) {
            (frame.frame_s, frame.baseline_s) = (vec![time], vec![1.0]);
        }
        assert_eq!(Timing::of(&row).unwrap().beyond_pct, [50.0, 25.0]);
    }

    #[test]
    fn a_baseline_without_baseline_times_is_compared_with_itself() {
        let mut row = row("a", 2);
        for frame in &mut row.frames {
            frame.baseline_s.clear();
        }
        let timing = Timing::of(&row).unwrap();
        assert_eq!((timing.ratio.p1, timing.ratio.p99), (1.0, 1.0));
    }
}
