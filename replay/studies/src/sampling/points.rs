//! Orders and caches that a sample compares, with their counts by frame.

use super::cold::{Cold, cold, not_bounded};
use super::of::Of;
use super::run::Run;
use super::sample::{Aim, Sample};
use super::values::{FrameCounts, Series, by_frame};
use sim::config::{Order, RunConfig};
use sim::engine::ReplayError;
use sim::figure::Figure;
use sim::stream::TileSource;
use std::collections::BTreeMap;

/// Upper end of a ratio, over its value, from which on it counts as unbounded.
const MOST_TIMES: f64 = 10.0;

/// An order with a pair of caches.
pub struct Point {
    /// L1 and L2 in KiB, as in `16/256`.
    pub caches: String,
    /// The machine and the order.
    pub config: RunConfig,
    /// Counts by frame.
    pub values: Series,
    /// What each frame may have missed because of the frames before it.
    cold: BTreeMap<u32, Cold>,
}

/// Orders on machines that differ in their caches.
pub struct Points {
    /// By caches; of each, the baseline order first.
    pub points: Vec<Point>,
    orders: usize,
}

impl Points {
    /// `orders`, the baseline first, on `base` with each pair of L1 and L2 sizes in bytes.
    pub fn new(base: &RunConfig, orders: &[Order], caches_bytes: &[(u64, u64)]) -> Self {
        let point = |(l1, l2): (u64, u64), order| {
            let mut config = RunConfig { order, ..*base };
            (config.level.l1.size_bytes, config.level.l2.size_bytes) = (l1, l2);
            Point {
                caches: format!("{}/{}", l1 >> 10, l2 >> 10),
                config,
                values: Series::new(),
                cold: BTreeMap::new(),
            }
        };
        let of_caches = |&caches| orders.iter().map(move |&order| point(caches, order));
        Self {
            points: caches_bytes.iter().flat_map(of_caches).collect(),
            orders: orders.len(),
        }
    }

    /// Replays a trace, or some of its frames, and adds the counts of the frames, except for those that only fill the
    /// caches. `bounds_cold` also counts what frames may have missed because the frames before them are absent.
    ///
    /// # Errors
    /// An impossible configuration, or an unreadable trace.
    pub fn add(
        &mut self,
        trace: &dyn TileSource,
        wanted: Option<&[u32]>,
        bounds_cold: bool,
    ) -> Result<(), ReplayError> {
        let warm = &trace.tables().meta.warm_frames;
        let counts = |frame: &u32| match wanted {
            Some(wanted) => wanted.binary_search(frame).is_ok(),
            None => warm.binary_search(frame).is_err(),
        };
        let runs = wanted.map_or_else(|| Run::all(trace), |wanted| Run::around(trace, wanted));
        let configs: Vec<RunConfig> = self.points.iter().map(|point| point.config).collect();
        for (point, mut series) in self.points.iter_mut().zip(by_frame(&runs, &configs)?) {
            series.retain(|frame, _| counts(frame));
            point.values.extend(series);
            if bounds_cold && not_bounded(&point.config).is_none() {
                let mut of_frames = cold(&runs, &point.config)?;
                of_frames.retain(|frame, _| counts(frame));
                point.cold.extend(of_frames);
            }
        }
        Ok(())
    }

    /// The points whose figures are asked for, each with the baseline of its caches. A saving of the baseline is none.
    pub fn asked(&self, of: Of) -> impl Iterator<Item = [&Point; 2]> {
        let groups = self.points.chunks(self.orders);
        groups.flat_map(move |group| {
            let asked = &group[usize::from(of == Of::Saving)..];
            asked.iter().map(|point| [point, &group[0]])
        })
    }
}

/// The figure of a point.
pub fn aim<'p>(of: Of, [point, baseline]: [&'p Point; 2]) -> Aim<'p> {
    Aim {
        of,
        values: &point.values,
        baseline: &baseline.values,
    }
}

impl Point {
    /// The counts if every look-up that may have hit did.
    fn warmest(&self) -> Series {
        let less = |(frame, counts): (&u32, &FrameCounts)| {
            let cold = self.cold.get(frame).map_or(0, |cold| cold.l2_bytes);
            let external_bytes = counts.external_bytes.saturating_sub(cold);
            let counts = FrameCounts {
                external_bytes,
                ..*counts
            };
            (*frame, counts)
        };
        self.values.iter().map(less).collect()
    }

    /// Whether some L1 set was not full, so that the stream to the L2 is not known.
    fn has_cold_l1(&self) -> bool {
        let mut cold = self.values.keys().filter_map(|frame| self.cold.get(frame));
        cold.any(|cold| cold.l1_misses > 0)
    }
}

/// The lowest and the highest value of a figure for whatever the caches held before the captured frames.
///
/// # Errors
/// Why there is no such bound.
pub fn bounds(
    sample: &Sample<'_>,
    of: Of,
    [point, baseline]: [&Point; 2],
    sizes: &[usize],
) -> Result<Figure, &'static str> {
    if let Some(why) = not_bounded(&point.config) {
        return Err(why);
    }
    if !matches!(of, Of::Saving | Of::Bytes) {
        return Err("a figure other than bytes");
    }
    if point.has_cold_l1() || baseline.has_cold_l1() {
        return Err("the frames before do not fill the L1; raise --warm of tracegen raster");
    }
    let ratio = |values: &Series, baseline: &Series| {
        let aim = Aim {
            of,
            values,
            baseline,
        };
        sample.estimate(&aim, sizes).ratio
    };
    let value = ratio(&point.values, &baseline.values);
    let low = ratio(&point.warmest(), &baseline.values);
    let high = ratio(&point.values, &baseline.warmest());
    // If nearly all misses of the baseline may have been hits, the ratio has no upper end.
    if high > MOST_TIMES * value {
        return Err("the frames before do not fill the L2; raise --warm of tracegen raster");
    }
    let over = "whatever the caches held before".to_owned();
    Ok(Figure::bounded(value, [low, high], over))
}
