//! Means of an order over traces and caches.

use crate::lists::{geometric_mean, mean, unique};
use sim::config::{BetweenFrames, Order};
use sim::figure::{Because, Figure};
use sim::order::cost::Cost;
use studies::orders_study::OrderRow;

/// An order over all traces and caches.
#[derive(Clone)]
pub struct Mean<'a> {
    /// What happens to caches between frames.
    pub between: BetweenFrames,
    /// All rows of the order.
    pub rows: Vec<&'a OrderRow<'a>>,
    /// Morton's change over the same rows, percent.
    morton_pct: Option<f64>,
}

/// Geometric mean; none without values, or if a value is not positive.
fn geometric(ratios: impl Iterator<Item = f64>) -> Option<f64> {
    let ratios: Vec<f64> = ratios.collect();
    let is_positive = ratios.iter().all(|ratio| *ratio > 0.0);
    geometric_mean(ratios).filter(|_| is_positive)
}

fn change_pct(ratio: f64) -> f64 {
    100.0 * (ratio - 1.0)
}

impl<'a> Mean<'a> {
    /// The order's or bound's name.
    pub fn name(&self) -> String {
        self.rows.first().map(|row| row.name()).unwrap_or_default()
    }

    /// The rows in which an order can change the bytes; all rows if there are none.
    fn open(&self) -> impl Iterator<Item = &'a OrderRow<'a>> + '_ {
        let all = self.count() == 0;
        self.rows
            .iter()
            .copied()
            .filter(move |row| all || row.can_change())
    }

    /// Number of rows in which an order can change the bytes.
    pub fn count(&self) -> u64 {
        let open = self.rows.iter().filter(|row| row.can_change());
        open.count() as u64
    }

    /// Change of the bytes relative to the baseline, percent.
    pub fn change_pct(&self) -> Option<f64> {
        geometric(self.open().filter_map(OrderRow::ratio)).map(change_pct)
    }

    /// The same, with the lowest and the highest mean at a corner of the machine's ranges.
    pub fn change(&self) -> Option<Figure> {
        let value = self.change_pct()?;
        let corners: Option<Vec<_>> = self.open().map(|row| row.corners.as_ref()).collect();
        let corners = corners.unwrap_or_default();
        let Some(first) = corners.first() else {
            return Some(Figure::exact(value));
        };
        let at = |index| {
            let ratios = corners.iter().filter_map(move |of| of.ratios().nth(index));
            geometric(ratios).map(change_pct)
        };
        let means = (0..first.bytes.len()).filter_map(at);
        Some(Figure::bounded(value, means, first.over.clone()))
    }

    /// Change of the bytes relative to Morton order, percent; none if it was not replayed.
    pub fn over_morton_pct(&self) -> Option<f64> {
        let ratio = |pct: f64| 1.0 + pct / 100.0;
        Some(change_pct(
            ratio(self.change_pct()?) / ratio(self.morton_pct?),
        ))
    }

    /// Least and most change: over the corners of the machine's ranges, or else over the rows.
    pub fn range_pct(&self) -> Option<[f64; 2]> {
        let change = self.change()?;
        if !matches!(change.because, Because::Exact) {
            return Some([change.low, change.high]);
        }
        let changes = || self.open().filter_map(OrderRow::ratio).map(change_pct);
        Some([
            changes().min_by(f64::total_cmp)?,
            changes().max_by(f64::total_cmp)?,
        ])
    }

    /// Change of the cycles relative to the baseline, percent.
    pub fn cycles_change_pct(&self) -> Option<f64> {
        geometric(self.open().filter_map(OrderRow::cycles_ratio)).map(change_pct)
    }

    /// The trace with the worst mean over caches, and its change.
    pub fn worst_trace(&self) -> Option<(&'a str, f64)> {
        let mut traces: Vec<(&str, Vec<f64>)> = Vec::new();
        for row in self.open() {
            let Some(ratio) = row.ratio() else { continue };
            match traces
                .last_mut()
                .filter(|(label, _)| *label == row.subject.label)
            {
                Some((_, ratios)) => ratios.push(ratio),
                None => traces.push((&row.subject.label, vec![ratio])),
            }
        }
        let changes = traces.into_iter().filter_map(|(label, ratios)| {
            Some((label, change_pct(geometric(ratios.into_iter())?)))
        });
        changes.max_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// The worst change of any trace with any pair of caches.
    pub fn worst_pct(&self) -> Option<f64> {
        let changes = self.open().filter_map(OrderRow::ratio).map(change_pct);
        changes.max_by(f64::total_cmp)
    }

    /// The part of the distance to the greedy order that the order closes, by geometric means.
    pub fn closed_pct(&self) -> Option<f64> {
        let known = || self.open().filter(|row| row.greedy_bytes.is_some());
        let own = geometric(known().filter_map(OrderRow::ratio))?;
        let greedy =
            |row: &OrderRow<'_>| Some(row.greedy_bytes? as f64 / row.baseline_bytes as f64);
        let greedy = geometric(known().filter_map(greedy))?;
        (greedy < 1.0).then(|| 100.0 * own.ln() / greedy.ln())
    }

    /// Mean of a rate over the replays, percent.
    pub fn rate_pct(&self, rate: fn(&OrderRow<'_>) -> Option<f64>) -> Option<f64> {
        mean(self.open().filter_map(rate)).map(|rate| 100.0 * rate)
    }

    /// The largest hardware cost of any row; none for bounds.
    pub fn cost(&self) -> Option<Cost> {
        let costs = self.rows.iter().filter_map(|row| row.cost);
        costs.max_by_key(|cost| (cost.information, cost.state_bytes, cost.table_bytes))
    }
}

/// The means by order and by what happens between frames, fewest bytes first.
pub fn means<'a>(rows: &'a [OrderRow<'a>]) -> Vec<Mean<'a>> {
    let mut means: Vec<Mean<'a>> = Vec::new();
    let betweens = unique(rows.iter().map(|row| row.config.between_frames));
    for row in rows {
        let between = row.config.between_frames;
        let name = row.name();
        let known = means
            .iter_mut()
            .find(|of| of.between == between && of.name() == name);
        match known {
            Some(mean) => mean.rows.push(row),
            None => means.push(Mean {
                between,
                rows: vec![row],
                morton_pct: None,
            }),
        }
    }
    let morton = |between| {
        let mut orders = means.iter().filter(|of: &&Mean<'_>| of.between == between);
        orders
            .find(|of| of.name() == Order::MORTON.name())?
            .change_pct()
    };
    let mortons: Vec<_> = betweens
        .iter()
        .map(|between| (*between, morton(*between)))
        .collect();
    for mean in &mut means {
        let own = mortons.iter().find(|(between, _)| *between == mean.between);
        mean.morton_pct = own.and_then(|(_, pct)| *pct);
    }
    let place = |of: &Mean<'_>| betweens.iter().position(|between| *between == of.between);
    means.sort_by(|a, b| {
        let change = |of: &Mean<'_>| of.change_pct().unwrap_or(0.0);
        place(a)
            .cmp(&place(b))
            .then(change(a).total_cmp(&change(b)))
    });
    means
}
