//! Study of the precision of the ray traversal, from the measurements of `tracegen precision`.

use super::inputs::Inputs;
use super::metric::{Metric, metric};
use super::study::{Choice, Study, StudyError};

const FIGURES: [Metric; 2] = [
    metric("wrong_pct", "rays that hit or miss wrongly", "%"),
    metric(
        "distance_ppm",
        "error of the distance (99th percentile)",
        "ppm",
    ),
];

pub(super) const TRAVERSAL: Study = Study {
    key: "traversal",
    title: "Precision of the ray traversal",
    about: "A sphere of 20,480 triangles at some distance from the origin, traced by a plain program in three arithmetics, and by the capturing tracer. Errors are against signed volumes in double precision. Rays whose result depends on the rounding of vertices do not count.",
    time: "tracing, over double precision's",
    reference: "double precision",
    recommended: "tracegen rays (single, recentred)",
    reason: "as accurate as double precision at any distance; without recentring, single precision fails from a kilometre on, and double precision has no advantage",
    figures: &FIGURES,
    measure: measured,
};

fn measured(inputs: &Inputs<'_>) -> Result<Vec<Choice>, StudyError> {
    let choice = |row: &super::TraversalRow| Choice {
        name: row.arithmetic.clone(),
        scene: match row.at_m {
            0.0 => "a sphere at the origin".to_owned(),
            far => format!("a sphere at {far:e} m"),
        },
        time_ratio: Some(row.time_ratio),
        values: vec![Some(row.wrong_pct), Some(row.distance_ppm)],
        ..Choice::default()
    };
    Ok(inputs.traversal.iter().map(choice).collect())
}
