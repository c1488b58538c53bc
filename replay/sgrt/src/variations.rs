//! Runs a trace with many rules, and a rule with many parameters.

use super::accuracy::count_errors;
use super::compose::Reuse;
use super::config::SgrtConfig;
use super::detect::decide;
use super::frame::FrameError;
use super::hardware::RemainingWork;
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
        let mut works = Vec::new();
        for rule in rules {
            let decisions = decide(&self.frame, &self.arrived, rule);
            let accuracy = count_errors(&self.frame, &decisions);
            let mut last: Option<(Picture, FlipMap)> = None;
            for &reuse in levels {
                works.push(RemainingWork::new(&self.frame, &decisions, reuse));
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
                    tni_reduction_pct: 0.0,
                    relative_performance: 0.0,
                    relative_energy: 0.0,
                    flip_mean: flip.mean(),
                    flip_p99: flip.p99(),
                });
            }
        }
        let misses = self.misses(&works.iter().map(|work| (work, config)).collect::<Vec<_>>())?;
        for ((point, work), misses) in points.iter_mut().zip(&works).zip(&misses) {
            let compared = self.compare(&work.tiles, misses, point.rule.reads(), config);
            let left = compared.reprojected.tni_cycles / compared.reference.tni_cycles;
            point.tni_reduction_pct = 100.0 * (1.0 - left);
            point.relative_performance = compared.relative_performance();
            point.relative_energy = compared.relative_energy();
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
        config: &SgrtConfig,
    ) -> Result<Vec<Sensitivity>, FrameError> {
        let mut parameters = config.numbers();
        // The closed form does not read these.
        parameters.retain(|(name, _)| !name.starts_with("cycles."));
        let changes_misses = |name: &str| name.starts_with("cache.") || name == "tni.units";
        let scaled = |(name, value): (String, f64)| {
            let of = |factor| {
                config
                    .scaled(&name, factor)
                    .unwrap_or_else(|| config.clone())
            };
            ([of(0.5), of(2.0)], name, value)
        };
        let scaled: Vec<([SgrtConfig; 2], String, f64)> =
            parameters.into_iter().map(scaled).collect();
        let changed = scaled.iter().filter(|(_, name, _)| changes_misses(name));
        let changed = changed.flat_map(|(configs, ..)| configs);
        let runs: Vec<_> = changed.map(|config| (&run.work, config)).collect();
        let mut again = self.misses(&runs)?.into_iter();
        let of_parameter = |(configs, parameter, value): ([SgrtConfig; 2], String, f64)| {
            let changes = changes_misses(&parameter);
            let ratios = configs.map(|config| {
                let again = changes.then(|| again.next()).flatten();
                let misses = again.as_ref().unwrap_or(&run.misses);
                self.compare(&run.work.tiles, misses, run.reads, &config)
            });
            Sensitivity {
                parameter,
                value,
                relative_performance: ratios.map(|c| c.relative_performance()),
                relative_energy: ratios.map(|c| c.relative_energy()),
            }
        };
        Ok(scaled.iter().cloned().map(of_parameter).collect())
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
        "depth=0.02+row=0.02+object+opaque+triangles",
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
        let all = loaded.sensitivity(&run, &config).expect("runs");
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
