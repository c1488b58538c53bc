//! Reuse over time: each eye takes hits of the same eye in the previous frame (Badt, "Two Algorithms for
//! Taking Advantage of Temporal Coherence in Ray Tracing", The Visual Computer 4, 1988), beside or together
//! with reuse between the eyes.
//!
//! A pair of the same eye in two frames is a stereo pair to all other modules: the previous frame stands for
//! the left eye, the current one for the right. Only the costs differ ([`Way::Previous`]): the previous frame
//! was traced before, and its G-buffer has to stay in DRAM.
//!
//! The previous frame is taken as completely traced, so errors do not add up over a sequence.

use super::cache::Misses;
use super::compose::Reuse;
use super::config::SgrtConfig;
use super::detect::{Decision, decide};
use super::frame::{Frame, FrameError, RaySource};
use super::hardware::{Kept, RemainingWork, misses_in_usual_order, misses_of_retests};
use super::loaded::LoadedTrace;
use super::reads::Reads;
use super::rules::Rule;
use super::run::Run;
use super::ways::{FramePart, Way, sum_of_parts};
use super::work::BatchWork;
use super::{cache, energy_bounds};
use formats::raytrace::{RayTriangle, RaytraceTables};
use formats::view::Eye;
use serde::Serialize;
use std::collections::BTreeMap;

/// Reasons why two traces are not frames of one sequence.
#[derive(Debug, thiserror::Error)]
pub enum TemporalError {
    /// Unreadable or unsupported frames.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// Traces that differ in more than the camera.
    #[error("{what}: expected those of the previous frame, found others")]
    Different {
        /// What differs.
        what: &'static str,
    },
    /// A triangle that is at different places.
    #[error(
        "triangle {primitive}: expected its place in the previous frame, found another: frames of moving scenes cannot be reused"
    )]
    Moved {
        /// Its number.
        primitive: u32,
    },
}

/// A way of rendering a frame of a sequence.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Scheme {
    /// Both eyes completely traced.
    Full,
    /// The right eye from the left one.
    Stereo,
    /// Each eye from its previous frame.
    Temporal,
    /// The left eye from its previous frame, the right eye from the left one.
    Both,
}

impl Scheme {
    /// All schemes.
    pub const ALL: [Self; 4] = [Self::Full, Self::Stereo, Self::Temporal, Self::Both];

    /// Name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Full => "full",
            Self::Stereo => "stereo",
            Self::Temporal => "temporal",
            Self::Both => "both",
        }
    }

    /// Where an eye's reused pixels come from.
    fn source(self, eye: Eye) -> Source {
        match (self, eye) {
            (Self::Full, _) | (Self::Stereo, Eye::Left) => Source::None,
            (Self::Stereo | Self::Both, Eye::Right) => Source::OtherEye,
            (Self::Temporal, _) | (Self::Both, Eye::Left) => Source::PreviousFrame,
        }
    }
}

/// Where reused pixels come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Source {
    None,
    OtherEye,
    PreviousFrame,
}

/// What a scheme gives.
#[derive(Clone, Copy, Debug, Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct SchemeFigures {
    /// The scheme.
    pub scheme: Scheme,
    /// Pixels reused of the left and the right eye.
    pub reused_pct: [f64; 2],
    /// Rays traced for both eyes.
    pub rays: u64,
    /// Performance relative to `full`.
    pub relative_performance: f64,
    /// Energy relative to `full`.
    pub relative_energy: f64,
    /// Least and most relative energy, if the energies are scaled to 14 nm.
    pub relative_energy_bounds: [f64; 2],
    /// DRAM bytes of the frame.
    pub dram_bytes: u64,
    /// These of G-buffers.
    pub gbuffer_dram_bytes: u64,
    /// Mean FLIP of the left and the right image against the traced ones.
    pub flip_mean: [f64; 2],
}

/// A frame of a sequence. Its eyes are decoded once for all pairs.
pub struct SequenceFrame<'a> {
    source: &'a dyn RaySource,
    frame: Frame,
}

impl<'a> SequenceFrame<'a> {
    /// Decodes a frame.
    ///
    /// # Errors
    /// [`FrameError`] for an unreadable tile or unsupported eyes.
    pub fn load(source: &'a dyn RaySource) -> Result<Self, FrameError> {
        let frame = Frame::load(source)?;
        Ok(Self { source, frame })
    }
}

/// The same eye in two frames, as a stereo pair.
fn over_time(previous: &Frame, current: &Frame, eye: Eye) -> Result<Frame, TemporalError> {
    let mut tables = current.tables.clone();
    tables.triangles = merged(&previous.tables, &current.tables)?;
    let frames = [previous, current];
    tables.meta.eyes = frames.map(|frame| *frame.tables.camera(eye));
    Ok(Frame {
        tables,
        eyes: frames.map(|frame| frame.eyes[eye as usize].clone()),
        size_px: current.size_px,
    })
}

/// The triangles that either frame saw, by primitive.
fn merged(
    previous: &RaytraceTables,
    current: &RaytraceTables,
) -> Result<Vec<RayTriangle>, TemporalError> {
    let mut triangles: BTreeMap<u32, RayTriangle> = BTreeMap::new();
    for triangle in previous.triangles.iter().chain(&current.triangles) {
        let primitive = triangle.primitive;
        let known = triangles.entry(primitive).or_insert(*triangle);
        if known != triangle {
            return Err(TemporalError::Moved { primitive });
        }
    }
    Ok(triangles.into_values().collect())
}

/// Checks that only the camera differs.
fn check(previous: &RaytraceTables, current: &RaytraceTables) -> Result<(), TemporalError> {
    let size = |tables: &RaytraceTables| tables.meta.trace.hmd.eye_size_px;
    let same = [
        ("images' sizes", size(previous) == size(current)),
        ("materials", previous.materials == current.materials),
        ("lights", previous.lights == current.lights),
        ("lighting", previous.meta.lighting == current.meta.lighting),
        ("sky", previous.meta.sky == current.meta.sky),
        ("origin", previous.meta.origin == current.meta.origin),
        (
            "levels of reflection",
            previous.meta.max_depth == current.meta.max_depth,
        ),
        ("hierarchy", previous.bvh == current.bvh),
        (
            "visits",
            previous.meta.has_visits == current.meta.has_visits,
        ),
    ];
    match same.into_iter().find(|(_, same)| !same) {
        Some((what, _)) => Err(TemporalError::Different { what }),
        None => Ok(()),
    }
}

/// A stereo pair, or the same eye in two frames, with decisions on its second image.
struct Pair<'a> {
    loaded: LoadedTrace<'a>,
    decisions: Vec<Decision>,
    work: RemainingWork,
    flip_mean: f64,
}

impl<'a> Pair<'a> {
    fn new(source: &'a dyn RaySource, frame: Frame, rule: &Rule, reuse: Reuse) -> Self {
        let loaded = LoadedTrace::of(source, frame);
        let decisions = decide(&loaded.frame, &loaded.arrived, rule);
        let work = RemainingWork::new(&loaded.frame, &decisions, reuse);
        let picture = loaded.picture(&decisions, reuse);
        let flip_mean = loaded.flip(&picture).mean();
        Self {
            loaded,
            decisions,
            work,
            flip_mean,
        }
    }

    fn reused_pct(&self) -> f64 {
        let reused = self.decisions.iter().filter(|d| d.class.is_reused());
        100.0 * reused.count() as f64 / self.decisions.len().max(1) as f64
    }
}

/// The schemes on a frame, with the frame before it.
///
/// # Errors
/// [`TemporalError`] for unreadable tiles and for traces that are not frames of one sequence.
pub fn schemes(
    previous: &SequenceFrame<'_>,
    current: &SequenceFrame<'_>,
    rule: &Rule,
    reuse: Reuse,
    config: &SgrtConfig,
) -> Result<Vec<SchemeFigures>, TemporalError> {
    check(&previous.frame.tables, &current.frame.tables)?;
    let source = current.source;
    let over_time = |eye| over_time(&previous.frame, &current.frame, eye);
    let pair = |frame| Pair::new(source, frame, rule, reuse);
    let stereo = pair(current.frame.clone());
    let temporal = [pair(over_time(Eye::Left)?), pair(over_time(Eye::Right)?)];
    let sequence = Sequence {
        current: source,
        stereo,
        temporal,
        reads: rule.reads(),
        config,
    };
    let misses = sequence.misses()?;
    let runs: Vec<Run> = Scheme::ALL
        .into_iter()
        .zip(&misses)
        .map(|(scheme, misses)| sequence.run(scheme, misses))
        .collect();
    let figures = |(scheme, run): (Scheme, &Run)| sequence.figures(scheme, run, &runs[0]);
    Ok(Scheme::ALL.into_iter().zip(&runs).map(figures).collect())
}

struct Sequence<'a> {
    current: &'a dyn RaySource,
    stereo: Pair<'a>,
    temporal: [Pair<'a>; 2],
    reads: Reads,
    config: &'a SgrtConfig,
}

impl Sequence<'_> {
    /// The pair whose second image is an eye with a source.
    fn pair(&self, scheme: Scheme, eye: Eye) -> Option<&Pair<'_>> {
        match scheme.source(eye) {
            Source::None => None,
            Source::OtherEye => Some(&self.stereo),
            Source::PreviousFrame => Some(&self.temporal[eye as usize]),
        }
    }

    fn figures(&self, scheme: Scheme, run: &Run, full: &Run) -> SchemeFigures {
        let of_eyes = |figure: &dyn Fn(&Pair<'_>) -> f64| {
            [Eye::Left, Eye::Right].map(|eye| self.pair(scheme, eye).map_or(0.0, figure))
        };
        SchemeFigures {
            scheme,
            reused_pct: of_eyes(&|pair| pair.reused_pct()),
            rays: run.work.by_class.iter().map(|class| class.rays).sum(),
            relative_performance: run.performance_over(full),
            relative_energy: run.energy_over(full),
            relative_energy_bounds: energy_bounds::relative_bounds(&run.energy, &full.energy),
            dram_bytes: run.dram.total(),
            gbuffer_dram_bytes: run.dram.gbuffer_bytes,
            flip_mean: of_eyes(&|pair| pair.flip_mean),
        }
    }

    fn part<'s>(
        &'s self,
        pair: &'s Pair<'_>,
        way: Way,
        side: Eye,
        misses: &'s [Misses],
    ) -> FramePart<'s> {
        FramePart {
            model: pair.loaded.model(self.reads, self.config),
            way,
            side,
            work: &pair.work.tiles,
            misses,
        }
    }

    /// The cost of the current frame, from the misses of each eye's batches.
    fn run(&self, scheme: Scheme, misses: &[Vec<Misses>; 2]) -> Run {
        let mut parts = Vec::new();
        for eye in [Eye::Left, Eye::Right] {
            let misses = &misses[eye as usize];
            match scheme.source(eye) {
                Source::None => {
                    // With stereo reuse, the left eye's tiles are also projected.
                    let way = match scheme {
                        Scheme::Full => Way::Reference,
                        _ => Way::Reprojected,
                    };
                    parts.push(self.part(&self.stereo, way, eye, misses));
                }
                Source::OtherEye => {
                    if scheme == Scheme::Both {
                        parts.push(self.part(&self.stereo, Way::Projected, Eye::Left, &[]));
                    }
                    parts.push(self.part(&self.stereo, Way::Reprojected, eye, misses));
                }
                Source::PreviousFrame => {
                    let pair = &self.temporal[eye as usize];
                    parts.push(self.part(pair, Way::Previous, Eye::Left, &[]));
                    parts.push(self.part(pair, Way::Previous, Eye::Right, misses));
                }
            }
        }
        sum_of_parts(&parts)
    }

    /// Misses of each eye's batches by tile, for each scheme.
    fn misses(&self) -> Result<Vec<[Vec<Misses>; 2]>, FrameError> {
        let frame = self.stereo.loaded.frame();
        let bvh = &frame.tables.bvh;
        let works =
            Scheme::ALL.map(|scheme| [Eye::Left, Eye::Right].map(|eye| self.works(scheme, eye)));
        if !frame.tables.meta.has_visits {
            let by_rates = |work: &BatchWork| cache::by_rates(work, bvh, self.config);
            let of_eye = |works: Vec<BatchWork>| works.iter().map(by_rates).collect();
            return Ok(works.map(|of_scheme| of_scheme.map(of_eye)).into());
        }
        let kept = Scheme::ALL.map(|scheme| {
            move |eye, sample, class| {
                let pair = self.pair(scheme, eye);
                pair.is_none_or(|pair| pair.work.traces(sample, class))
            }
        });
        let choices = kept.each_ref().map(|kept| (kept as &Kept<'_>, self.config));
        let mut misses = misses_in_usual_order(self.current, frame, &choices)?;
        let of_eyes = misses.iter_mut().flatten().zip(works.iter().flatten());
        for (misses, works) in of_eyes {
            for (misses, work) in misses.iter_mut().zip(works) {
                misses.add(&misses_of_retests(work, bvh, self.config));
            }
        }
        Ok(misses)
    }

    /// The work of an eye's batches.
    fn works(&self, scheme: Scheme, eye: Eye) -> Vec<BatchWork> {
        let Some(pair) = self.pair(scheme, eye) else {
            let full = self.stereo.work.tiles.iter().map(|work| match eye {
                Eye::Left => work.left,
                Eye::Right => work.right_full,
            });
            return full.collect();
        };
        pair.work.tiles.iter().map(|work| work.right).collect()
    }
}

#[cfg(test)]
mod tests;
