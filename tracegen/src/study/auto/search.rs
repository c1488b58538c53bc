//! The search: each option alone, then the best with one more, as long as that pays.

use super::Budget;
use crate::study::rows::{Part, Row, Setting};
use serde::{Deserialize, Serialize};

/// What a combination costs and shows on the frames of the search.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Verdict {
    /// Frame time over the baseline's beside it, each frame's shortest.
    pub frame_time_ratio: f64,
    /// Median frame time.
    pub frame_s: f64,
    /// The worst frame's error, in the budget's unit.
    pub error: f64,
}

/// Whoever renders.
pub trait Judge {
    /// Its errors.
    type Error;

    /// Whether a combination can be rendered at all.
    fn can(&self, row: &Row) -> bool;

    /// Measures a combination that can be rendered.
    ///
    /// # Errors
    /// Its own.
    fn judge(&mut self, row: &Row) -> Result<Verdict, Self::Error>;

    /// Times the baseline, which comes first, and combinations that were judged, in turns, more often and as
    /// exactly as can be: the ratio of each one's frame time to the baseline's.
    ///
    /// # Errors
    /// Its own.
    fn run_off(&mut self, rows: &[&Row]) -> Result<Vec<f64>, Self::Error>;

    /// The same on frames of the path that the search did not see; none where there are none.
    ///
    /// # Errors
    /// Its own.
    fn run_off_elsewhere(&mut self, rows: &[&Row]) -> Result<Option<Vec<f64>>, Self::Error>;
}

/// A combination that was tried.
#[derive(Clone, Debug)]
pub struct Tried {
    /// The combination.
    pub row: Row,
    /// What it costs and shows.
    pub verdict: Verdict,
}

/// What the search found.
#[derive(Clone, Debug)]
pub struct Found {
    /// The best combination.
    pub chosen: Tried,
    /// The best single technique that keeps the budget; the baseline where none is cheaper.
    pub best_single: Tried,
    /// Everything tried, in its order.
    pub tried: Vec<Tried>,
    /// How many were timed again, in turns; their verdicts hold those times.
    pub finalists: usize,
    /// The chosen combination and the best single technique on frames that the search did not see.
    pub elsewhere: Option<Elsewhere>,
}

/// Frame times over the baseline's on frames that the search did not see, all three in turns.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Elsewhere {
    /// Of the chosen combination.
    pub chosen: f64,
    /// Of the best single technique.
    pub best_single: f64,
    /// What was cheapest on the frames of the search was not here, and something simpler took its place.
    pub overruled: bool,
}

/// Nothing keeps the budget.
#[derive(Clone, Debug)]
pub struct Infeasible {
    /// What comes closest.
    pub closest: Box<Tried>,
}

/// A combination must save this share of the frame time to take the place of a simpler one: less
/// is noise.
const LEAST_GAIN: f64 = 0.01;
/// Single techniques and combinations that are timed again, each: what one timing tells apart is less
/// than what separates the best.
const FINALISTS: usize = 4;
/// An option that alone costs more than this over the baseline is not tried with others.
const WORST_ALONE: f64 = 1.10;

/// The best combination of `options` under a budget: alone, then the cheapest with one more option
/// (or another one of the same kind) as long as that saves time; the cheapest few single ones and
/// combinations are then timed again, in turns; what wins must win on frames that the search did not see, too, or
/// gives way to the best single technique, and that to the baseline. Where time is bounded, errors are added only
/// as long as the time is not kept.
///
/// # Errors
/// The judge's; the inner result tells where nothing keeps the budget.
pub fn search<J: Judge>(
    judge: &mut J,
    options: &[Part],
    budget: Budget,
) -> Result<Result<Found, Infeasible>, J::Error> {
    let mut search = Search {
        judge,
        tried: Vec::new(),
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
    alone.sort_by(|a, b| {
        let ratio = |t: &Tried| t.verdict.frame_time_ratio;
        ratio(a)
            .total_cmp(&ratio(b))
            .then_with(|| a.row.name.cmp(&b.row.name))
    });
    let best_single = match alone.first() {
        Some(first) if saves(first, &baseline) => first.clone(),
        _ => baseline.clone(),
    };
    alone.retain(|tried| tried.verdict.frame_time_ratio <= WORST_ALONE);
    match budget {
        Budget::Flip(_) | Budget::Pixels(_) => {
            search.descend(best_single, &alone, fits_error)?;
            search.decide(fits_error).map(Ok)
        }
        Budget::BudgetMs(limit_ms) => {
            let limit_s = limit_ms / 1e3;
            let fits = |tried: &Tried| tried.verdict.frame_s <= limit_s;
            let (free, lossy): (Vec<Tried>, Vec<Tried>) =
                alone.into_iter().partition(|tried| tried.row.lossless);
            let mut chosen = search.descend(baseline, &free, |_| true)?;
            if !fits(&chosen) {
                chosen = search.least_error(chosen, &lossy, fits)?;
            }
            if !fits(&chosen) {
                return Ok(Err(Infeasible {
                    closest: Box::new(chosen),
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

    /// Takes each option (cheapest alone first) that makes the best so far cheaper, until none does.
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
                if fits(&candidate) && saves(&candidate, &best) {
                    best = candidate;
                    improved = true;
                }
            }
            if !improved {
                return Ok(best);
            }
        }
    }

    /// Times the cheapest of what was tried and fits again, in turns: the cheapest is chosen, and of those
    /// that are as cheap the one of fewest parts.
    fn decide(mut self, fits: impl Fn(&Tried) -> bool) -> Result<Found, J::Error> {
        let baseline = Row::baseline().settings;
        let mut cheapest: Vec<usize> = (0..self.tried.len())
            .filter(|&i| self.tried[i].row.settings != baseline && fits(&self.tried[i]))
            .collect();
        let ratio = |tried: &Tried| tried.verdict.frame_time_ratio;
        cheapest.sort_by(|&a, &b| ratio(&self.tried[a]).total_cmp(&ratio(&self.tried[b])));
        let (single, combined): (Vec<usize>, Vec<usize>) =
            (cheapest.into_iter()).partition(|&i| self.tried[i].row.parts.len() == 1);
        let few = |all: Vec<usize>| all.into_iter().take(FINALISTS);
        // What was tried first is the baseline.
        let finalists: Vec<usize> = [0]
            .into_iter()
            .chain(few(single))
            .chain(few(combined))
            .collect();
        let rows: Vec<&Row> = finalists.iter().map(|&i| &self.tried[i].row).collect();
        let ratios = self.judge.run_off(&rows)?;
        for (&finalist, ratio) in finalists.iter().zip(ratios) {
            let verdict = &mut self.tried[finalist].verdict;
            verdict.frame_s *= ratio / verdict.frame_time_ratio;
            verdict.frame_time_ratio = ratio;
        }
        // Simple ones first: a combination must save something over them to take their place.
        let mut in_turn = finalists.clone();
        in_turn.sort_by_key(|&i| (i != 0, self.tried[i].row.parts.len()));
        let best_of = |most_parts: usize| {
            let mut best = &self.tried[0];
            for &i in &in_turn {
                let tried = &self.tried[i];
                let as_simple =
                    tried.row.parts.len() == best.row.parts.len() && best.row.settings != baseline;
                let cheaper = match as_simple {
                    true => ratio(tried) < ratio(best),
                    false => saves(tried, best),
                };
                if tried.row.parts.len() <= most_parts && cheaper {
                    best = tried;
                }
            }
            best.clone()
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
            let overruled = winner > single || single > 1.0;
            if single > 1.0 {
                (single, best_single) = (1.0, self.tried[0].clone());
            }
            if winner > single {
                (winner, chosen) = (single, best_single.clone());
            }
            Elsewhere {
                chosen: winner,
                best_single: single,
                overruled,
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

    /// Adds the option that keeps the time with the least error, or, where none does, the one that
    /// comes closest, and goes on from there.
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
            let time = |(_, t): &(Setting, Tried)| t.verdict.frame_s;
            let fastest = candidates
                .into_iter()
                .min_by(|a, b| time(a).total_cmp(&time(b)));
            let Some((taken, fastest)) = fastest.filter(|(_, fastest)| saves(fastest, &best))
            else {
                return Ok(best);
            };
            open.retain(|setting| *setting != taken);
            best = fastest;
        }
        Ok(best)
    }

    /// `row` with more parts, in the place of those that they exclude; none where nothing changes or
    /// it cannot be rendered.
    fn with(&self, row: &Row, parts: &[Part]) -> Option<Row> {
        let replaced = |part: &&Part| parts.iter().any(|new| new.setting() == part.setting());
        let kept = row.parts.iter().filter(|part| !replaced(part));
        // The baseline is what is there without any part.
        let baseline = Row::baseline().parts;
        let kept = kept.filter(|part| !baseline.contains(part)).cloned();
        let all: Vec<Part> = kept.chain(parts.iter().cloned()).collect();
        let new = Row::of(all).ok()?;
        (new.settings != row.settings && self.judge.can(&new)).then_some(new)
    }
}

fn saves(a: &Tried, b: &Tried) -> bool {
    a.verdict.frame_time_ratio < b.verdict.frame_time_ratio * (1.0 - LEAST_GAIN)
}
