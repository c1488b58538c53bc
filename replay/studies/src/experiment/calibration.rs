//! Calibration: trials of settings, chosen on some scenes and validated on others. If scenes were captured
//! at several interpupillary distances (IPD), the distance is one of the settings.

use super::{Outcome, Plan, ResultRow, Setting, Subject, scene_label};
use serde::{Serialize, Serializer};
use sim::paper::score::{Measured, Score, score};
use sim::paper::z2;
use sim::tmu::closed_form;
use toml::Value;

/// The measure by which a setting is chosen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, clap::ValueEnum)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Objective {
    /// Distance of the utilisation from the one that the Z2 paper's table implies for the machine's own
    /// miss rates. Defined for any scene.
    #[default]
    Surface,
    /// Distance from the rows of the paper's table. Defined for stand-in scenes.
    Table,
}

/// Fit of a setting on a scene.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct SceneFit {
    /// The trace's label.
    pub scene: String,
    /// True for a validation scene, which does not influence the choice.
    pub held_out: bool,
    /// Root mean square distance from the surface in points of utilisation; none without a texture unit.
    pub surface_points: Option<f64>,
    /// Distance from the paper's rows.
    pub table: Option<Score>,
}

/// A trial: settings and their fit.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct Trial {
    /// The settings.
    #[serde(serialize_with = "as_map")]
    #[cfg_attr(
        feature = "testing",
        schemars(with = "serde_json::Map<String, serde_json::Value>")
    )]
    pub settings: Vec<Setting>,
    /// Fit on each scene.
    pub scenes: Vec<SceneFit>,
    /// Root mean square of the objective over the scenes used for the choice; none if undefined.
    pub chosen_by: Option<f64>,
    /// The objective over the validation scenes.
    pub held_out: Option<f64>,
}

fn as_map<S: Serializer>(settings: &[Setting], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map(settings.iter().map(|(key, value)| (key, value)))
}

/// Rows of a trial per scene: the paper's caches in its orders.
pub const ROWS: usize = z2::CACHES_KIB.len() * z2::ORDERS.len();

/// Key of the IPD among a trial's settings.
const IPD_KEY: &str = "capture.ipd_m";

/// A scene with its captures.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneCaptures {
    /// Its label.
    pub label: String,
    /// True for a validation scene, which does not influence the choice.
    pub held_out: bool,
    /// IPD in metres and trace index of each capture, by IPD. The same number in every scene.
    pub captures: Vec<(f64, usize)>,
}

impl SceneCaptures {
    /// Each trace as a separate scene.
    pub fn one_each(subjects: &[Subject<'_>]) -> Vec<Self> {
        let scene = |(index, subject): (usize, &Subject<'_>)| Self {
            label: subject.label.clone(),
            held_out: false,
            captures: vec![(ipd_m(subject), index)],
        };
        subjects.iter().enumerate().map(scene).collect()
    }

    /// Groups traces by scene, in order of first occurrence, with captures sorted by IPD.
    ///
    /// # Errors
    /// A scene with two captures at one IPD, or without a capture at an IPD that another scene has.
    pub fn by_ipd(subjects: &[Subject<'_>]) -> Result<Vec<Self>, String> {
        let mut scenes: Vec<Self> = Vec::new();
        for (index, subject) in subjects.iter().enumerate() {
            let label = scene_label(subject.source.tables());
            let capture = (ipd_m(subject), index);
            match scenes.iter_mut().find(|scene| scene.label == label) {
                Some(scene) => scene.captures.push(capture),
                None => scenes.push(Self {
                    label,
                    held_out: false,
                    captures: vec![capture],
                }),
            }
        }
        let mut distances: Vec<f64> = subjects.iter().map(ipd_m).collect();
        distances.sort_by(f64::total_cmp);
        distances.dedup();
        for scene in &mut scenes {
            scene.captures.sort_by(|a, b| a.0.total_cmp(&b.0));
            for distance in &distances {
                let found = scene.captures.iter().filter(|(of, _)| of == distance);
                match found.count() {
                    1 => {}
                    found => {
                        return Err(format!(
                            "{}: expected one trace with the eyes {distance} m apart, found {found}",
                            scene.label
                        ));
                    }
                }
            }
        }
        Ok(scenes)
    }
}

/// IPD of a trace in metres.
fn ipd_m(subject: &Subject<'_>) -> f64 {
    // Converts through text, because 0.064 in single precision is not 0.064 in double precision.
    let text = subject.source.tables().meta.hmd.ipd_m.to_string();
    text.parse().unwrap_or_default()
}

/// Miss rates of a row: of first look-ups as in the paper if the machine counts them, else of primary misses.
fn measured(row: &ResultRow) -> Measured {
    let result = row.result;
    let (l1, l2) = row.caches_kib();
    let rates = match &result.first_lookups {
        Some(first) => (first.l1_footprint_miss_rate, first.l2_line_miss_rate),
        None => (result.l1.footprint_miss_rate, result.l2.line_miss_rate),
    };
    Measured {
        caches_kib: (l1 as u32, l2 as u32),
        order: row.point.config.order,
        l1_footprint_miss_pct: 100.0 * rates.0,
        l2_line_miss_pct: 100.0 * rates.1,
        tmu_util_pct: result.tmu.as_ref().map(|tmu| 100.0 * tmu.utilization),
    }
}

fn root_mean_square(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.fold((0.0, 0_usize), |(sum, n), v| (sum + v * v, n + 1));
    (count > 0).then(|| (sum / count as f64).sqrt())
}

/// The trials of a plan whose last axes are the paper's caches and orders, by IPD and then in the plan's order.
pub fn trials(
    plan: &Plan,
    outcome: &Outcome,
    scenes: &[SceneCaptures],
    objective: Objective,
) -> Vec<Trial> {
    let rows = outcome.rows();
    let by_subject: Vec<&[ResultRow]> = rows.chunks(plan.points.len()).collect();
    let distances = scenes.first().map_or(0, |scene| scene.captures.len());
    let of_distance = |distance: usize| {
        (0..plan.points.len() / ROWS).map(move |trial| (distance, trial * ROWS..(trial + 1) * ROWS))
    };
    let trials = (0..distances)
        .flat_map(of_distance)
        .map(|(distance, range)| {
            let settings = plan.points[range.start].settings.iter();
            let tried = settings.filter(|(key, _)| !is_of_the_table(key)).cloned();
            let ipd = (scenes.iter().take(1))
                .filter(|_| distances > 1)
                .map(|scene| (IPD_KEY.to_owned(), Value::Float(scene.captures[distance].0)));
            let fits = scenes.iter().map(|scene| {
                let (_, subject) = scene.captures[distance];
                fit(scene, &by_subject[subject][range.clone()])
            });
            let scenes: Vec<SceneFit> = fits.collect();
            let over = |held_out: bool| {
                let of = scenes.iter().filter(|fit| fit.held_out == held_out);
                root_mean_square(of.filter_map(|fit| match objective {
                    Objective::Surface => fit.surface_points,
                    Objective::Table => fit.table.map(|score| score.total),
                }))
            };
            Trial {
                settings: ipd.chain(tried).collect(),
                chosen_by: over(false),
                held_out: over(true),
                scenes,
            }
        });
    trials.collect()
}

/// Fit of the paper's caches and orders on a scene.
fn fit(scene: &SceneCaptures, rows: &[ResultRow]) -> SceneFit {
    let measured: Vec<Measured> = rows.iter().map(measured).collect();
    let off = measured.iter().filter_map(|row| {
        let form = closed_form(
            row.l1_footprint_miss_pct / 100.0,
            row.l2_line_miss_pct / 100.0,
        );
        Some(row.tmu_util_pct? - 100.0 * form)
    });
    let paper = rows.first().and_then(|row| row.subject.stand_in_for);
    SceneFit {
        scene: scene.label.clone(),
        held_out: scene.held_out,
        surface_points: root_mean_square(off),
        table: paper.and_then(|paper| score(paper, &measured)),
    }
}

/// True for the settings that vary within the paper's table.
pub fn is_of_the_table(key: &str) -> bool {
    ["l1.size_bytes", "l2.size_bytes", "order"].contains(&key)
}

#[cfg(test)]
mod tests {
    use super::*;
    use sim::result::TraceId;
    use sim::stream::MemoryTrace;
    use sim::stream::testing::tables;

    fn trace(scene: &str, ipd_m: f32) -> MemoryTrace {
        let mut tables = tables(&[[4, 4]]);
        tables.meta.scene = scene.to_owned();
        tables.meta.hmd.ipd_m = ipd_m;
        MemoryTrace {
            tables,
            tiles: Vec::new(),
        }
    }

    fn grouped(traces: &[(&str, f32)]) -> Result<Vec<SceneCaptures>, String> {
        let traces: Vec<MemoryTrace> = traces.iter().map(|(s, ipd)| trace(s, *ipd)).collect();
        let mut subjects = Vec::new();
        for (index, trace) in traces.iter().enumerate() {
            subjects.push(Subject::new(trace, TraceId::default(), index.to_string()));
        }
        SceneCaptures::by_ipd(&subjects)
    }

    #[test]
    fn traces_of_a_scene_are_its_captures_by_distance_between_the_eyes() {
        let scenes = grouped(&[
            ("atrium", 0.5),
            ("jungle", 0.064),
            ("atrium", 0.064),
            ("jungle", 0.5),
        ]);
        let scene = |label: &str, captures: [(f64, usize); 2]| SceneCaptures {
            label: label.to_owned(),
            held_out: false,
            captures: captures.into(),
        };
        assert_eq!(
            scenes.unwrap(),
            [
                scene("atrium", [(0.064, 2), (0.5, 0)]),
                scene("jungle", [(0.064, 1), (0.5, 3)])
            ]
        );
    }

    #[test]
    fn a_scene_without_a_distance_of_another_scene_is_reported() {
        for (traces, message) in [
            (
                &[("atrium", 0.064), ("atrium", 0.5), ("jungle", 0.5)][..],
                "jungle: expected one trace with the eyes 0.064 m apart, found 0",
            ),
            (
                &[("atrium", 0.064), ("atrium", 0.064)],
                "atrium: expected one trace with the eyes 0.064 m apart, found 2",
            ),
        ] {
            assert_eq!(grouped(traces).unwrap_err(), message);
        }
    }
}
