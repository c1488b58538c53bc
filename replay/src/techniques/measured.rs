//! All figures of one technique on one scene, and of the orders on its trace.

use super::manifest::{Frame, Manifest, ManifestRow};
use super::{PictureFigures, Sharing, Spread, Timing, dominated, dominated_in_time};
use crate::config::Order;

/// What the caches say of a technique's trace, in one order.
#[derive(Clone, Debug, PartialEq)]
pub struct CacheFigures {
    /// Order of the tiles.
    pub order: Order,
    /// Bilinear footprints.
    pub footprints: u64,
    /// Footprints with a missing line, percent.
    pub l1_miss_pct: f64,
    /// Line look-ups of the L2 that miss, percent.
    pub l2_miss_pct: f64,
    /// Line misses of the L2 times the line size, all frames of the trace.
    pub external_bytes: u64,
    /// Traffic of an infinite cache in bytes.
    pub bound_bytes: u64,
    /// Frames of the trace.
    pub frames: u32,
}

impl CacheFigures {
    /// External traffic in MB (10^6 bytes) a frame.
    #[must_use]
    pub fn external_mb_per_frame(&self) -> f64 {
        self.external_bytes as f64 / 1e6 / f64::from(self.frames.max(1))
    }
}

/// A count of a frame.
pub type Count = fn(&Frame) -> Option<u64>;

/// A technique or combination on a scene.
pub struct Measured<'a> {
    /// Short name of the scene.
    pub scene: &'a str,
    /// The folder's manifest.
    pub manifest: &'a Manifest,
    /// The manifest's row.
    pub row: &'a ManifestRow,
    /// The baseline's row.
    pub baseline: &'a ManifestRow,
    /// Frame times.
    pub timing: Timing,
    /// Image errors.
    pub pictures: PictureFigures,
    /// Number of the worst picture's frame.
    pub worst_frame: u32,
    /// Caches, one an order; none without a trace.
    pub caches: Vec<CacheFigures>,
    /// What the eyes share; none without a trace.
    pub sharing: Option<Sharing>,
    /// Another row errs no more in the mean and takes less time, with the quartiles apart.
    pub dominated: bool,
    /// Counts of which another row needs no more, with no more error in the worst picture, and is better at one of
    /// both: names of [`OBJECTIVES`].
    pub dominated_in: Vec<&'static str>,
}

/// A cost of a frame; none where it was not counted.
pub type Cost = fn(&Frame) -> Option<f64>;

/// The counts that techniques are ranked by, which any two runs have in common.
pub const OBJECTIVES: [(&str, Cost); 3] = [
    ("fragments", |frame| Some(frame.fragments? as f64)),
    ("bytes", |frame| Some(frame.memory_bytes? as f64)),
    ("energy", |frame| frame.energy_mj),
];

impl Measured<'_> {
    /// True for the technique that the others are held against.
    #[must_use]
    pub fn is_baseline(&self) -> bool {
        self.row.technique == self.baseline.technique
    }

    /// A count summed over the frames; none where a frame has none.
    #[must_use]
    pub fn total(&self, of: Count) -> Option<u64> {
        self.row.frames.iter().map(of).sum()
    }

    /// The largest of a count over the frames; none where a frame has none.
    #[must_use]
    pub fn most(&self, of: Count) -> Option<u64> {
        let counts: Option<Vec<u64>> = self.row.frames.iter().map(of).collect();
        counts?.into_iter().max()
    }

    /// A count over the baseline's; none where that has none.
    #[must_use]
    pub fn over_baseline(&self, of: Count) -> Option<f64> {
        let whole: u64 = self.baseline.frames.iter().map(of).sum::<Option<u64>>()?;
        (whole > 0).then_some(self.total(of)? as f64 / whole as f64)
    }

    /// Energy of the counted work over the baseline's; none where that has none.
    #[must_use]
    pub fn energy_ratio(&self) -> Option<f64> {
        let whole = |row: &ManifestRow| row.frames.iter().map(|f| f.energy_mj).sum::<Option<f64>>();
        let baseline = whole(self.baseline)?;
        (baseline > 0.0).then_some(whole(self.row)? / baseline)
    }

    /// Mean of a figure that the technique predicts of itself.
    #[must_use]
    pub fn predicted(&self, key: &str) -> Option<f64> {
        let frames = self.row.frames.iter();
        let values: Vec<f64> = frames
            .filter_map(|frame| frame.predicted.get(key)?.as_f64())
            .collect();
        (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
    }

    /// The caches in an order.
    #[must_use]
    pub fn caches_in(&self, order: Order) -> Option<&CacheFigures> {
        self.caches.iter().find(|c| c.order == order)
    }
}

/// The techniques of one scene.
pub struct Measures<'a> {
    /// Short name of the scene.
    pub scene: &'a str,
    /// One a row of the manifest.
    pub rows: Vec<Measured<'a>>,
}

impl Measures<'_> {
    /// Marks what is dominated in frame time and mean error, and in each count and the worst picture's error.
    pub fn mark_dominated(&mut self) {
        let times: Vec<(Spread, f64)> = (self.rows.iter())
            .map(|m| (m.timing.ratio, m.pictures.flip_mean))
            .collect();
        for (row, dominated) in self.rows.iter_mut().zip(dominated_in_time(&times)) {
            row.dominated = dominated;
        }
        for (name, of) in OBJECTIVES {
            let cost = |m: &Measured| m.row.frames.iter().map(of).sum::<Option<f64>>();
            let costs: Option<Vec<(f64, f64)>> = (self.rows.iter())
                .map(|m| Some((cost(m)?, m.pictures.flip_worst)))
                .collect();
            let Some(costs) = costs else { continue };
            for (row, dominated) in self.rows.iter_mut().zip(dominated(&costs)) {
                row.dominated_in.extend(dominated.then_some(name));
            }
        }
    }

    /// What each technique leaves of the gain of an order over another.
    #[must_use]
    pub fn order_gains(&self, order: Order, against: Order) -> Vec<OrderGain<'_>> {
        let gain = |m| Gain::of(m, order, against);
        let baseline = self.rows.iter().find(|m| m.is_baseline()).and_then(gain);
        let rows = self.rows.iter();
        rows.filter_map(|measured| {
            Some(OrderGain {
                measured,
                own: gain(measured)?,
                baseline: baseline?,
            })
        })
        .collect()
    }
}

/// How much an order saves on a trace, and what there is to save.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gain {
    /// External traffic saved, percent of the other order's.
    pub saved_pct: f64,
    /// The other order's traffic above that of an infinite cache, percent: no order saves more.
    pub headroom_pct: f64,
    /// Lines that both eyes touch, percent of those that either does.
    pub shared_pct: f64,
}

impl Gain {
    fn of(measured: &Measured, order: Order, against: Order) -> Option<Self> {
        let (ours, theirs) = (measured.caches_in(order)?, measured.caches_in(against)?);
        let whole = theirs.external_bytes as f64;
        let under = |bytes: u64| (whole > 0.0).then(|| 100.0 * (1.0 - bytes as f64 / whole));
        Some(Self {
            saved_pct: under(ours.external_bytes)?,
            headroom_pct: under(theirs.bound_bytes)?,
            shared_pct: measured.sharing?.shared_pct()?,
        })
    }
}

/// A technique's gain by an order beside the baseline's.
pub struct OrderGain<'a> {
    /// The technique.
    pub measured: &'a Measured<'a>,
    /// With it.
    pub own: Gain,
    /// Without it.
    pub baseline: Gain,
}

impl OrderGain<'_> {
    /// Gains that differ by less, in points, count as equal.
    const EQUAL_POINTS: f64 = 0.5;

    /// Why the gain is what it is beside the baseline's, from the two figures that bound it: what
    /// the other order fetches above an infinite cache, and what the eyes have in common.
    #[must_use]
    pub fn reason(&self) -> String {
        let Self { own, baseline, .. } = self;
        let gain = own.saved_pct - baseline.saved_pct;
        if self.measured.is_baseline() {
            return format!(
                "both eyes touch {:.1} % of the lines; {:.1} % of the traffic is above an infinite cache's",
                own.shared_pct, own.headroom_pct
            );
        }
        if gain.abs() < Self::EQUAL_POINTS {
            return format!(
                "gain as without: both eyes touch {:.1} % of the lines (without {:.1} %)",
                own.shared_pct, baseline.shared_pct
            );
        }
        let verdict = if gain < 0.0 { "less" } else { "more" };
        let [shared, headroom] = [
            own.shared_pct - baseline.shared_pct,
            own.headroom_pct - baseline.headroom_pct,
        ];
        let sharing = format!(
            "both eyes touch {:.1} % of the lines (without {:.1} %)",
            own.shared_pct, baseline.shared_pct
        );
        let room = format!(
            "{:.1} % of the traffic is above an infinite cache's (without {:.1} %)",
            own.headroom_pct, baseline.headroom_pct
        );
        // What moved the way that the gain did is the reason, the larger move first.
        let mut moved = [(shared, sharing), (headroom, room)];
        moved.sort_by(|a, b| b.0.abs().total_cmp(&a.0.abs()));
        let reasons: Vec<String> = moved
            .into_iter()
            .filter(|(points, _)| points.signum() == gain.signum() && points.abs() >= 0.1)
            .map(|(_, text)| text)
            .collect();
        if reasons.is_empty() {
            return format!(
                "{:.1} points {verdict}, though neither what the eyes share ({:+.1} points) nor the traffic above an infinite cache's ({:+.1} points) moved that way: the traffic itself changed",
                gain.abs(),
                shared,
                headroom
            );
        }
        format!("{:.1} points {verdict}: {}", gain.abs(), reasons.join("; "))
    }
}
