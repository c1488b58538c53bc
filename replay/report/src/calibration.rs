//! Results of a calibration (`replay.calibration/2`): the error of each setting on the scenes it was chosen
//! on and on the others.

use super::columns::{Column, Columns, Row, columns_of};
use super::document::Document;
use super::lists::least;
use super::table::{Style, Table};
use serde::Serialize;
use sim::config::RunConfig;
use studies::experiment::{Objective, SceneFit, Setting, Trial, plain};

/// A calibration: every trial, and the index of the chosen one.
#[derive(Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct CalibrationReport {
    base: RunConfig,
    objective: Objective,
    /// Index of the best trial on the scenes used for choosing.
    chosen: Option<usize>,
    trials: Vec<Trial>,
}

fn title(settings: &[Setting]) -> String {
    let parts = settings
        .iter()
        .map(|(key, value)| format!("{key}={}", plain(value)));
    parts.collect::<Vec<_>>().join(" ")
}

impl Row for Trial {
    #[rustfmt::skip]
    fn columns() -> Vec<Column<'static, Self>> {
        columns_of::<Self>()
            .text("settings", "settings", |t| title(&t.settings))
            .real("chosen_by", "scenes that choose", "RMS", 3, |t| t.chosen_by)
            .real("held_out", "held out", "RMS", 3, |t| t.held_out)
    }
}

impl Row for SceneFit {
    #[rustfmt::skip]
    fn columns() -> Vec<Column<'static, Self>> {
        columns_of::<Self>()
            .text("scene", "scene", |f| f.scene.clone())
            .text("held_out", "", |f| if f.held_out { "held out" } else { "chooses" })
            .real("surface", "surface", "points", 2, |f| f.surface_points)
            .real("l1", "L1", "points", 2, |f| Some(f.table?.l1_points))
            .real("l2", "L2", "points", 2, |f| Some(f.table?.l2_points))
            .real("tmu", "TMU", "points", 2, |f| f.table?.tmu_points)
            .real("saved", "saved", "points", 2, |f| Some(f.table?.saved_points))
            .real("slope", "slope", "", 3, |f| Some(f.table?.slope))
            .real("total", "all parts", "of the table's spread", 3, |f| Some(f.table?.total))
    }
}

impl CalibrationReport {
    /// Chooses the best trial.
    pub fn new(base: RunConfig, objective: Objective, trials: Vec<Trial>) -> Self {
        let chosen = least(trials.iter().map(|trial| trial.chosen_by));
        Self {
            base,
            objective,
            chosen,
            trials,
        }
    }
}

impl Document for CalibrationReport {
    const SCHEMA: &'static str = "replay.calibration/2";

    fn content(&self) -> impl Serialize {
        self
    }

    fn rows(&self) -> Table {
        Table::new(&Trial::columns(), &self.trials)
    }

    /// The trials, best first, and the figures of the chosen one by scene.
    fn text(&self, style: Style) -> String {
        let mut trials: Vec<&Trial> = self.trials.iter().collect();
        let rank = |trial: &Trial| trial.chosen_by.unwrap_or(f64::MAX);
        trials.sort_by(|a, b| rank(a).total_cmp(&rank(b)));
        let mut text = Table::new(&Trial::columns(), trials).styled(style);
        if let Some(chosen) = self.chosen.and_then(|index| self.trials.get(index)) {
            let scenes = Table::new(&SceneFit::columns(), &chosen.scenes);
            text += &format!(
                "\n{}: found by search among {}\n{}",
                title(&chosen.settings),
                self.trials.len(),
                scenes.without_empty_columns().styled(style)
            );
        }
        let best = |of: fn(&Trial) -> Option<f64>| {
            let values = self.trials.iter().filter_map(of);
            values.min_by(f64::total_cmp)
        };
        let chosen = self.chosen.and_then(|index| self.trials[index].held_out);
        if let (Some(chosen), Some(best)) = (chosen, best(|trial| trial.held_out)) {
            text += &format!(
                "\non the held-out scenes: {chosen:.3} with these settings, {best:.3} with the best settings for those scenes\n"
            );
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trial(value: i64, chosen_by: f64, held_out: f64) -> Trial {
        Trial {
            settings: vec![("tmu.loop_cycles".to_owned(), toml::Value::Integer(value))],
            scenes: Vec::new(),
            chosen_by: Some(chosen_by),
            held_out: Some(held_out),
        }
    }

    #[test]
    fn the_best_trial_on_the_calibration_scenes_is_chosen_and_the_best_on_the_held_out_scenes_is_printed()
     {
        let trials = vec![trial(20, 2.0, 1.0), trial(24, 1.5, 3.0)];
        let report = CalibrationReport::new(RunConfig::default(), Objective::Surface, trials);
        assert_eq!(report.chosen, Some(1));
        let text = report.text(Style::Terminal);
        assert!(
            text.contains("tmu.loop_cycles=24: found by search among 2"),
            "{text}"
        );
        assert!(
            text.contains("3.000 with these settings, 1.000 with the best"),
            "{text}"
        );
    }
}
