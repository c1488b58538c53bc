//! Studies of reprojection rules and their thresholds: reuse and image error.

use super::headline::REUSE;
use super::inputs::{Inputs, Rays};
use super::metric::{Metric, metric};
use super::study::{Choice, Contribution, Study, StudyError};
use formats::raytrace::{RayTile, RaytraceTables};
use formats::view::Eye;
use sgrt::config::SgrtConfig;
use sgrt::frame::{RaySource, TileError};
use sgrt::loaded::LoadedTrace;
use sgrt::rules::Rule;
use sgrt::variations::curve_rules;
use sgrt::{DEFAULT_REUSE, DEFAULT_RULE};

const RULE_FIGURES: [Metric; 4] = [
    metric("flip_mean", "mean FLIP of the right image", ""),
    metric("flip_p99", "its 99th percentile", ""),
    metric("reused_pct", "reused", "% of right pixels"),
    metric("wrong_object_pct", "of a wrong object", "% of right pixels"),
];

pub const RULES: Study = Study {
    key: "rules",
    title: "Rules of reprojection",
    about: "Which reprojected hits are rejected and traced again; primary hits and shadow outcomes are reused. Errors are against the right image traced in full.",
    time: "modelled frame, over both eyes traced in full",
    reference: "trace everything",
    recommended: DEFAULT_RULE,
    reason: "close to the front of both costs: rules with less error trace more pixels again",
    figures: &RULE_FIGURES,
    measure: rules,
};

fn rules(inputs: &Inputs<'_>) -> Result<Vec<Choice>, StudyError> {
    let mut choices = Vec::new();
    for rays in &inputs.rays {
        let loaded = LoadedTrace::load(rays.source)?;
        let curve = loaded.curve(&curve_rules(), &[DEFAULT_REUSE], &SgrtConfig::default())?;
        choices.extend(curve.into_iter().map(|point| {
            Choice {
                name: point.rule.to_string(),
                scene: rays.label.clone(),
                time_ratio: Some(1.0 / point.relative_performance),
                values: [
                    point.flip_mean,
                    point.flip_p99,
                    point.reuse_pct,
                    point.wrong_object_pct,
                ]
                .map(Some)
                .to_vec(),
                ..Choice::default()
            }
        }));
    }
    Ok(choices)
}

pub(super) const REUSED: Study = Study {
    key: "reuse",
    title: "Errors of the share of reused pixels",
    about: "Effect of thresholds and rounding on the share of right pixels that are reused. Errors are against the default rule on the unchanged trace.",
    time: "modelled frame, over the default rule's",
    reference: "as traced",
    recommended: "as traced",
    reason: "thresholds are a choice; rounding of hits has no visible effect",
    figures: &[REUSE],
    measure: reuse,
};

/// Hits are moved along their rays by at most this share of the distance, a few times the rounding error of
/// single precision (see the study of traversal).
const ROUNDING: f32 = 1.0 / (1 << 20) as f32;

fn reuse(inputs: &Inputs<'_>) -> Result<Vec<Choice>, StudyError> {
    let rule: Rule = DEFAULT_RULE.parse()?;
    let config = SgrtConfig::default();
    let run = |source: &dyn RaySource, rule: &Rule| -> Result<(f64, f64), StudyError> {
        let loaded = LoadedTrace::load(source)?;
        let outcome = loaded.run(rule, DEFAULT_REUSE, &config)?.outcome;
        Ok((outcome.reuse_pct, outcome.relative_performance))
    };
    let mut choices = Vec::new();
    for Rays { label, source } in &inputs.rays {
        let (expected, performance) = run(*source, &rule)?;
        let calibration = Contribution::Calibration;
        for (name, contribution, found) in [
            (
                "thresholds halved",
                calibration,
                run(*source, &rule.scaled(0.5))?,
            ),
            (
                "thresholds doubled",
                calibration,
                run(*source, &rule.scaled(2.0))?,
            ),
            (
                "hits moved by 10^-6",
                Contribution::Capture,
                run(&Moved(*source), &rule)?,
            ),
        ] {
            choices.push(Choice {
                name: name.to_owned(),
                scene: label.clone(),
                contribution: Some(contribution),
                time_ratio: Some(performance / found.1),
                values: vec![Some(found.0 - expected)],
                ..Choice::default()
            });
        }
    }
    Ok(choices)
}

/// A trace with rounding errors added to its hits.
struct Moved<'a>(&'a dyn RaySource);

impl RaySource for Moved<'_> {
    fn tables(&self) -> &RaytraceTables {
        self.0.tables()
    }

    fn tile(&self, eye: Eye, index: u32, tile: &mut RayTile) -> Result<(), TileError> {
        self.0.tile(eye, index, tile)?;
        let from = self.tables().camera(eye).position;
        for hit in tile
            .pixels
            .iter_mut()
            .filter_map(|pixel| pixel.hit.as_mut())
        {
            // Any number that differs between hits.
            let hash = (hit.t.to_bits() ^ hit.position[0].to_bits()).wrapping_mul(0x9e37_79b9);
            let share = ROUNDING * (hash as f32 / (u32::MAX / 2) as f32 - 1.0);
            hit.t += hit.t * share;
            for (axis, from) in from.into_iter().enumerate() {
                hit.position[axis] += (hit.position[axis] - from) * share;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::{inputs, small_trace};
    use super::*;
    use sgrt::testing::{View, globe, trace, wall};

    #[test]
    fn every_rule_is_a_choice_and_thresholds_change_the_reused_share() {
        let mut scene = wall(4.0, [30.0, 30.0], 0.0, 1);
        scene.extend(globe([0.1, 0.0, -1.5], 0.5, 2));
        let rays = trace(&scene, View::default());
        let textures = small_trace();
        let mut inputs = inputs(&textures);
        assert!(rules(&inputs).unwrap().is_empty());
        inputs.rays.push(Rays {
            label: "globe".into(),
            source: &rays,
        });
        let choices = rules(&inputs).unwrap();
        assert_eq!(choices.len(), curve_rules().len());
        let of = |name: &str| choices.iter().find(|c| c.name == name).expect(name);
        let recommended = of(&DEFAULT_RULE.parse::<Rule>().unwrap().to_string());
        assert_eq!(recommended.name, RULES.recommended);
        assert!(recommended.values[0] <= of("none").values[0]);
        let found = reuse(&inputs).unwrap();
        let points: Vec<f64> = found.iter().map(|c| c.values[0].unwrap()).collect();
        assert!(points[0] <= 0.0 && points[1] >= 0.0, "{points:?}");
        assert!(points[2].abs() < 0.5, "{points:?}");
    }
}
