//! The search and the guard against made-up costs and errors.

use super::search::Tried;
use super::*;
use crate::study::rows::{Part, Row};
use std::convert::Infallible;

/// Costs and errors of parts multiply and add up.
struct Made<'a> {
    parts: &'a [(&'a str, f64, f64)],
    judged: usize,
}

impl Judge for Made<'_> {
    type Error = Infallible;

    fn can(&self, row: &Row) -> bool {
        row.parts.len() < 3
    }

    fn judge(&mut self, row: &Row) -> Result<Verdict, Infallible> {
        self.judged += 1;
        let mut verdict = Verdict {
            frame_time_ratio: 1.0,
            frame_s: 0.1,
            error: 0.0,
        };
        for part in &row.parts {
            let known = self.parts.iter().find(|(name, ..)| *name == part.name);
            if let Some((_, cost, error)) = known {
                verdict.frame_time_ratio *= cost;
                verdict.frame_s *= cost;
                verdict.error += error;
            }
        }
        Ok(verdict)
    }
}

fn part(name: &str) -> Part {
    Part::options()
        .into_iter()
        .find(|part| part.name == name)
        .unwrap()
}

fn found(parts: &[(&str, f64, f64)], budget: Budget) -> Result<Found, Infeasible> {
    let options: Vec<Part> = parts.iter().map(|(name, ..)| part(name)).collect();
    let mut made = Made { parts, judged: 0 };
    let found = search(&mut made, &options, budget).unwrap();
    if let Ok(found) = &found {
        assert_eq!(found.tried.len(), made.judged, "nothing is measured twice");
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
    // 0.02 is inside the budget, but not inside the share that the search keeps.
    let tight = found(COSTS, Budget::Flip(0.021)).unwrap();
    assert_eq!(tight.chosen.row.name, "superfrustum");
    for found in [strict, loose, tight] {
        let cost = |tried: &Tried| tried.verdict.frame_time_ratio;
        assert!(cost(&found.chosen) <= cost(&found.best_single));
    }
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
    let chosen = |ms| found(COSTS, Budget::BudgetMs(ms)).map(|found| found.chosen.row.name);
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
fn budgets_are_read_and_nonsense_is_told() {
    assert_eq!("flip=0.01".parse(), Ok(Budget::Flip(0.01)));
    assert_eq!("pixels=1".parse(), Ok(Budget::Pixels(1.0)));
    assert_eq!("budget-ms=11".parse(), Ok(Budget::BudgetMs(11.0)));
    for text in [
        "",
        "flip",
        "flip=",
        "flip=0",
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
