//! Runs a trace with many rules, and a rule with many parameters.

use super::accuracy::count_errors;
use super::compose::Reuse;
use super::config::SgrtConfig;
use super::detect::decide;
use super::frame::FrameError;
use super::hardware::{Comparison, tile_work};
use super::loaded::{LoadedTrace, RuleRun};
use super::result::{CurvePoint, Sensitivity};
use super::rules::Rule;
use image_error::Picture;
use image_error::flip::FlipMap;

impl LoadedTrace<'_> {
    /// Unit cycles saved against image error, over rules and levels of reuse. Misses are counted as in
    /// [`LoadedTrace::run`], so that a point equals a run with its rule.
    ///
    /// # Errors
    /// [`FrameError`] for a tile whose addresses cannot be read.
    pub fn curve(
        &self,
        rules: &[Rule],
        levels: &[Reuse],
        config: &SgrtConfig,
    ) -> Result<Vec<CurvePoint>, FrameError> {
        let mut points = Vec::new();
        for rule in rules {
            let decisions = decide(&self.frame, &self.arrived, rule);
            let accuracy = count_errors(&self.frame, &decisions);
            let mut last: Option<(Picture, FlipMap)> = None;
            for &reuse in levels {
                let work = tile_work(&self.frame, &decisions, reuse);
                let misses = self.misses(&work, &decisions, reuse, config)?;
                let comparison = self.compare(&work, &misses, rule.reads(), config);
                let picture = self.picture(&decisions, reuse);
                let (_, flip) = match last.take() {
                    Some((same, flip)) if same == picture => last.insert((same, flip)),
                    _ => {
                        let flip = self.flip(&picture);
                        last.insert((picture, flip))
                    }
                };
                points.push(CurvePoint {
                    rule: rule.clone(),
                    reuse,
                    reuse_pct: accuracy.pct(accuracy.all_reused().pixels),
                    wrong_object_pct: accuracy.pct(accuracy.all_reused().wrong_object),
                    tni_reduction_pct: 100.0
                        * (1.0
                            - comparison.reprojected.tni_cycles / comparison.reference.tni_cycles),
                    relative_performance: comparison.relative_performance(),
                    relative_energy: comparison.relative_energy(),
                    flip_mean: flip.mean(),
                    flip_p99: flip.p99(),
                });
            }
        }
        Ok(points)
    }

    /// Halves and doubles every parameter separately.
    ///
    /// # Errors
    /// [`FrameError`] for a tile whose addresses cannot be read.
    pub fn sensitivity(
        &self,
        run: &RuleRun,
        reuse: Reuse,
        config: &SgrtConfig,
    ) -> Result<Vec<Sensitivity>, FrameError> {
        let mut out = Vec::new();
        for (parameter, value) in config.numbers() {
            // The closed form does not read these.
            if parameter.starts_with("cycles.") {
                continue;
            }
            let mut ratios = [Comparison::default(); 2];
            for (ratio, factor) in ratios.iter_mut().zip([0.5, 2.0]) {
                let Some(scaled) = config.scaled(&parameter, factor) else {
                    continue;
                };
                let changes_misses = parameter.starts_with("cache.") || parameter == "tni.units";
                let again = changes_misses
                    .then(|| self.misses(&run.work, &run.decisions, reuse, &scaled))
                    .transpose()?;
                let misses = again.as_ref().unwrap_or(&run.misses);
                *ratio = self.compare(&run.work, misses, run.reads, &scaled);
            }
            out.push(Sensitivity {
                parameter,
                value,
                relative_performance: ratios.map(|c| c.relative_performance()),
                relative_energy: ratios.map(|c| c.relative_energy()),
            });
        }
        Ok(out)
    }
}

/// The rules of the curve: the paper's plain reuse, thresholds, single tests, and combinations.
pub fn curve_rules() -> Vec<Rule> {
    [
        "none",
        "depth=0.1",
        "depth=0.05",
        "depth=0.02",
        "depth=0.01",
        "depth=0.005",
        "object",
        "row=0.02",
        "silhouette",
        "triangle",
        "triangles",
        "depth=0.02+object+triangle",
        "depth=0.02+object+triangles",
        "depth=0.02+object+opaque+triangle",
        super::DEFAULT_RULE,
        "depth=0.02+object+opaque+silhouette+triangle",
    ]
    .into_iter()
    .filter_map(|text| text.parse().ok())
    .collect()
}

#[cfg(test)]
mod tests {
    use super::super::testing::{View, globe, trace, wall};
    use super::*;

    fn scene() -> super::super::testing::Synthetic {
        let mut scene = wall(4.0, [30.0, 30.0], 0.0, 1);
        scene.extend(globe([0.1, 0.0, -1.5], 0.5, 2));
        trace(&scene, View::default())
    }

    #[test]
    fn the_curve_agrees_with_single_runs_by_rates_and_by_addresses() {
        for source in [scene(), scene().with_visits()] {
            agrees(&source);
        }
    }

    fn agrees(source: &super::super::testing::Synthetic) {
        let loaded = LoadedTrace::load(source).expect("loads");
        let config = SgrtConfig::default();
        let rules: Vec<Rule> = vec!["depth=0.02".parse().expect("a rule")];
        for point in loaded.curve(&rules, &Reuse::ALL, &config).expect("runs") {
            let run = loaded.run(&rules[0], point.reuse, &config).expect("runs");
            assert_eq!(point.flip_mean, run.outcome.flip_mean);
            assert_eq!(point.tni_reduction_pct, run.outcome.tni_reduction_pct);
            assert_eq!(point.relative_energy, run.outcome.relative_energy);
            assert_eq!(point.relative_performance, run.outcome.relative_performance);
        }
    }

    #[test]
    fn equal_costs_with_and_without_reuse_move_the_ratios_towards_one() {
        let source = scene();
        let loaded = LoadedTrace::load(&source).expect("loads");
        let config = SgrtConfig::default();
        let run = loaded
            .run(&Rule::default(), Reuse::Primary, &config)
            .expect("runs");
        let all = loaded
            .sensitivity(&run, Reuse::Primary, &config)
            .expect("runs");
        let numbers = config.numbers();
        let read = numbers
            .iter()
            .filter(|(key, _)| !key.starts_with("cycles."));
        assert_eq!(all.len(), read.count());
        let of = |name: &str| all.iter().find(|s| s.parameter == name).expect(name);
        let [half, twice] = of("memory.frame_buffer_bytes").relative_energy;
        let base = run.outcome.relative_energy;
        assert!((twice - 1.0).abs() < (base - 1.0).abs());
        assert!((half - 1.0).abs() > (base - 1.0).abs());
    }
}
