//! The result of a study for an order or a bound.

use crate::experiment::{Subject, frame_count};
use sim::config::{BetweenFrames, Order, RunConfig};
use sim::figure::Figure;
use sim::order::cost::Cost;
use sim::result::RunResult;
use std::collections::HashMap;

/// The order that all others are compared with: the best one of the Z2 paper.
pub const BASELINE: Order = Order::Z2_STA;

/// A lower bound, or the misses of optimal replacement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bound {
    /// Each distinct line once.
    Infinite,
    /// Windows of uses.
    Windows,
    /// OPT replacement in a fully associative L2 for the requests of this order.
    Opt(Order),
    /// OPT replacement with the L2's sets and ways.
    OptWays(Order),
}

impl Bound {
    /// Begins the name of every bound.
    pub(super) const PREFIX: &str = "bound: ";

    /// Name in the column of orders.
    pub fn name(self) -> String {
        match self {
            Self::Infinite => format!("{}infinite cache", Self::PREFIX),
            Self::Windows => format!("{}windows", Self::PREFIX),
            Self::Opt(order) => format!("{}OPT of {}", Self::PREFIX, order.name()),
            Self::OptWays(order) => format!("{}OPT by ways of {}", Self::PREFIX, order.name()),
        }
    }
}

/// The subject of a row.
#[derive(Clone, Debug)]
pub enum RowKind {
    /// An order.
    Order(Order),
    /// A searched order, by the method's name.
    Searched(String),
    /// A bound.
    Bound(Bound),
}

/// An order, or a bound, with caches on a trace.
#[derive(Clone)]
pub struct OrderRow<'a> {
    /// The trace.
    pub subject: &'a Subject<'a>,
    /// Columns by which points at infinity are shifted between the eyes.
    pub offset_tiles: i32,
    /// An order or a bound.
    pub of: RowKind,
    /// The whole configuration.
    pub config: RunConfig,
    /// The hardware cost; none for bounds.
    pub cost: Option<Cost>,
    /// Bytes from memory, all frames together.
    pub external_bytes: u64,
    /// The replay; none for bounds.
    pub result: Option<RunResult>,
    /// Bytes of the baseline with the same caches.
    pub baseline_bytes: u64,
    /// Cycles of the baseline, in timed mode.
    pub baseline_cycles: Option<u64>,
    /// Bytes of the greedy order with the same caches, if it was searched.
    pub greedy_bytes: Option<u64>,
    /// Bytes of the trace's distinct lines.
    pub distinct_bytes: u64,
    /// Bytes at the corners of a machine's ranges, if it has any.
    pub corners: Option<CornerBytes>,
}

/// Bytes of an order at the corners of a machine's ranges.
#[derive(Clone, Debug, Default)]
pub struct CornerBytes {
    /// The ranges in words.
    pub over: String,
    /// Bytes of the order and of the baseline at each corner.
    pub bytes: Vec<[u64; 2]>,
}

impl CornerBytes {
    /// Bytes relative to the baseline at each corner.
    pub fn ratios(&self) -> impl Iterator<Item = f64> + '_ {
        let of = |&[own, base]: &[u64; 2]| match base {
            0 => 1.0,
            base => own as f64 / base as f64,
        };
        self.bytes.iter().map(of)
    }
}

impl OrderRow<'_> {
    /// Name in tables.
    pub fn name(&self) -> String {
        match &self.of {
            RowKind::Order(order) => order.name().to_owned(),
            RowKind::Searched(method) => method.clone(),
            RowKind::Bound(bound) => bound.name(),
        }
    }

    pub(super) fn is_baseline(&self) -> bool {
        matches!(self.of, RowKind::Order(order) if order == BASELINE)
    }

    /// True if hardware can implement it.
    pub fn is_buildable(&self) -> bool {
        self.cost.is_some_and(|cost| cost.is_buildable())
    }

    /// Frames of the trace.
    pub fn frames(&self) -> u32 {
        frame_count(self.subject.source.tables())
    }

    /// Bytes relative to the baseline; none if only the baseline fetches nothing.
    pub fn ratio(&self) -> Option<f64> {
        match (self.external_bytes, self.baseline_bytes) {
            (0, 0) => Some(1.0),
            (_, 0) => None,
            (own, base) => Some(own as f64 / base as f64),
        }
    }

    /// Bytes relative to the baseline, percent. Its ends are the lowest and the highest value at the corners of the
    /// machine's ranges.
    pub fn change_pct(&self) -> Option<Figure> {
        let pct = |ratio: f64| 100.0 * (ratio - 1.0);
        let value = pct(self.ratio()?);
        Some(match &self.corners {
            None => Figure::exact(value),
            Some(corners) => {
                Figure::bounded(value, corners.ratios().map(pct), corners.over.clone())
            }
        })
    }

    /// Bytes per frame in MB, with ends as those of [`Self::change_pct`].
    pub fn megabytes(&self) -> Figure {
        match &self.corners {
            None => Figure::exact(self.mb_per_frame()),
            Some(corners) => {
                let per_frame = |bytes: u64| bytes as f64 / f64::from(self.frames().max(1)) / 1e6;
                let all = corners.bytes.iter().map(|[own, _]| per_frame(*own));
                Figure::bounded(self.mb_per_frame(), all, corners.over.clone())
            }
        }
    }

    /// Cycles over those of the baseline.
    pub fn cycles_ratio(&self) -> Option<f64> {
        let own = self.result.as_ref()?.cycles?;
        let base = self.baseline_cycles.filter(|cycles| *cycles > 0)?;
        Some(own as f64 / base as f64)
    }

    /// False if the baseline fetches each line once, so that no order can fetch less.
    pub fn can_change(&self) -> bool {
        self.baseline_bytes > self.distinct_bytes
    }

    /// Bytes per frame in MB.
    pub fn mb_per_frame(&self) -> f64 {
        self.external_bytes as f64 / f64::from(self.frames().max(1)) / 1e6
    }

    /// Name of the information that the order uses; `bound` for bounds.
    pub fn information(&self) -> &'static str {
        self.cost.map_or("bound", |cost| cost.information.name())
    }

    /// The part of the distance from the baseline to the greedy order that the order closes, percent.
    pub fn closed_pct(&self) -> Option<f64> {
        let greedy = self.greedy_bytes? as f64;
        let (own, base) = (self.external_bytes as f64, self.baseline_bytes as f64);
        (base > greedy).then(|| 100.0 * (base - own) / (base - greedy))
    }
}

/// A row of a replay.
pub(super) fn row<'a>(
    subject: &'a Subject<'a>,
    offset_tiles: i32,
    of: RowKind,
    config: RunConfig,
    result: RunResult,
) -> OrderRow<'a> {
    let passes = &subject.source.tables().passes;
    let tiles = passes
        .iter()
        .filter(|pass| pass.is_seen())
        .map(|pass| pass.tiles);
    let largest = tiles
        .max_by_key(|[columns, rows]| columns * rows)
        .unwrap_or_default();
    OrderRow {
        subject,
        offset_tiles,
        of,
        cost: Some(config.order.cost(largest, config.cores)),
        config,
        external_bytes: result.external_bytes,
        distinct_bytes: result.unique_lines * u64::from(config.line_bytes),
        result: Some(result),
        baseline_bytes: 0,
        baseline_cycles: None,
        greedy_bytes: None,
        corners: None,
    }
}

/// Fills in the values that each row is compared with.
pub(super) fn compare(rows: &mut [OrderRow<'_>]) {
    type Caches = (BetweenFrames, u64, u64);
    let caches = |row: &OrderRow<'_>| -> Caches {
        let config = &row.config;
        (
            config.between_frames,
            config.level.l1.size_bytes,
            config.level.l2.size_bytes,
        )
    };
    let mut baseline: HashMap<Caches, (u64, Option<u64>)> = HashMap::new();
    let mut greedy: HashMap<Caches, u64> = HashMap::new();
    for row in rows.iter() {
        let cycles = row.result.as_ref().and_then(|result| result.cycles);
        match &row.of {
            RowKind::Order(order) if *order == BASELINE => {
                baseline.insert(caches(row), (row.external_bytes, cycles));
            }
            RowKind::Searched(name) if name == "greedy" => {
                greedy.insert(caches(row), row.external_bytes);
            }
            _ => {}
        }
    }
    for row in rows {
        let of = caches(row);
        let (bytes, cycles) = baseline.get(&of).copied().unwrap_or_default();
        (row.baseline_bytes, row.baseline_cycles) = (bytes, cycles);
        row.greedy_bytes = greedy.get(&of).copied();
    }
}
