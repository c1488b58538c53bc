//! The result of `replay reproject`: plain data for the printers.

use super::accuracy::Accuracy;
use super::compose::Reuse;
use super::config::SgrtConfig;
use super::dram::DramBytes;
use super::hardware::Comparison;
use super::hierarchy_update::HierarchyUpdate;
use super::reads::Reads;
use super::rows::RowSummary;
use super::rules::Rule;
use super::run::{EnergyPj, Run};
use super::tile_orders::TileOrders;
use super::timing::{CycleTiming, Timing};
use serde::{Deserialize, Serialize};
use sim::paper::sgrt::PaperValues;
use sim::result::TraceId;

/// Schema of the object that `replay reproject --json` prints.
pub const SCHEMA: &str = "replay.reproject/3";

/// The result for one trace.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct Report {
    /// [`SCHEMA`].
    pub schema: String,
    /// Program and version.
    pub tool: String,
    /// Version of the models.
    pub model_version: u32,
    /// The trace.
    pub trace: TraceId,
    /// Triangles of the scene.
    pub scene_triangles: u64,
    /// Width and height of one eye's image.
    pub eye_size_px: [u32; 2],
    /// Whether the paper's row test applies to the eyes.
    pub rows: RowSummary,
    /// The whole configuration.
    pub config: Config,
    /// Result of the selected rule.
    pub result: Outcome,
    /// Result of the paper's plain reuse of every arrival.
    pub plain: Outcome,
    /// The update of the hierarchy from the frame before, if the trace states one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hierarchy_update: Option<HierarchyUpdate>,
    /// The paper's values, if the trace stands in for one of its scenes.
    pub paper: Option<PaperValues>,
    /// Unit cycles saved against image error, if requested.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub curve: Vec<CurvePoint>,
    /// Effect of each parameter on the ratios, if requested.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub sensitivity: Vec<Sensitivity>,
}

/// The configuration of the run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct Config {
    /// Error detection.
    pub rule: Rule,
    /// What a reused pixel takes from the left one.
    pub reuse: Reuse,
    /// Source of cache misses: `addresses` of the trace or hit `rates`.
    pub cache_misses: String,
    /// Model of the units' time.
    #[serde(default)]
    pub timing: Timing,
    /// The hardware.
    pub model: SgrtConfig,
    /// Kinds of the traced rays; empty for all.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub rays: Vec<String>,
    /// The order of the tiles, if one was chosen.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tiles: Option<TileOrders>,
}

/// The figures of a rule and a level of reuse.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct Outcome {
    /// Share of right pixels reused, overlapped ones included.
    pub reuse_pct: f64,
    /// Share of right pixels reused with a hit on another object than the true one.
    pub wrong_object_pct: f64,
    /// Right object, another triangle, and more than one pixel off: part of `position_over_1px_pct`.
    pub wrong_primitive_pct: f64,
    /// Right object, more than one pixel off.
    pub position_over_1px_pct: f64,
    /// Right object, more than two pixels off.
    pub position_over_2px_pct: f64,
    /// Frames per second relative to tracing both eyes completely.
    pub relative_performance: f64,
    /// Energy relative to tracing both eyes completely.
    pub relative_energy: f64,
    /// Least and most relative energy, if the energies are scaled to 14 nm.
    #[serde(default)]
    pub relative_energy_bounds: [f64; 2],
    /// Unit cycles of tracing both eyes completely over those with reprojection: the relative performance
    /// if the units were always the bottleneck.
    pub tni_relative_performance: f64,
    /// Share of primary rays in the traversal steps of both eyes. Reusing a share r of primary hits can
    /// save at most half of r times this.
    pub primary_steps_pct: f64,
    /// Cycles of the traversal and intersection units.
    pub tni_cycles: u64,
    /// Cycles of the programmable cores.
    pub srp_cycles: u64,
    /// The same with both eyes completely traced.
    pub reference_tni_cycles: u64,
    /// The same with both eyes completely traced.
    pub reference_srp_cycles: u64,
    /// Unit cycles saved, relative to both eyes completely traced.
    pub tni_reduction_pct: f64,
    /// Unit cycles saved, relative to the right eye completely traced.
    pub right_tni_reduction_pct: f64,
    /// Kernel cycles added by reprojection, relative to the reference.
    pub srp_overhead_pct: f64,
    /// The scarcest resource of the units.
    pub tni_bottleneck: String,
    /// Time of the frame in the model.
    pub time_us: f64,
    /// Time during which external memory is the bottleneck.
    pub memory_bound_us: f64,
    /// Time of the reference in the model.
    pub reference_time_us: f64,
    /// The same with both eyes completely traced.
    pub reference_memory_bound_us: f64,
    /// Mean FLIP of the right image relative to the traced one.
    pub flip_mean: f64,
    /// 99th percentile of FLIP.
    pub flip_p99: f64,
    /// Pixels per degree used for FLIP.
    pub pixels_per_degree: f64,
    /// Peak signal-to-noise ratio; 100 for identical pictures.
    pub psnr_db: f64,
    /// Structural similarity.
    pub ssim: f64,
    /// Pixels by class and their errors.
    pub classes: Accuracy,
    /// Rays, steps and triangle tests.
    pub work: Work,
    /// The same with both eyes completely traced.
    pub reference_work: Work,
    /// The fields that error detection reads of left pixels.
    pub detection_reads: Reads,
    /// Row buffers that hold them: one band's rows if they come from DRAM, all live rows if they stay on chip.
    pub detection_sram_bytes: u64,
    /// Bytes read from and written to the tile buffers.
    pub on_chip_bytes: u64,
    /// Bytes read from and written to external memory.
    pub dram: DramBytes,
    /// The same with both eyes completely traced.
    pub reference_dram: DramBytes,
    /// The same with the whole screen's G-buffer in DRAM.
    pub whole_screen: WholeScreen,
    /// Energy by component.
    pub energy: EnergyPj,
    /// The same with both eyes completely traced.
    pub reference_energy: EnergyPj,
    /// The cycle-level model, if it was used.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cycles: Option<CycleTiming>,
}

/// Reprojection without tiles: the whole screen's G-buffer in DRAM.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct WholeScreen {
    /// Frames per second relative to tracing both eyes completely.
    pub relative_performance: f64,
    /// Energy relative to tracing both eyes completely.
    pub relative_energy: f64,
    /// Bytes read from and written to external memory.
    pub dram: DramBytes,
}

/// Work of a frame on the units.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct Work {
    /// Rays.
    pub rays: u64,
    /// Traversal steps.
    pub steps: u64,
    /// Triangle tests, including re-tests.
    pub triangle_tests: u64,
    /// Re-tests of reused triangles.
    pub retests: u64,
    /// Shading kernels run.
    pub shaded: u64,
    /// Lines that missed in an L1.
    pub l1_misses: u64,
    /// Lines that missed in the L2.
    pub l2_misses: u64,
}

impl Work {
    fn of(run: &Run) -> Self {
        Self {
            rays: run.work.rays(),
            steps: run.work.steps(),
            triangle_tests: run.work.triangle_tests(),
            retests: run.work.retest_tests,
            shaded: run.work.shaded,
            l1_misses: run.misses.l1_lines.round() as u64,
            l2_misses: run.misses.l2_lines.round() as u64,
        }
    }
}

/// A point of the curve of run time against error.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct CurvePoint {
    /// Error detection.
    pub rule: Rule,
    /// What a reused pixel takes from the left one.
    pub reuse: Reuse,
    /// Share of right pixels reused.
    pub reuse_pct: f64,
    /// Share of right pixels with a wrong object.
    pub wrong_object_pct: f64,
    /// Unit cycles saved, relative to both eyes completely traced.
    pub tni_reduction_pct: f64,
    /// Frames per second relative to the reference.
    pub relative_performance: f64,
    /// Energy relative to the reference.
    pub relative_energy: f64,
    /// Mean FLIP.
    pub flip_mean: f64,
    /// 99th percentile of FLIP.
    pub flip_p99: f64,
}

/// Effect of a parameter on the ratios.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct Sensitivity {
    /// Dotted name.
    pub parameter: String,
    /// Its value.
    pub value: f64,
    /// Relative performance with half and with twice the value (for a rate, of its miss rate).
    pub relative_performance: [f64; 2],
    /// Relative energy with half and with twice the value.
    pub relative_energy: [f64; 2],
}

/// Error of the right image.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ImageError {
    /// Mean FLIP.
    pub flip_mean: f64,
    /// 99th percentile of FLIP.
    pub flip_p99: f64,
    /// Pixels per degree.
    pub pixels_per_degree: f64,
    /// Peak signal-to-noise ratio.
    pub psnr_db: f64,
    /// Structural similarity.
    pub ssim: f64,
}

impl Outcome {
    /// Combines the figures.
    pub fn new(
        accuracy: &Accuracy,
        comparison: &Comparison,
        error: &ImageError,
        reads: Reads,
        detection_sram_bytes: u64,
    ) -> Self {
        let reused = accuracy.all_reused();
        let (reference, run) = (&comparison.reference, &comparison.reprojected);
        let whole_screen = &comparison.whole_screen;
        let saved_pct = |part: f64, whole: f64| {
            if whole > 0.0 {
                100.0 * (1.0 - part / whole)
            } else {
                0.0
            }
        };
        let cycles = |c: f64| c.round() as u64;
        Self {
            reuse_pct: accuracy.pct(reused.pixels),
            wrong_object_pct: accuracy.pct(reused.wrong_object),
            wrong_primitive_pct: accuracy.pct(reused.wrong_primitive),
            position_over_1px_pct: accuracy.pct(reused.position_over_1px),
            position_over_2px_pct: accuracy.pct(reused.position_over_2px),
            relative_performance: comparison.relative_performance(),
            relative_energy: comparison.relative_energy(),
            relative_energy_bounds: comparison.relative_energy_bounds(),
            tni_relative_performance: reference.tni_cycles / run.tni_cycles,
            primary_steps_pct: 100.0 * reference.work.by_class[0].steps as f64
                / reference.work.steps().max(1) as f64,
            tni_cycles: cycles(run.tni_cycles),
            srp_cycles: cycles(run.srp.total()),
            reference_tni_cycles: cycles(reference.tni_cycles),
            reference_srp_cycles: cycles(reference.srp.total()),
            tni_reduction_pct: saved_pct(run.tni_cycles, reference.tni_cycles),
            right_tni_reduction_pct: saved_pct(
                comparison.right_tni_cycles,
                comparison.right_full_tni_cycles,
            ),
            srp_overhead_pct: 100.0 * run.srp.added_lane_cycles() / reference.srp.lane_cycles(),
            tni_bottleneck: run.tni.bottleneck().to_owned(),
            time_us: run.time_ns * 1e-3,
            memory_bound_us: run.memory_bound_ns * 1e-3,
            reference_time_us: reference.time_ns * 1e-3,
            reference_memory_bound_us: reference.memory_bound_ns * 1e-3,
            flip_mean: error.flip_mean,
            flip_p99: error.flip_p99,
            pixels_per_degree: error.pixels_per_degree,
            psnr_db: error.psnr_db,
            ssim: error.ssim,
            classes: *accuracy,
            work: Work::of(run),
            reference_work: Work::of(reference),
            detection_reads: reads,
            detection_sram_bytes,
            on_chip_bytes: run.on_chip_bytes,
            dram: run.dram,
            reference_dram: reference.dram,
            whole_screen: WholeScreen {
                relative_performance: whole_screen.performance_over(reference),
                relative_energy: whole_screen.energy_over(reference),
                dram: whole_screen.dram,
            },
            energy: run.energy,
            reference_energy: reference.energy,
            cycles: None,
        }
    }
}
