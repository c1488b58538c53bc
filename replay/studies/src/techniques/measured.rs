//! All figures of one technique on one scene, and the savings of orders on its trace.

use super::manifest::{Frame, Manifest, ManifestRow};
use super::{PictureFigures, Sharing, Spread, Timing, dominated, dominated_in_time};
use sim::config::Order;

/// Cache figures of a technique's trace in one order.
#[derive(Clone, Debug, PartialEq)]
pub struct CacheFigures {
    /// Order of the tiles.
    pub order: Order,
    /// Bilinear footprints.
    pub footprints: u64,
    /// Footprints with a missing line, percent.
    pub l1_footprint_miss_pct: f64,
    /// Line look-ups of the L2 that miss, percent.
    pub l2_line_miss_pct: f64,
    /// Line misses of the L2 times the line size, all frames of the trace.
    pub external_bytes: u64,
    /// Traffic of an infinite cache in bytes.
    pub bound_bytes: u64,
    /// Frames of the trace.
    pub frames: u32,
}

impl CacheFigures {
    /// External traffic in MB (10^6 bytes) per frame.
    pub fn external_mb_per_frame(&self) -> f64 {
        self.external_bytes as f64 / 1e6 / f64::from(self.frames.max(1))
    }
}

/// A count per frame.
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
    /// Frame number of the worst picture.
    pub worst_frame: u32,
    /// Cache figures by order; empty without a trace.
    pub caches: Vec<CacheFigures>,
    /// Lines that the eyes share; `None` without a trace.
    pub sharing: Option<Sharing>,
    /// Whether another row has at most the same mean error and takes less time, with disjoint interquartile
    /// ranges.
    pub dominated: bool,
    /// Counts in which another row is at least as good, with at most the same error in its worst picture,
    /// and better in one of both: names of [`OBJECTIVES`].
    pub dominated_in: Vec<&'static str>,
}

/// A cost per frame; `None` if it was not counted.
pub type Cost = fn(&Frame) -> Option<f64>;

/// The counts by which techniques are ranked; they are the same in every run.
const OBJECTIVES: [(&str, Cost); 3] = [
    ("fragments", |frame| Some(frame.fragments? as f64)),
    ("bytes", |frame| Some(frame.memory_bytes? as f64)),
    ("energy", |frame| frame.energy_mj),
];

impl Measured<'_> {
    /// Whether it is the baseline.
    pub fn is_baseline(&self) -> bool {
        self.row.technique == self.baseline.technique
    }

    /// Sum of a count over the frames; `None` if a frame has none.
    pub fn total(&self, of: Count) -> Option<u64> {
        self.row.frames.iter().map(of).sum()
    }

    /// Maximum of a count over the frames; `None` if a frame has none.
    pub fn most(&self, of: Count) -> Option<u64> {
        let counts: Option<Vec<u64>> = self.row.frames.iter().map(of).collect();
        counts?.into_iter().max()
    }

    /// A count over the baseline's; `None` if the baseline has none.
    pub fn over_baseline(&self, of: Count) -> Option<f64> {
        let whole: u64 = self.baseline.frames.iter().map(of).sum::<Option<u64>>()?;
        (whole > 0).then_some(self.total(of)? as f64 / whole as f64)
    }

    /// Energy of the counted work over the baseline's; `None` if the baseline has none.
    pub fn energy_ratio(&self) -> Option<f64> {
        let whole = |row: &ManifestRow| row.frames.iter().map(|f| f.energy_mj).sum::<Option<f64>>();
        let baseline = whole(self.baseline)?;
        (baseline > 0.0).then_some(whole(self.row)? / baseline)
    }

    /// Mean of a figure that the technique predicts.
    pub fn predicted(&self, key: &str) -> Option<f64> {
        let frames = self.row.frames.iter();
        let values: Vec<f64> = frames
            .filter_map(|frame| frame.predicted.get(key)?.as_f64())
            .collect();
        (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
    }

    /// The cache figures in an order.
    pub fn caches_in(&self, order: Order) -> Option<&CacheFigures> {
        self.caches.iter().find(|c| c.order == order)
    }
}

/// The techniques of one scene.
pub struct Measures<'a> {
    /// Short name of the scene.
    pub scene: &'a str,
    /// One entry per row of the manifest.
    pub rows: Vec<Measured<'a>>,
}

impl Measures<'_> {
    /// Marks dominated techniques: by frame time and mean error, and by each count and the worst picture's
    /// error.
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

    /// The saving of an order over another one, with each technique and without.
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

/// The saving of an order on a trace, and its upper bound.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gain {
    /// External traffic saved, percent of the other order's.
    pub saved_pct: f64,
    /// The other order's traffic above that of an infinite cache, percent; an upper bound of the saving.
    pub headroom_pct: f64,
    /// Lines that both eyes touch, percent of the lines that at least one touches.
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

/// The saving of an order with a technique and with the baseline.
pub struct OrderGain<'a> {
    /// The technique.
    pub measured: &'a Measured<'a>,
    /// With the technique.
    pub own: Gain,
    /// With the baseline.
    pub baseline: Gain,
}

impl OrderGain<'_> {
    /// Savings that differ by less, in points, count as equal.
    const EQUAL_POINTS: f64 = 0.5;

    /// Explains the change of the saving by the change of its two bounds: the other order's traffic above
    /// that of an infinite cache, and the lines that the eyes share.
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
                "saving unchanged: both eyes touch {:.1} % of the lines (without {:.1} %)",
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
        // The bounds that changed in the same direction are the reasons, the larger change first.
        let mut moved = [(shared, sharing), (headroom, room)];
        moved.sort_by(|a, b| b.0.abs().total_cmp(&a.0.abs()));
        let reasons: Vec<String> = moved
            .into_iter()
            .filter(|(points, _)| points.signum() == gain.signum() && points.abs() >= 0.1)
            .map(|(_, text)| text)
            .collect();
        if reasons.is_empty() {
            return format!(
                "{:.1} points {verdict}, although neither the shared lines ({:+.1} points) nor the traffic above an infinite cache's ({:+.1} points) changed in that direction: the total traffic changed",
                gain.abs(),
                shared,
                headroom
            );
        }
        format!("{:.1} points {verdict}: {}", gain.abs(), reasons.join("; "))
    }
}
