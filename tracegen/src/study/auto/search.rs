//! The search: each option alone, then the best combination with one more option, as long as the cost falls.

use super::{Budget, Objective};
use crate::study::rows::{Part, Row, Setting};
use serde::{Deserialize, Serialize};
use std::cmp::Ordering;

/// Cost and error of a combination on the frames of the search.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Verdict {
    /// Its cost; none if its error exceeded the budget before anything was counted.
    pub cost: Option<Cost>,
    /// The worst frame's error, in the budget's unit.
    pub error: f64,
}

/// A cost in the objective's unit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Cost {
    /// Relative to the baseline. Times are relative to baseline times measured alternately, by the shortest
    /// time of each frame.
    pub ratio: f64,
    /// Per frame: the mean of counts, the median of times in seconds.
    pub per_frame: f64,
    /// The spread of a time that was measured repeatedly.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spread: Option<Spread>,
}

/// Renders and measures combinations.
pub trait Judge {
    /// Its error type.
    type Error;

    /// Whether a combination can be rendered.
    fn can(&self, row: &Row) -> bool;

    /// Measures a combination that can be rendered.
    ///
    /// # Errors
    /// Rendering failed.
    fn judge(&mut self, row: &Row) -> Result<Verdict, Self::Error>;

    /// Times the baseline, which is the first, and judged combinations alternately, with more repetitions.
    /// Returns the ratio of each frame time to the baseline's, with its spread.
    ///
    /// # Errors
    /// Rendering failed.
    fn run_off(&mut self, rows: &[&Row]) -> Result<Vec<Spread>, Self::Error>;

    /// The same on frames of the path that the search did not measure; none if there are no such frames.
    ///
    /// # Errors
    /// Rendering failed.
    fn run_off_elsewhere(&mut self, rows: &[&Row]) -> Result<Option<Vec<Spread>>, Self::Error>;
}

/// A ratio of times that was measured repeatedly.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Spread {
    /// Lower quartile.
    pub q1: f64,
    /// Median.
    pub median: f64,
    /// Upper quartile.
    pub q3: f64,
}

impl Spread {
    /// The baseline relative to itself.
    pub const ONE: Self = Self {
        q1: 1.0,
        median: 1.0,
        q3: 1.0,
    };

    /// Quartiles of measured values.
    ///
    /// # Panics
    /// Without values.
    pub fn of(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        let last = values.len() - 1;
        let at = |quarter: usize| {
            let (whole, rest) = (quarter * last / 4, (quarter * last % 4) as f64 / 4.0);
            let next = values[(whole + 1).min(last)];
            values[whole] + rest * (next - values[whole])
        };
        Self {
            q1: at(1),
            median: at(2),
            q3: at(3),
        }
    }

    /// Whether it is less beyond noise: the quartiles do not overlap.
    pub fn is_less(&self, other: &Self) -> bool {
        self.q3 < other.q1
    }
}

/// A combination that was tried.
#[derive(Clone, Debug)]
pub struct Tried {
    /// The combination.
    pub row: Row,
    /// Cost and error.
    pub verdict: Verdict,
}

impl Tried {
    /// Its cost relative to the baseline's; infinite if it was not counted.
    pub fn ratio(&self) -> f64 {
        self.verdict.cost.map_or(f64::INFINITY, |cost| cost.ratio)
    }

    /// Its cost per frame; infinite if it was not counted.
    pub fn per_frame(&self) -> f64 {
        (self.verdict.cost).map_or(f64::INFINITY, |cost| cost.per_frame)
    }

    /// Ranks by counts, which are exact: the least cost, then the least error, the fewest parts, the name.
    fn by_count(&self, other: &Self) -> Ordering {
        let key = |tried: &Self| [tried.ratio(), tried.verdict.error];
        let [a, b] = [key(self), key(other)];
        (a[0].total_cmp(&b[0]))
            .then(a[1].total_cmp(&b[1]))
            .then(self.row.parts.len().cmp(&other.row.parts.len()))
            .then_with(|| self.row.name.cmp(&other.row.name))
    }
}

/// Result of the search.
#[derive(Clone, Debug)]
pub struct Found {
    /// The best combination.
    pub chosen: Tried,
    /// The best single technique that keeps the budget; the baseline if none is cheaper.
    pub best_single: Tried,
    /// All tried combinations, in order.
    pub tried: Vec<Tried>,
    /// Number of combinations that were timed again, alternately; their verdicts hold those times.
    pub finalists: usize,
    /// The chosen combination and the best single technique on frames that the search did not measure.
    pub elsewhere: Option<Elsewhere>,
}

/// Frame times relative to the baseline's on frames that the search did not measure, all three timed
/// alternately.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Elsewhere {
    /// Of the chosen combination.
    pub chosen: Spread,
    /// Of the best single technique.
    pub best_single: Spread,
    /// Whether the cheapest combination of the search was not the cheapest on these frames, so that a simpler
    /// one was chosen.
    pub overruled: bool,
}

/// No combination keeps the budget.
#[derive(Clone, Debug)]
pub struct Infeasible {
    /// The combination that comes closest.
    pub closest: Box<Tried>,
    /// The baseline.
    pub baseline: Box<Tried>,
}

/// A combination must save this share of the frame time to replace a simpler one; smaller differences are
/// noise.
const LEAST_GAIN: f64 = 0.01;
/// Number of single techniques and of combinations that are timed again, because one timing does not resolve
/// the differences between the best.
const FINALISTS: usize = 4;
/// An option that alone costs more than this factor of the baseline is not combined with others.
const WORST_ALONE: f64 = 1.10;

/// The best combination of `options` under a budget: each alone, then those of `combinations`, then the
/// cheapest with one more option (or another one of the same kind) as long as the cost falls. Counts are
/// exact and decide at once. Times are noisy: the cheapest few single techniques and combinations are timed
/// again, alternately. The winner must also win on frames that the search did not measure; otherwise the best
/// single technique is chosen, or else the baseline. Under a time budget, lossy options are added only while
/// the time is too long.
///
/// # Errors
/// Rendering failed; the inner result is an error if no combination keeps the budget.
pub fn search<J: Judge>(
    judge: &mut J,
    options: &[Part],
    combinations: &[Row],
    budget: Budget,
    objective: Objective,
) -> Result<Result<Found, Infeasible>, J::Error> {
    let least_gain = match objective {
        Objective::Time => LEAST_GAIN,
        _ => 0.0,
    };
    let mut search = Search {
        judge,
        tried: Vec::new(),
        least_gain,
    };
    let baseline = search.try_row(Row::baseline())?;
    let mut alone = Vec::new();
    for option in options {
        if let Some(row) = search.with(&baseline.row, std::slice::from_ref(option)) {
            alone.push(search.try_row(row)?);
        }
    }
    let fits_error = |tried: &Tried| match budget.error_limit() {
        Some(limit) => tried.row.lossless || tried.verdict.error <= limit,
        None => true,
    };
    alone.retain(fits_error);
    alone.sort_by(Tried::by_count);
    let best_single = match alone.first() {
        Some(first) if search.saves(first, &baseline) => first.clone(),
        _ => baseline.clone(),
    };
    if objective == Objective::Time {
        alone.retain(|tried| tried.ratio() <= WORST_ALONE);
    }
    match budget {
        Budget::Flip(_) | Budget::Pixels(_) => {
            for row in combinations {
                let allowed = row.parts.iter().all(|part| options.contains(part));
                if allowed && search.judge.can(row) {
                    search.try_row(row.clone())?;
                }
            }
            let start = (search.tried.iter().filter(|tried| fits_error(tried)))
                .min_by(|a, b| a.by_count(b))
                .filter(|best| objective != Objective::Time && search.saves(best, &best_single))
                .unwrap_or(&best_single)
                .clone();
            search.descend(start, &alone, fits_error)?;
            match objective {
                Objective::Time => search.decide(fits_error).map(Ok),
                _ => Ok(Ok(search.least(best_single, fits_error))),
            }
        }
        Budget::FrameMs(limit_ms) => {
            let limit_s = limit_ms / 1e3;
            let fits = |tried: &Tried| tried.per_frame() <= limit_s;
            let (free, lossy): (Vec<Tried>, Vec<Tried>) =
                alone.into_iter().partition(|tried| tried.row.lossless);
            let mut chosen = search.descend(baseline, &free, |_| true)?;
            if !fits(&chosen) {
                chosen = search.least_error(chosen, &lossy, fits)?;
            }
            if !fits(&chosen) {
                return Ok(Err(Infeasible {
                    closest: Box::new(chosen),
                    baseline: Box::new(search.tried[0].clone()),
                }));
            }
            let lossless = chosen.row.lossless || !fits(&best_single);
            if !lossless && best_single.verdict.error < chosen.verdict.error {
                chosen = best_single.clone();
            }
            Ok(Ok(Found {
                chosen,
                best_single,
                tried: search.tried,
                finalists: 0,
                elsewhere: None,
            }))
        }
    }
}

struct Search<'a, J> {
    judge: &'a mut J,
    tried: Vec<Tried>,
    /// Share of the cost that a combination must save to replace another.
    least_gain: f64,
}

impl<J: Judge> Search<'_, J> {
    fn try_row(&mut self, row: Row) -> Result<Tried, J::Error> {
        if let Some(known) = self.tried.iter().find(|t| t.row.settings == row.settings) {
            return Ok(known.clone());
        }
        let verdict = self.judge.judge(&row)?;
        let tried = Tried { row, verdict };
        self.tried.push(tried.clone());
        Ok(tried)
    }

    /// Adds each option (the cheapest alone first) that makes the best combination cheaper, until no option
    /// does.
    fn descend(
        &mut self,
        mut best: Tried,
        options: &[Tried],
        fits: impl Fn(&Tried) -> bool,
    ) -> Result<Tried, J::Error> {
        loop {
            let mut improved = false;
            for option in options {
                let Some(row) = self.with(&best.row, &option.row.parts) else {
                    continue;
                };
                let candidate = self.try_row(row)?;
                if fits(&candidate) && self.saves(&candidate, &best) {
                    best = candidate;
                    improved = true;
                }
            }
            if !improved {
                return Ok(best);
            }
        }
    }

    /// The cheapest of the tried combinations that keep the budget, by counts.
    fn least(self, best_single: Tried, fits: impl Fn(&Tried) -> bool) -> Found {
        let fitting = self.tried.iter().filter(|tried| fits(tried));
        let chosen = fitting.min_by(|a, b| a.by_count(b));
        Found {
            chosen: chosen.unwrap_or(&self.tried[0]).clone(),
            best_single,
            finalists: 0,
            elsewhere: None,
            tried: self.tried,
        }
    }

    fn saves(&self, a: &Tried, b: &Tried) -> bool {
        a.ratio() < b.ratio() * (1.0 - self.least_gain)
    }

    /// Times the cheapest of the tried combinations that keep the budget again, alternately. Chooses the
    /// cheapest, or the one with the fewest parts among equally cheap ones.
    fn decide(mut self, fits: impl Fn(&Tried) -> bool) -> Result<Found, J::Error> {
        let baseline = Row::baseline().settings;
        let mut cheapest: Vec<usize> = (0..self.tried.len())
            .filter(|&i| self.tried[i].row.settings != baseline && fits(&self.tried[i]))
            .collect();
        let ratio = Tried::ratio;
        cheapest.sort_by(|&a, &b| ratio(&self.tried[a]).total_cmp(&ratio(&self.tried[b])));
        let (single, combined): (Vec<usize>, Vec<usize>) =
            (cheapest.into_iter()).partition(|&i| self.tried[i].row.parts.len() == 1);
        let few = |all: Vec<usize>| all.into_iter().take(FINALISTS);
        // The baseline is tried first.
        let finalists: Vec<usize> = [0]
            .into_iter()
            .chain(few(single))
            .chain(few(combined))
            .collect();
        let rows: Vec<&Row> = finalists.iter().map(|&i| &self.tried[i].row).collect();
        let ratios = self.judge.run_off(&rows)?;
        for (&finalist, spread) in finalists.iter().zip(&ratios) {
            if let Some(cost) = &mut self.tried[finalist].verdict.cost {
                cost.per_frame *= spread.median / cost.ratio;
                cost.ratio = spread.median;
                cost.spread = Some(*spread);
            }
        }
        // Combinations whose quartiles overlap with the fastest one's are equally fast within noise, so the
        // simplest of them is chosen.
        let best_of = |most_parts: usize| {
            let parts = |i: usize| match self.tried[i].row.settings == baseline {
                true => 0,
                false => self.tried[i].row.parts.len(),
            };
            let simple = finalists.iter().copied().zip(&ratios);
            let simple = simple.filter(|(i, _)| parts(*i) <= most_parts);
            let fastest = simple.clone().map(|(_, spread)| spread);
            let fastest = fastest.min_by(|a, b| a.median.total_cmp(&b.median));
            let open = simple.filter(|(_, spread)| fastest.is_some_and(|f| !f.is_less(spread)));
            let best = open.min_by(|(a, of_a), (b, of_b)| {
                let by_time = of_a.median.total_cmp(&of_b.median);
                parts(*a).cmp(&parts(*b)).then(by_time)
            });
            self.tried[best.map_or(0, |(i, _)| i)].clone()
        };
        let (mut chosen, mut best_single) = (best_of(usize::MAX), best_of(1));
        let baseline = Row::baseline();
        let mut rows = vec![&baseline, &best_single.row];
        if chosen.row.settings != best_single.row.settings {
            rows.push(&chosen.row);
        }
        let times = self.judge.run_off_elsewhere(&rows)?;
        let elsewhere = times.map(|times| {
            let mut single = times[1];
            let mut winner = times.get(2).copied().unwrap_or(single);
            let is_baseline = best_single.row.settings == baseline.settings;
            let single_fails = !is_baseline && !single.is_less(&Spread::ONE);
            if single_fails {
                (single, best_single) = (Spread::ONE, self.tried[0].clone());
            }
            let is_single = times.len() < 3;
            let winner_fails = !is_single && !winner.is_less(&single) || is_single && single_fails;
            if winner_fails {
                (winner, chosen) = (single, best_single.clone());
            }
            Elsewhere {
                chosen: winner,
                best_single: single,
                overruled: single_fails || winner_fails,
            }
        });
        Ok(Found {
            chosen,
            best_single,
            finalists: finalists.len(),
            tried: self.tried,
            elsewhere,
        })
    }

    /// Adds the option that keeps the time with the least error or, if none does, the option that comes
    /// closest, and continues from there.
    fn least_error(
        &mut self,
        mut best: Tried,
        options: &[Tried],
        fits: impl Fn(&Tried) -> bool,
    ) -> Result<Tried, J::Error> {
        let mut open: Vec<Setting> = Vec::new();
        for option in options {
            let setting = option.row.parts[0].setting();
            if !open.contains(&setting) {
                open.push(setting);
            }
        }
        while !open.is_empty() {
            let mut candidates: Vec<(Setting, Tried)> = Vec::new();
            for option in options {
                let setting = option.row.parts[0].setting();
                if !open.contains(&setting) {
                    continue;
                }
                if let Some(row) = self.with(&best.row, &option.row.parts) {
                    candidates.push((setting, self.try_row(row)?));
                }
            }
            let kept = candidates
                .iter()
                .map(|(_, tried)| tried)
                .filter(|t| fits(t));
            let error = |t: &&Tried| t.verdict.error;
            if let Some(kept) = kept.min_by(|a, b| error(a).total_cmp(&error(b))) {
                return Ok(kept.clone());
            }
            let time = |(_, t): &(Setting, Tried)| t.per_frame();
            let fastest = candidates
                .into_iter()
                .min_by(|a, b| time(a).total_cmp(&time(b)));
            let Some((taken, fastest)) = fastest.filter(|(_, fastest)| self.saves(fastest, &best))
            else {
                return Ok(best);
            };
            open.retain(|setting| *setting != taken);
            best = fastest;
        }
        Ok(best)
    }

    /// `row` with more parts, which replace the parts that they exclude; none if nothing changes or it cannot
    /// be rendered.
    fn with(&self, row: &Row, parts: &[Part]) -> Option<Row> {
        // Parts of one setting cannot be joined, and other pairs cannot be rendered.
        let goes_with = |part: &Part, new: &Part| {
            let pair = Row::of(vec![part.clone(), new.clone()]);
            pair.is_ok_and(|pair| self.judge.can(&pair))
        };
        let replaced = |part: &&Part| !parts.iter().all(|new| goes_with(part, new));
        let kept = row.parts.iter().filter(|part| !replaced(part));
        // The baseline is the combination without parts.
        let baseline = Row::baseline().parts;
        let kept = kept.filter(|part| !baseline.contains(part)).cloned();
        let all: Vec<Part> = kept.chain(parts.iter().cloned()).collect();
        let new = Row::of(all).ok()?;
        (new.settings != row.settings && self.judge.can(&new)).then_some(new)
    }
}
