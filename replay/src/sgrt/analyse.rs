//! One trace under one rule: decisions, right image, its error, and what the hardware saves.

use super::accuracy::assess;
use super::compose::{Reuse, compose};
use super::config::SgrtConfig;
use super::evaluate::{
    Evaluation, TileMisses, TileWork, evaluate, misses_by_addresses, misses_by_rates, tile_work,
};
use super::frame::{Frame, FrameError, RaySource};
use super::reject::{Decision, Rule, decide};
use super::reproject::{Reprojection, reproject};
use super::result::{CurvePoint, ImageError, Outcome, Sensitivity};
use crate::image::flip::{FlipMap, Prepared};
use crate::image::{Picture, pixels_per_degree, psnr, ssim};
use formats::view::Eye;

/// A loaded trace, ready for any number of rules.
pub struct Analysis<'a> {
    source: &'a dyn RaySource,
    frame: Frame,
    arrived: Reprojection,
    truth: Picture,
    truth_prepared: Prepared,
    ppd: f32,
}

/// A rule's result with its pictures.
pub struct Analysed {
    /// The figures.
    pub outcome: Outcome,
    /// Decision on every right sample.
    pub decisions: Vec<Decision>,
    /// The right image.
    pub picture: Picture,
    /// Its error.
    pub flip: FlipMap,
    work: TileWork,
    misses: TileMisses,
}

impl<'a> Analysis<'a> {
    /// Loads and reprojects a trace.
    ///
    /// # Errors
    /// [`FrameError`] where a tile cannot be read.
    pub fn load(source: &'a dyn RaySource) -> Result<Self, FrameError> {
        let frame = Frame::load(source)?;
        let arrived = reproject(&frame);
        let camera = frame.tables.camera(Eye::Right);
        let ppd = pixels_per_degree(camera.size_px[0], &camera.fov);
        let truth = traced(&frame, Eye::Right);
        let truth_prepared = Prepared::new(&truth, ppd);
        Ok(Self {
            source,
            frame,
            arrived,
            truth,
            truth_prepared,
            ppd,
        })
    }

    /// The loaded frame.
    #[must_use]
    pub fn frame(&self) -> &Frame {
        &self.frame
    }

    /// The right image traced in full.
    #[must_use]
    pub fn truth(&self) -> &Picture {
        &self.truth
    }

    /// The left image.
    #[must_use]
    pub fn left(&self) -> Picture {
        traced(&self.frame, Eye::Left)
    }

    /// Where cache misses come from.
    #[must_use]
    pub fn cache_misses(&self) -> &'static str {
        if self.frame.tables.meta.has_visits {
            "addresses"
        } else {
            "rates"
        }
    }

    /// Runs a rule and a level of reuse through the model.
    ///
    /// # Errors
    /// [`FrameError`] where a tile cannot be read again for its addresses.
    pub fn run(
        &self,
        rule: &Rule,
        reuse: Reuse,
        config: &SgrtConfig,
    ) -> Result<Analysed, FrameError> {
        let decisions = decide(&self.frame, &self.arrived, rule);
        let accuracy = assess(&self.frame, &decisions);
        let work = tile_work(&self.frame, &decisions, reuse);
        let misses = self.misses(&work, &decisions, reuse, config)?;
        let evaluation = evaluate(&self.frame, &work, &misses, config);
        let (picture, flip) = self.image(&decisions, reuse);
        let error = ImageError {
            flip_mean: flip.mean(),
            flip_p99: flip.p99(),
            pixels_per_degree: f64::from(self.ppd),
            psnr_db: psnr::psnr_db(&self.truth, &picture),
            ssim: ssim::ssim(&self.truth, &picture),
        };
        Ok(Analysed {
            outcome: Outcome::new(&accuracy, &evaluation, &error),
            decisions,
            picture,
            flip,
            work,
            misses,
        })
    }

    /// Units' cycles saved against image error, over rules and levels of reuse.
    #[must_use]
    pub fn curve(&self, rules: &[Rule], config: &SgrtConfig) -> Vec<CurvePoint> {
        let mut points = Vec::new();
        for rule in rules {
            let decisions = decide(&self.frame, &self.arrived, rule);
            let accuracy = assess(&self.frame, &decisions);
            let mut last: Option<(Picture, FlipMap)> = None;
            for reuse in Reuse::ALL {
                let work = tile_work(&self.frame, &decisions, reuse);
                // By rates for all points: a point should cost no second pass over the trace.
                let misses = misses_by_rates(&work, &self.frame, config);
                let evaluation = evaluate(&self.frame, &work, &misses, config);
                let picture = self.picture(&decisions, reuse);
                let (_, flip) = match last.take() {
                    Some((same, flip)) if same == picture => last.insert((same, flip)),
                    _ => {
                        let flip = self.flip(&picture);
                        last.insert((picture, flip))
                    }
                };
                points.push(CurvePoint {
                    rule: *rule,
                    reuse,
                    reuse_pct: accuracy.pct(accuracy.all_reused().pixels),
                    wrong_object_pct: accuracy.pct(accuracy.all_reused().wrong_object),
                    tni_reduction_pct: 100.0
                        * (1.0
                            - evaluation.reprojected.tni_cycles / evaluation.reference.tni_cycles),
                    relative_performance: evaluation.relative_performance(),
                    flip_mean: flip.mean(),
                    flip_p99: flip.p99(),
                });
            }
        }
        points
    }

    /// Halves and doubles every parameter in turn.
    ///
    /// # Errors
    /// [`FrameError`] where a tile cannot be read again for its addresses.
    pub fn sensitivity(
        &self,
        analysed: &Analysed,
        reuse: Reuse,
        config: &SgrtConfig,
    ) -> Result<Vec<Sensitivity>, FrameError> {
        let mut out = Vec::new();
        for (parameter, value) in config.numbers() {
            let mut ratios = [Evaluation::default(); 2];
            for (ratio, factor) in ratios.iter_mut().zip([0.5, 2.0]) {
                let Some(scaled) = config.scaled(&parameter, factor) else {
                    continue;
                };
                let changes_misses = parameter.starts_with("cache.") || parameter == "tni.units";
                *ratio = if changes_misses {
                    let misses =
                        self.misses(&analysed.work, &analysed.decisions, reuse, &scaled)?;
                    evaluate(&self.frame, &analysed.work, &misses, &scaled)
                } else {
                    evaluate(&self.frame, &analysed.work, &analysed.misses, &scaled)
                };
            }
            out.push(Sensitivity {
                parameter,
                value,
                relative_performance: ratios.map(|e| e.relative_performance()),
                relative_energy: ratios.map(|e| e.relative_energy()),
            });
        }
        Ok(out)
    }

    fn misses(
        &self,
        work: &TileWork,
        decisions: &[Decision],
        reuse: Reuse,
        config: &SgrtConfig,
    ) -> Result<TileMisses, FrameError> {
        if self.frame.tables.meta.has_visits {
            misses_by_addresses(self.source, &self.frame, decisions, reuse, work, config)
        } else {
            Ok(misses_by_rates(work, &self.frame, config))
        }
    }

    fn picture(&self, decisions: &[Decision], reuse: Reuse) -> Picture {
        let colors = compose(&self.frame, decisions, reuse);
        Picture::from_linear(self.frame.size_px, &self.frame.resolve(&colors))
    }

    fn flip(&self, picture: &Picture) -> FlipMap {
        self.truth_prepared
            .compare(&Prepared::new(picture, self.ppd))
    }

    fn image(&self, decisions: &[Decision], reuse: Reuse) -> (Picture, FlipMap) {
        let picture = self.picture(decisions, reuse);
        let flip = self.flip(&picture);
        (picture, flip)
    }
}

/// Rules of the curve: the paper's plain reuse, thresholds, each test alone, and combinations.
#[must_use]
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

fn traced(frame: &Frame, eye: Eye) -> Picture {
    let samples = &frame.eyes[eye as usize].samples;
    let colors: Vec<[f32; 3]> = samples.iter().map(super::frame::Sample::color).collect();
    Picture::from_linear(frame.size_px, &frame.resolve(&colors))
}

#[cfg(test)]
mod tests {
    use super::super::synthetic::{View, globe, trace, wall};
    use super::*;

    fn scene() -> super::super::synthetic::Synthetic {
        let mut scene = wall(4.0, [30.0, 30.0], 0.0, 1);
        scene.extend(globe([0.1, 0.0, -1.5], 0.5, 2));
        trace(&scene, View::default())
    }

    #[test]
    fn the_default_rule_is_nearly_free_of_error_and_beats_plain_reuse() {
        let source = scene();
        let analysis = Analysis::load(&source).expect("loads");
        let config = SgrtConfig::default();
        let rule = super::super::DEFAULT_RULE.parse().expect("a rule");
        let run = |rule: &Rule| analysis.run(rule, Reuse::Primary, &config).expect("runs");
        let (ours, plain) = (run(&rule).outcome, run(&Rule::default()).outcome);
        assert!(ours.flip_mean < 0.01, "{}", ours.flip_mean);
        assert!(ours.flip_mean < plain.flip_mean && ours.psnr_db > plain.psnr_db);
        assert!(ours.reuse_pct <= plain.reuse_pct);
        assert!(ours.relative_performance > 1.0);
    }

    #[test]
    fn the_curve_agrees_with_single_runs() {
        let source = scene();
        let analysis = Analysis::load(&source).expect("loads");
        let config = SgrtConfig::default();
        let rules: Vec<Rule> = vec!["depth=0.02".parse().expect("a rule")];
        for point in analysis.curve(&rules, &config) {
            let run = analysis.run(&rules[0], point.reuse, &config).expect("runs");
            assert_eq!(point.flip_mean, run.outcome.flip_mean);
            assert_eq!(point.tni_reduction_pct, run.outcome.tni_reduction_pct);
        }
    }

    #[test]
    fn costs_that_both_ways_pay_alike_move_the_ratios_towards_one() {
        let source = scene();
        let analysis = Analysis::load(&source).expect("loads");
        let config = SgrtConfig::default();
        let run = analysis
            .run(&Rule::default(), Reuse::Primary, &config)
            .expect("runs");
        let all = analysis
            .sensitivity(&run, Reuse::Primary, &config)
            .expect("runs");
        assert_eq!(all.len(), config.numbers().len());
        let of = |name: &str| all.iter().find(|s| s.parameter == name).expect(name);
        let [half, twice] = of("energy.frame_buffer_bytes").relative_energy;
        let base = run.outcome.relative_energy;
        assert!((twice - 1.0).abs() < (base - 1.0).abs());
        assert!((half - 1.0).abs() > (base - 1.0).abs());
    }
}
