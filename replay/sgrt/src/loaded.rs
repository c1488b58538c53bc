//! A loaded trace, and the result of a rule: decisions, right image, image error and hardware savings.

use super::accuracy::count_errors;
use super::compose::{Reuse, compose};
use super::config::{RowStorage, SgrtConfig};
use super::detect::{Decision, decide};
use super::frame::{Frame, FrameError, RaySource};
use super::hardware::{
    Comparison, Kept, RemainingWork, TileMisses, TileWork, misses_by_addresses, misses_by_rates,
    misses_in_usual_order,
};
use super::ray_sort;
use super::reads::Reads;
use super::reproject::{Reprojection, reproject};
use super::result::{ImageError, Outcome};
use super::rows::RowNeeds;
use super::rules::Rule;
use super::tile_orders::{TileSequence, usual_plan};
use super::timed::{self, TracedTiming};
use super::timing::Timing;
use super::ways::{Model, compare};
use formats::view::Eye;
use image_error::flip::{FlipMap, Prepared};
use image_error::{Picture, pixels_per_degree, psnr, ssim};
use sim::order::rays::RayPlan;

/// A loaded trace, on which rules can be run.
pub struct LoadedTrace<'a> {
    source: &'a dyn RaySource,
    pub(super) frame: Frame,
    pub(super) arrived: Reprojection,
    rows: RowNeeds,
    truth: Picture,
    truth_prepared: Prepared,
    ppd: f32,
}

/// The result of a rule, with pictures.
pub struct RuleRun {
    /// The figures.
    pub outcome: Outcome,
    /// Decision on every right sample.
    pub decisions: Vec<Decision>,
    /// The right image.
    pub picture: Picture,
    /// Its error map.
    pub flip: FlipMap,
    pub(super) reads: Reads,
    pub(super) work: RemainingWork,
    pub(super) misses: Vec<TileMisses>,
}

/// The decisions of a rule, and what remains to be done.
struct Decided {
    decisions: Vec<Decision>,
    work: RemainingWork,
    reads: Reads,
    reuse: Reuse,
}

impl<'a> LoadedTrace<'a> {
    /// Loads and reprojects a trace.
    ///
    /// # Errors
    /// [`FrameError`] for an unreadable tile.
    pub fn load(source: &'a dyn RaySource) -> Result<Self, FrameError> {
        Ok(Self::of(source, Frame::load(source)?))
    }

    /// Reprojects a frame that was loaded from a source.
    pub(super) fn of(source: &'a dyn RaySource, frame: Frame) -> Self {
        let arrived = reproject(&frame);
        let rows = RowNeeds::new(&frame, &arrived);
        let camera = frame.tables.camera(Eye::Right);
        let ppd = pixels_per_degree(camera.size_px[0], &camera.fov);
        let truth = traced(&frame, Eye::Right);
        let truth_prepared = Prepared::new(&truth, ppd);
        Self {
            source,
            frame,
            arrived,
            rows,
            truth,
            truth_prepared,
            ppd,
        }
    }

    /// The loaded frame.
    pub fn frame(&self) -> &Frame {
        &self.frame
    }

    /// The left rows needed for the right image.
    pub fn rows(&self) -> &RowNeeds {
        &self.rows
    }

    /// The left image.
    pub fn left(&self) -> Picture {
        traced(&self.frame, Eye::Left)
    }

    /// The source of cache misses.
    pub fn cache_misses(&self) -> &'static str {
        if self.frame.tables.meta.has_visits {
            "addresses"
        } else {
            "rates"
        }
    }

    /// Runs the closed form with a rule and a level of reuse.
    ///
    /// # Errors
    /// [`FrameError`] for a tile whose addresses cannot be read.
    pub fn run(
        &self,
        rule: &Rule,
        reuse: Reuse,
        config: &SgrtConfig,
    ) -> Result<RuleRun, FrameError> {
        let decided = self.decided(rule, reuse);
        let misses = self.misses(&[(&decided.work, config)])?;
        let misses = misses.into_iter().next().unwrap_or_default();
        let plan = usual_plan(&self.frame.tables);
        self.finish(decided, misses, [&plan; 2], config, None)
    }

    pub(super) fn model<'b>(&'b self, reads: Reads, config: &'b SgrtConfig) -> Model<'b> {
        Model {
            frame: &self.frame,
            reads,
            rows: &self.rows,
            config,
        }
    }

    /// Runs a rule, and plain reuse of every arrival, on the next frame of `tiles`.
    ///
    /// # Errors
    /// [`FrameError`] for a trace without the visits that are needed, or for a tile whose addresses cannot be read.
    pub fn run_with_plain(
        &self,
        rule: &Rule,
        reuse: Reuse,
        config: &SgrtConfig,
        timing: Timing,
        tiles: &mut TileSequence,
    ) -> Result<[RuleRun; 2], FrameError> {
        let [ours, plain] = [rule, &Rule::default()].map(|rule| self.decided(rule, reuse));
        let runs = [(&ours.work, config), (&plain.work, config)];
        let misses = if self.frame.tables.meta.has_visits {
            misses_by_addresses(&self.frame, &runs, |choices| {
                tiles.misses_of(self.source, &self.frame, choices)
            })?
        } else {
            let all: &Kept<'_> = &|_, _, _| true;
            tiles.begin(self.source, &self.frame, &[(all, config); 3])?;
            self.misses(&runs)?
        };
        let [full, of_ours, of_plain] = tiles.plans();
        let traced = match timing {
            Timing::ClosedForm => None,
            Timing::Cycle => {
                let model = self.model(Reads::NOTHING, config);
                let traced = TracedTiming::new(self.source, &model, full, &ours.work.tiles)?;
                Some(traced)
            }
        };
        let mut misses = misses.into_iter();
        let mut finish = |decided, plan| {
            let misses = misses.next().unwrap_or_default();
            self.finish(decided, misses, [full, plan], config, traced.as_ref())
        };
        Ok([finish(ours, of_ours)?, finish(plain, of_plain)?])
    }

    fn decided(&self, rule: &Rule, reuse: Reuse) -> Decided {
        let decisions = decide(&self.frame, &self.arrived, rule);
        Decided {
            work: RemainingWork::new(&self.frame, &decisions, reuse),
            decisions,
            reads: rule.reads(),
            reuse,
        }
    }

    fn finish(
        &self,
        decided: Decided,
        misses: Vec<TileMisses>,
        plans: [&RayPlan; 2],
        config: &SgrtConfig,
        traced: Option<&TracedTiming>,
    ) -> Result<RuleRun, FrameError> {
        let Decided {
            decisions,
            work,
            reads,
            reuse,
        } = decided;
        let accuracy = count_errors(&self.frame, &decisions);
        let (comparison, cycles) = match traced {
            None => {
                let (frame, rows) = (&self.frame, &self.rows);
                let closed = compare(frame, plans, &work.tiles, &misses, reads, rows, config);
                (closed, None)
            }
            Some(traced) => {
                let model = self.model(reads, config);
                let decided = (decisions.as_slice(), reuse);
                let work = &work.tiles;
                let (comparison, cycles) =
                    timed::compare(self.source, &model, plans, decided, work, &misses, traced)?;
                (comparison, Some(cycles))
            }
        };
        let picture = self.picture(&decisions, reuse);
        let flip = self.flip(&picture);
        let error = ImageError {
            flip_mean: flip.mean(),
            flip_p99: flip.p99(),
            pixels_per_degree: f64::from(self.ppd),
            psnr_db: psnr::psnr_db(&self.truth, &picture),
            ssim: ssim::ssim(&self.truth, &picture),
        };
        let outcome = Outcome::new(
            &accuracy,
            &comparison,
            &error,
            reads,
            self.detection_sram_bytes(reads, config),
        );
        Ok(RuleRun {
            outcome: Outcome { cycles, ..outcome },
            decisions,
            picture,
            flip,
            reads,
            work,
            misses,
        })
    }

    /// Bytes of the row buffers: with rows in DRAM the rows of one band, with rows on chip all rows that are alive.
    fn detection_sram_bytes(&self, reads: Reads, config: &SgrtConfig) -> u64 {
        let g = &config.gbuffer;
        let width = u64::from(self.frame.size_px[0]);
        match g.rows {
            RowStorage::Dram => self.rows.largest_band(reads, g, width),
            RowStorage::Chip => {
                self.rows.rows_on_chip(reads.has_neighbour_rows()) * width * reads.pixel_bytes(g)
            }
        }
    }

    /// Compares by the closed form in the default order.
    pub(super) fn compare(
        &self,
        work: &[TileWork],
        misses: &[TileMisses],
        reads: Reads,
        config: &SgrtConfig,
    ) -> Comparison {
        let plan = usual_plan(&self.frame.tables);
        let (frame, rows) = (&self.frame, &self.rows);
        compare(frame, [&plan; 2], work, misses, reads, rows, config)
    }

    /// The misses of each run by tile in the default order. Addresses are read once for all of them.
    pub(super) fn misses(
        &self,
        runs: &[(&RemainingWork, &SgrtConfig)],
    ) -> Result<Vec<Vec<TileMisses>>, FrameError> {
        if self.frame.tables.meta.has_visits {
            return misses_by_addresses(&self.frame, runs, |choices| {
                misses_in_usual_order(self.source, &self.frame, choices)
            });
        }
        if runs
            .iter()
            .any(|(_, config)| config.tni.ray_sort != ray_sort::none())
        {
            return Err(FrameError::NoVisits("tni.ray_sort"));
        }
        let of_run = |(work, config): &(&RemainingWork, &_)| {
            misses_by_rates(&work.tiles, &self.frame, config)
        };
        Ok(runs.iter().map(of_run).collect())
    }

    pub(super) fn picture(&self, decisions: &[Decision], reuse: Reuse) -> Picture {
        let colors = compose(&self.frame, decisions, reuse);
        Picture::from_linear(self.frame.size_px, &colors)
    }

    pub(super) fn flip(&self, picture: &Picture) -> FlipMap {
        self.truth_prepared
            .compare(&Prepared::new(picture, self.ppd))
    }
}

fn traced(frame: &Frame, eye: Eye) -> Picture {
    let samples = &frame.eyes[eye as usize].samples;
    let colors: Vec<[f32; 3]> = samples.iter().map(super::frame::Sample::color).collect();
    Picture::from_linear(frame.size_px, &colors)
}

#[cfg(test)]
mod tests {
    use super::super::testing::{
        DIFFUSE, LEAF, MIRROR, Placed, Synthetic, View, globe, trace, wall,
    };
    use super::*;
    use proptest::prelude::*;

    fn outcome(source: &Synthetic, rule: &str) -> Outcome {
        let rule = rule.parse().expect("a rule");
        let loaded = LoadedTrace::load(source).expect("loads");
        let run = loaded.run(&rule, Reuse::Primary, &SgrtConfig::default());
        run.expect("runs").outcome
    }

    fn room() -> Vec<Placed> {
        let mut scene = wall(4.0, [30.0, 30.0], 0.0, 1);
        scene.extend(globe([0.1, 0.0, -1.5], 0.5, 2));
        scene
    }

    #[test]
    fn the_default_rule_is_nearly_free_of_error_and_beats_plain_reuse() {
        let source = trace(&room(), View::default());
        let ours = outcome(&source, super::super::DEFAULT_RULE);
        let plain = outcome(&source, "none");
        assert!(ours.flip_mean < 0.01, "{}", ours.flip_mean);
        assert!(ours.flip_mean < plain.flip_mean && ours.psnr_db > plain.psnr_db);
        assert!(ours.reuse_pct <= plain.reuse_pct);
        assert!(ours.relative_performance > 1.0);
    }

    #[test]
    fn several_samples_per_pixel_are_refused_with_the_reason() {
        let view = View {
            samples_per_px: 4,
            ..View::default()
        };
        let source = trace(&room(), view);
        let error = LoadedTrace::load(&source).map(drop).unwrap_err();
        assert_eq!(
            error.to_string(),
            "samples per pixel: expected 1, found 4: the scheme keeps one hit per pixel in its G-buffer"
        );
    }

    #[test]
    fn sky_reuse_does_not_depend_on_the_scenes_position() {
        let view = View {
            center: [1e6, -3e6, 2e6],
            ..View::default()
        };
        let sky = outcome(&trace(&[], view), "none");
        assert_eq!((sky.reuse_pct, sky.flip_mean), (100.0, 0.0));
    }

    /// A scene around the origin: walls and globes of various materials.
    fn placed() -> impl Strategy<Value = Vec<Placed>> {
        let thing = (
            prop::array::uniform3(-1.0f32..1.0),
            0.2f32..1.0,
            prop::sample::select(vec![DIFFUSE, MIRROR, LEAF]),
            any::<bool>(),
        );
        prop::collection::vec(thing, 0..4).prop_map(|things| {
            let mut scene = Vec::new();
            for (object, ([x, y, z], size, material, is_flat)) in (1u32..).zip(things) {
                let mut shapes = if is_flat {
                    wall(2.5 - z, [size, size], x, object)
                } else {
                    globe([x, y, z - 2.5], size, object)
                };
                shapes.iter_mut().for_each(|s| s.material = material);
                scene.extend(shapes);
            }
            scene
        })
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(40))]
        #[test]
        fn without_eye_separation_all_is_reused_and_the_image_equals_the_traced_one(
            scene in placed(),
            size_px in prop::array::uniform2(1u32..70),
            right_of_center in -5.0f32..5.0,
        ) {
            let view = View {
                size_px,
                ipd_m: 0.0,
                center: [right_of_center * 0.1, 0.0, 0.0],
                ..View::default()
            };
            let source = trace(&scene, view);
            let plain = outcome(&source, "none");
            prop_assert_eq!((plain.reuse_pct, plain.flip_mean), (100.0, 0.0));
            prop_assert_eq!(outcome(&source, super::super::DEFAULT_RULE).flip_mean, 0.0);
        }
    }
}
