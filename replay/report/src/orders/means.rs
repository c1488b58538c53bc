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
    /// Morton's rows, if it was replayed.
    morton: Vec<&'a OrderRow<'a>>,
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

    /// The open rows, each with Morton's of the same trace and caches.
    fn beside_morton(&self) -> impl Iterator<Item = [&'a OrderRow<'a>; 2]> + '_ {
        let same = |a: &OrderRow<'_>, b: &OrderRow<'_>| {
            let sizes = |row: &OrderRow<'_>| {
                let level = &row.config.level;
                [level.l1.size_bytes, level.l2.size_bytes]
            };
            std::ptr::eq(a.subject, b.subject) && sizes(a) == sizes(b)
        };
        let twin = move |row| self.morton.iter().find(|morton| same(row, morton));
        self.open().filter_map(move |row| Some([row, *twin(row)?]))
    }

    /// Change of the bytes relative to Morton order, percent, with ends as those of [`Self::change`]; none if it was
    /// not replayed.
    pub fn over_morton(&self) -> Option<Figure> {
        let ratio = |[own, morton]: [f64; 2]| own / morton;
        let of_rows =
            |[own, morton]: [&OrderRow<'_>; 2]| Some(ratio([own.ratio()?, morton.ratio()?]));
        let value = geometric(self.beside_morton().filter_map(of_rows)).map(change_pct)?;
        let corners = self.beside_morton().map(|rows| {
            let [own, morton] = rows.map(|row| row.corners.as_ref());
            Some([own?, morton?])
        });
        let corners: Vec<_> = corners.collect::<Option<_>>().unwrap_or_default();
        let Some([first, _]) = corners.first() else {
            return Some(Figure::exact(value));
        };
        let at = |index: usize| {
            let ratios = corners.iter().map(|[own, morton]| {
                ratio([own, morton].map(|of| of.bytes[index][0].max(1) as f64))
            });
            geometric(ratios).map(change_pct)
        };
        let means = (0..first.bytes.len()).filter_map(at);
        Some(Figure::bounded(value, means, first.over.clone()))
    }

    /// Least and most change: over the corners of the machine's ranges, or else over the rows. Against Morton if it
    /// was replayed, else against the baseline.
    pub fn range_pct(&self) -> Option<[f64; 2]> {
        let over_morton = self.over_morton();
        let against_morton = over_morton.is_some();
        let change = over_morton.or_else(|| self.change())?;
        if !matches!(change.because, Because::Exact) {
            return Some([change.low, change.high]);
        }
        let ratios: Vec<f64> = match against_morton {
            true => (self.beside_morton())
                .filter_map(|[own, morton]| Some(own.ratio()? / morton.ratio()?))
                .collect(),
            false => self.open().filter_map(OrderRow::ratio).collect(),
        };
        let changes = || ratios.iter().copied().map(change_pct);
        Some([
            changes().min_by(f64::total_cmp)?,
            changes().max_by(f64::total_cmp)?,
        ])
    }

    /// Whether it was replayed over the ranges of a machine.
    pub fn has_corners(&self) -> bool {
        self.rows.iter().any(|row| row.corners.is_some())
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
                morton: Vec::new(),
            }),
        }
    }
    let is_morton = |of: &&Mean<'_>| of.name() == Order::MORTON.name();
    let mortons: Vec<Mean<'a>> = means.iter().filter(is_morton).cloned().collect();
    for mean in &mut means {
        let own = mortons.iter().find(|of| of.between == mean.between);
        mean.morton = own.map_or_else(Vec::new, |of| of.rows.clone());
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
