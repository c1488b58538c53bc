//! Settings tried on some scenes and judged on others.

use super::{Outcome, Plan, ResultRow, Setting};
use crate::paper::score::{Measured, Score, score};
use crate::paper::z2;
use crate::tmu::closed_form;
use serde::Serialize;

/// What a setting is chosen by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Objective {
    /// Distance of the utilisation from the one that the Z2 paper's table implies for the machine's
    /// own rates: for any scene.
    #[default]
    Surface,
    /// Distance from the rows of the paper's table: for scenes that stand for its own.
    Table,
}

/// How a setting does on a scene.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SceneFit {
    /// The trace's label.
    pub scene: String,
    /// Whether settings are not chosen by it.
    pub held_out: bool,
    /// Root mean square distance from the surface, points of utilisation.
    pub surface_points: f64,
    /// Distance from the paper's rows.
    pub table: Option<Score>,
}

/// A setting and how it does.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Trial {
    /// What is set.
    pub settings: Vec<Setting>,
    /// Scene by scene.
    pub scenes: Vec<SceneFit>,
    /// The objective over the scenes that choose: root mean square; none where it is known of none.
    pub chosen_by: Option<f64>,
    /// The objective over the scenes that are held out.
    pub held_out: Option<f64>,
}

/// Rows of a trial on a scene: the paper's caches in its orders.
pub const ROWS: usize = z2::CACHES_KIB.len() * z2::ORDERS.len();

fn measured(row: &ResultRow) -> Option<Measured> {
    let first = row.result.first_lookups?;
    let (l1, l2) = row.caches_kib();
    Some(Measured {
        caches_kib: (l1 as u32, l2 as u32),
        order: row.point.config.order,
        l1_miss_pct: 100.0 * first.l1_miss_rate,
        l2_miss_pct: 100.0 * first.l2_miss_rate,
        tmu_util_pct: 100.0 * row.result.tmu.as_ref()?.utilization,
    })
}

fn root_mean_square(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.fold((0.0, 0_usize), |(sum, n), v| (sum + v * v, n + 1));
    (count > 0).then(|| (sum / count as f64).sqrt())
}

/// The trials of a plan whose last axes are the paper's caches and orders, in the plan's order;
/// `held_out` says which scenes do not choose.
#[must_use]
pub fn trials(
    plan: &Plan,
    outcome: &Outcome,
    held_out: &[bool],
    objective: Objective,
) -> Vec<Trial> {
    let rows = outcome.rows();
    let by_scene: Vec<&[ResultRow]> = rows.chunks(plan.points.len()).collect();
    let trials = (0..plan.points.len() / ROWS).map(|trial| {
        let range = trial * ROWS..(trial + 1) * ROWS;
        let settings = plan.points[range.start].settings.iter();
        let tried = settings.filter(|(key, _)| !is_of_the_table(key)).cloned();
        let fits = by_scene.iter().zip(held_out).map(|(rows, &held_out)| {
            let rows = &rows[range.clone()];
            let measured: Vec<Measured> = rows.iter().filter_map(measured).collect();
            let off = measured.iter().map(|row| {
                let form = closed_form(row.l1_miss_pct / 100.0, row.l2_miss_pct / 100.0);
                row.tmu_util_pct - 100.0 * form
            });
            let subject = rows[0].subject;
            SceneFit {
                scene: subject.label.clone(),
                held_out,
                surface_points: root_mean_square(off).unwrap_or(f64::MAX),
                table: subject
                    .stand_in_for
                    .and_then(|scene| score(scene, &measured)),
            }
        });
        let scenes: Vec<SceneFit> = fits.collect();
        let over = |held_out: bool| {
            let of = scenes.iter().filter(|fit| fit.held_out == held_out);
            root_mean_square(of.filter_map(|fit| match objective {
                Objective::Surface => Some(fit.surface_points),
                Objective::Table => fit.table.map(|score| score.total),
            }))
        };
        Trial {
            settings: tried.collect(),
            chosen_by: over(false),
            held_out: over(true),
            scenes,
        }
    });
    trials.collect()
}

/// Keys that the paper's table varies.
#[must_use]
pub fn is_of_the_table(key: &str) -> bool {
    ["l1.size_bytes", "l2.size_bytes", "order"].contains(&key)
}
