//! The search and the guard with synthetic costs and errors.

use super::search::{Cost, Found, Infeasible, Judge, Spread, Tried, Verdict};
use super::*;
use crate::study::rows::{Part, Row};
use formats::view::Hmd;
use std::convert::Infallible;

/// Costs of parts multiply, their errors add up.
struct Made<'a> {
    parts: &'a [(&'a str, f64, f64)],
    /// Error of a single timing: name and factor.
    noise: &'a [(&'a str, f64)],
    /// Factor of costs on frames that the search does not measure.
    elsewhere: &'a [(&'a str, f64)],
    /// Half of the interquartile range of repeated timings.
    half_spread: f64,
    /// Of a combination that can be rendered.
    most_parts: usize,
    judged: usize,
    ran_off: Vec<String>,
}

impl Made<'_> {
    fn spread(&self, median: f64) -> Spread {
        Spread {
            q1: median - self.half_spread,
            median,
            q3: median + self.half_spread,
        }
    }

    fn cost(&self, row: &Row) -> f64 {
        let known = |part: &Part| self.parts.iter().find(|(name, ..)| *name == part.name);
        row.parts
            .iter()
            .filter_map(known)
            .map(|(_, cost, _)| cost)
            .product()
    }
}

impl Judge for Made<'_> {
    type Error = Infallible;

    fn can(&self, row: &Row) -> bool {
        row.parts.len() <= self.most_parts && row.settings.check(&Hmd::default()).is_ok()
    }

    fn judge(&mut self, row: &Row) -> Result<Verdict, Infallible> {
        self.judged += 1;
        let known = |part: &Part| self.parts.iter().find(|(name, ..)| *name == part.name);
        let errors = row.parts.iter().filter_map(known).map(|(.., error)| error);
        let noise = self.noise.iter().find(|(name, _)| *name == row.name);
        let ratio = self.cost(row) * noise.map_or(1.0, |(_, factor)| *factor);
        let per_frame = 0.1 * ratio;
        Ok(Verdict {
            cost: Some(Cost {
                ratio,
                per_frame,
                spread: None,
            }),
            error: errors.sum(),
        })
    }

    fn run_off(&mut self, rows: &[&Row]) -> Result<Vec<Spread>, Infallible> {
        assert_eq!(rows[0].settings, Row::baseline().settings);
        self.ran_off = rows.iter().map(|row| row.name.clone()).collect();
        Ok(rows.iter().map(|row| self.spread(self.cost(row))).collect())
    }

    fn run_off_elsewhere(&mut self, rows: &[&Row]) -> Result<Option<Vec<Spread>>, Infallible> {
        assert_eq!(rows[0].settings, Row::baseline().settings);
        let factor = |row: &Row| {
            let known = self.elsewhere.iter().find(|(name, _)| *name == row.name);
            known.map_or(1.0, |(_, factor)| *factor)
        };
        let times = rows
            .iter()
            .map(|row| self.spread(self.cost(row) * factor(row)));
        Ok(Some(times.collect()))
    }
}

fn part(name: &str) -> Part {
    Part::options(&Hmd::default())
        .into_iter()
        .find(|part| part.name == name)
        .unwrap()
}

fn found(parts: &[(&str, f64, f64)], budget: Budget) -> Result<Found, Infeasible> {
    found_in_noise(parts, &[], &[], budget)
}

fn found_by_counts(parts: &[(&str, f64, f64)], budget: Budget) -> Found {
    found_of_many(parts, 2, budget)
}

fn found_of_many(parts: &[(&str, f64, f64)], most_parts: usize, budget: Budget) -> Found {
    let options: Vec<Part> = parts.iter().map(|(name, ..)| part(name)).collect();
    let mut made = Made {
        parts,
        noise: &[],
        elsewhere: &[],
        half_spread: 0.0,
        most_parts,
        judged: 0,
        ran_off: Vec::new(),
    };
    let combinations = Row::combinations();
    let found = search(&mut made, &options, &combinations, budget, Objective::Bytes).unwrap();
    assert!(made.ran_off.is_empty(), "counts need no second look");
    found.unwrap()
}

fn found_in_noise(
    parts: &[(&str, f64, f64)],
    noise: &[(&str, f64)],
    elsewhere: &[(&str, f64)],
    budget: Budget,
) -> Result<Found, Infeasible> {
    let options: Vec<Part> = parts.iter().map(|(name, ..)| part(name)).collect();
    let mut made = Made {
        parts,
        noise,
        elsewhere,
        half_spread: 0.004,
        most_parts: 2,
        judged: 0,
        ran_off: Vec::new(),
    };
    let found = search(&mut made, &options, &[], budget, Objective::Time).unwrap();
    if let Ok(found) = &found {
        assert_eq!(found.tried.len(), made.judged, "nothing is judged twice");
        assert_eq!(found.finalists, made.ran_off.len());
    }
    found
}

const COSTS: &[(&str, f64, f64)] = &[
    ("superfrustum", 0.9, 0.0),
    ("conical", 0.95, 0.0),
    ("round-robin", 0.7, 0.02),
];

#[test]
fn the_cheapest_inside_the_error_budget_is_chosen_and_no_dearer_than_the_best_single() {
    let strict = found(COSTS, Budget::Flip(0.01)).unwrap();
    assert_eq!(strict.chosen.row.name, "superfrustum");
    assert_eq!(strict.best_single.row.name, "superfrustum");
    let loose = found(COSTS, Budget::Flip(0.03)).unwrap();
    assert_eq!(loose.chosen.row.name, "round-robin");
    // The whole budget may be used: no cheaper combination within it exists.
    let tight = found(COSTS, Budget::Flip(0.02)).unwrap();
    assert_eq!(tight.chosen.row.name, "round-robin");
    for found in [strict, loose, tight] {
        let cost = Tried::ratio;
        assert!(cost(&found.chosen) <= cost(&found.best_single));
    }
}

#[test]
fn an_option_replaces_the_part_that_excludes_it() {
    let costs = [
        ("superfrustum", 0.99, 0.0),
        ("occlusion", 0.99, 0.0),
        ("multiview", 0.98, 0.0),
        ("hidden-area-mask", 0.7, 0.0),
        ("shading-reuse", 0.75, 0.005),
    ];
    // The cheapest listed combination has multiview, which cannot be rendered with shading reuse.
    let found = found_of_many(&costs, 4, Budget::Flip(0.01));
    assert_eq!(
        found.chosen.row.name,
        "superfrustum+occlusion+hidden-area-mask+shading-reuse"
    );
}

#[test]
fn counts_choose_the_cheapest_of_all_that_fit_however_little_it_saves() {
    let costs = [
        ("superfrustum", 0.999, 0.0),
        ("hidden-area-mask", 0.9, 0.0),
        ("far-field", 0.8, 0.02),
        ("foveation-rings", 0.5, 0.2),
    ];
    let found = found_by_counts(&costs, Budget::Flip(0.01));
    assert_eq!(found.chosen.row.parts.len(), 2, "{}", found.chosen.row.name);
    assert!((found.chosen.ratio() - 0.999 * 0.9).abs() < 1e-12);
    assert_eq!(found.best_single.row.name, "hidden-area-mask");
    // No tried combination that keeps the budget is cheaper, or as cheap with less error.
    for limit in [0.0, 0.01, 0.02, 0.2, 0.3] {
        let found = found_by_counts(&costs, Budget::Flip(limit));
        let of = |tried: &Tried| [tried.ratio(), tried.verdict.error];
        let [cost, error] = of(&found.chosen);
        for tried in &found.tried {
            let [other_cost, other_error] = of(tried);
            let fits = tried.row.lossless || other_error <= limit;
            let better = other_cost < cost || other_cost == cost && other_error < error;
            assert!(!(fits && better), "{limit}: {}", tried.row.name);
        }
    }
    // Among equal costs, the one with less error, then the simpler one.
    let equal = [("far-field", 0.8, 0.02), ("superfrustum", 0.8, 0.0)];
    let found = found_by_counts(&equal[..], Budget::Flip(0.001));
    assert_eq!(found.chosen.row.name, "superfrustum");
}

#[test]
fn what_a_single_timing_flatters_does_not_win() {
    // Round robin is no cheaper than the baseline, and the mask is; a single timing says the opposite.
    let costs = [
        ("round-robin", 1.0, 0.0),
        ("conical", 0.97, 0.0),
        ("hidden-area-mask", 0.9, 0.0),
    ];
    let noise = [("round-robin", 0.8), ("hidden-area-mask", 1.08)];
    let found = found_in_noise(&costs, &noise, &[], Budget::Flip(0.01)).unwrap();
    assert_eq!(found.best_single.row.name, "hidden-area-mask");
    assert!((found.best_single.ratio() - 0.9).abs() < 1e-12);
    let cost = Tried::ratio;
    assert!(cost(&found.chosen) <= cost(&found.best_single));
    // Times and their ratio are consistent.
    assert!((found.best_single.per_frame() - 0.09).abs() < 1e-12);
}

#[test]
fn what_wins_on_the_frames_of_the_search_alone_gives_way_to_something_simpler() {
    let costs = [("conical", 0.8, 0.0), ("hidden-area-mask", 0.9, 0.0)];
    let won = |elsewhere: &[(&str, f64)]| {
        let found = found_in_noise(&costs, &[], elsewhere, Budget::Flip(0.01)).unwrap();
        (found.chosen.row.name, found.elsewhere.unwrap())
    };
    let (combination, here) = won(&[]);
    assert!(
        combination.contains('+') && !here.overruled,
        "{combination}"
    );
    assert!(here.chosen.is_less(&here.best_single));
    let (single, here) = won(&[(&combination, 1.2)]);
    assert_eq!(single, "conical");
    assert!(here.overruled && here.chosen == here.best_single);
    // If a single technique wins the search, it is not timed against itself.
    let (single, here) = won(&[(&combination, 1.2), ("conical", 0.9)]);
    assert_eq!(single, "conical");
    assert!(here.chosen.median < 0.8 && here.chosen == here.best_single);
    let (none, here) = won(&[(&combination, 1.6), ("conical", 1.3)]);
    assert_eq!(none, Row::baseline().name);
    assert!(here.overruled && here.chosen.median == 1.0);
}

#[test]
fn a_combination_that_saves_nothing_over_a_part_of_it_is_not_chosen() {
    let costs = [("conical", 0.8, 0.0), ("hidden-area-mask", 0.999, 0.0)];
    let noise = [
        ("conical+hidden-area-mask", 0.9),
        ("hidden-area-mask+conical", 0.9),
    ];
    let found = found_in_noise(&costs, &noise, &[], Budget::Flip(0.01)).unwrap();
    assert_eq!(found.chosen.row.name, "conical");
}

#[test]
fn times_whose_quartiles_overlap_tell_nothing_apart() {
    let of = |values: &[f64]| Spread::of(values.to_vec());
    let [slow, fast, between] = [
        &[0.9, 0.9, 0.92, 0.95, 0.95],
        &[0.7, 0.8, 0.8, 0.85, 0.9],
        &[0.8, 0.8, 0.9, 0.9, 1.0],
    ]
    .map(|v| of(v));
    assert_eq!((fast.q1, fast.median, fast.q3), (0.8, 0.8, 0.85));
    assert!(fast.is_less(&slow) && !slow.is_less(&fast));
    assert!(!fast.is_less(&between) && !between.is_less(&slow));
    // 0.5 % are less than the interquartile range of 0.8 %, so the simpler one is chosen.
    let costs = [("conical", 0.8, 0.0), ("hidden-area-mask", 0.993, 0.0)];
    let found = found_in_noise(&costs, &[], &[], Budget::Flip(0.01)).unwrap();
    assert_eq!(found.chosen.row.name, "conical");
    let found = found_in_noise(&[("conical", 0.995, 0.0)], &[], &[], Budget::Flip(0.01)).unwrap();
    assert_eq!(found.chosen.row.name, Row::baseline().name);
}

#[test]
fn where_nothing_saves_time_the_baseline_stays() {
    let found = found(
        &[("superfrustum", 1.02, 0.0), ("conical", 0.995, 0.0)],
        Budget::Flip(0.5),
    );
    assert_eq!(found.unwrap().chosen.row.settings, Row::baseline().settings);
}

#[test]
fn a_time_budget_takes_no_error_it_does_not_need_and_tells_when_nothing_meets_it() {
    // The baseline takes 100 ms.
    let chosen = |ms| found(COSTS, Budget::FrameMs(ms)).map(|found| found.chosen.row.name);
    assert_eq!(chosen(95.0).unwrap(), "superfrustum");
    assert_eq!(chosen(80.0).unwrap(), "round-robin");
    let infeasible = chosen(50.0).unwrap_err();
    assert_eq!(infeasible.closest.row.name, "round-robin");
}

#[test]
fn a_frame_that_breaks_the_budget_falls_back_to_what_is_safer() {
    let chosen = Row::of(vec![part("round-robin")]).unwrap();
    let tried = [];
    let error = |row: &Row, frame: u32| -> Result<f64, Infallible> {
        assert_eq!(row.name, "round-robin");
        Ok(if frame == 2 { 0.05 } else { 0.004 })
    };
    let held = hold(&chosen, &tried, 4, 0.01, error).unwrap();
    assert_eq!(held.fallen_back(), [2]);
    assert_eq!(held.row(2).settings, Row::baseline().settings);
    assert_eq!(held.row(3).name, "round-robin");
    assert_eq!(held.errors, [0.004, 0.004, 0.0, 0.004]);
}

#[test]
fn budgets_are_read_and_nonsense_is_refused() {
    assert_eq!("flip=0.01".parse(), Ok(Budget::Flip(0.01)));
    assert_eq!("flip=0".parse(), Ok(Budget::Flip(0.0)));
    assert_eq!("flip=1".parse(), Ok(Budget::Flip(1.0)));
    assert_eq!("pixels=1".parse(), Ok(Budget::Pixels(1.0)));
    assert_eq!("budget-ms=11".parse(), Ok(Budget::FrameMs(11.0)));
    for text in [
        "",
        "flip",
        "flip=",
        "flip=2",
        "flip=1.01",
        "pixels=0",
        "flip=nan",
        "flip=-1",
        "ssim=0.9",
        "budget-ms=inf",
    ] {
        let error = text.parse::<Budget>().unwrap_err();
        assert!(
            error.contains("flip=ERROR") && error.contains(&format!("'{text}'")),
            "{error}"
        );
    }
}
