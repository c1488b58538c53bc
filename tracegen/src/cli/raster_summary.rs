//! Summary of `tracegen raster`: what was drawn, recorded and skipped, and the times.

use crate::cut_triangles::CutTriangles;
use crate::study::world::World;
use crate::study::{memory, processor};
use crate::unstable_triangles::UnstableTriangles;
use formats::view::EyeView;
use raster::backend::{CaptureBackend, Work};
use raster::capture::CaptureJob;
use raster::error::RasterError;
use raster::frame::{Frame, Skipped};
use record::CaptureCounts;
use scene::Scene;
use shell::note;
use std::time::{Duration, Instant};
use techniques::layer::Predicted;
use visibility::Occlusion;

/// Work that a stage submitted over all frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Submitted {
    draws: u64,
    calls: u64,
    regions: u64,
}

impl Submitted {
    /// Adds the difference of two readings of a backend's work.
    pub fn add(&mut self, before: Work, after: Work) {
        let work = after - before;
        self.draws += work.draws;
        self.calls += work.calls;
        self.regions += work.regions;
    }
}

impl std::fmt::Display for Submitted {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} draws in {} calls", self.draws, self.calls)
    }
}

/// Sums over the frames.
#[derive(Default)]
pub struct Summary {
    /// Draws per stage. Warming up the driver and comparing depths are not counted.
    pub shadow_draws: Submitted,
    pub plain_draws: Submitted,
    pub capture_draws: Submitted,
    pub shadows: Duration,
    pub plain: Duration,
    pub captured: Duration,
    /// Processor time of the plain renders and of the captures; zero if the system does not report it.
    pub plain_work: Duration,
    pub captured_work: Duration,
    pub sorting: Duration,
    pub counts: CaptureCounts,
    pub predicted: Vec<Predicted>,
    /// Triangles of the first frame that may be lost.
    pub doubtful: Option<DoubtfulTriangles>,
    /// Share of the first frame's pixels that something covers.
    pub covered: Option<f64>,
    /// What was found identical with and without capture.
    pub compared: Option<&'static str>,
    pub looking: Duration,
    pub culling: Duration,
    pub cull_tests: u64,
    pub occlusion: Occlusion,
    pub occlusion_tests: u64,
    pub occluded: u64,
    pub skipped: Skipped,
}

/// Triangles of a frame that rounding or a plane may take away.
#[derive(Default)]
pub struct DoubtfulTriangles {
    unstable: UnstableTriangles,
    cut: CutTriangles,
}

impl DoubtfulTriangles {
    /// Adds the triangles of a view.
    pub fn look(&mut self, world: &World, view: &EyeView) {
        let (scene, draws, size_px) = (&world.scene, &world.draws, world.hmd.eye_size_px);
        self.unstable.look(scene, draws, view, size_px);
        self.cut.look(scene, draws, view, size_px);
    }

    /// Warns of those that may affect a visible share of a frame's `fragments`.
    pub fn warn(&self, scene: &Scene, fragments: u64) {
        let unstable = self.unstable.warnings(scene, fragments);
        for warning in self.cut.warnings(scene).iter().chain(&unstable) {
            shell::warn(warning);
        }
    }
}

impl Summary {
    /// Renders the shadow maps of a frame.
    pub fn light(
        &mut self,
        job: &CaptureJob<'_>,
        backend: &mut dyn CaptureBackend,
        frame: &Frame,
    ) -> Result<(), RasterError> {
        let before = backend.work();
        self.shadows += job.light(backend, frame)?;
        self.shadow_draws.add(before, backend.work());
        Ok(())
    }

    /// Removes the draws of a planned frame that others hide.
    pub fn occlude(
        &mut self,
        job: &CaptureJob<'_>,
        backend: &mut dyn CaptureBackend,
        frame: &mut Frame,
    ) -> Result<(), RasterError> {
        let start = Instant::now();
        if job.planner.settings().occlusion {
            job.occlude(backend, frame, &mut self.occlusion)?;
        }
        self.looking += frame.plan_time + start.elapsed();
        self.skipped += frame.skipped;
        self.cull_tests += frame.cull_tests;
        self.occlusion_tests += frame.occlusion_tests;
        self.occluded += frame.occluded;
        self.culling += frame.cull_time;
        Ok(())
    }

    /// Prints figures about the run.
    pub fn print(&self, frames: usize, work: &Work) {
        self.print_work(frames, work);
        self.print_times();
        if let Some(bytes) = memory::peak_bytes() {
            note(&format!(
                "peak memory    {:.0} MiB",
                bytes as f64 / f64::from(1 << 20)
            ));
        }
    }

    /// What was recorded, and the size of the trace.
    pub fn result(
        &self,
        [frames, views]: [usize; 2],
        size_px: [u32; 2],
        file_bytes: u64,
    ) -> String {
        let CaptureCounts {
            quads,
            fragments,
            records,
            masked_lanes_killed,
            not_finite,
            tile_bytes,
            ..
        } = self.counts;
        let per = |bytes: u64, n: u64| bytes as f64 / n.max(1) as f64;
        let pixels = (views * frames) as f64 * f64::from(size_px[0]) * f64::from(size_px[1]);
        let mut lines = vec![format!(
            "{frames} frame(s), {views} x {}x{}: {quads} quads, {fragments} fragments ({:.2} a pixel), {records} records",
            size_px[0],
            size_px[1],
            fragments as f64 / pixels
        )];
        let mean = |share: fn(&Predicted) -> Option<f32>| {
            let shares: Option<Vec<f32>> = self.predicted.iter().map(share).collect();
            shares.map(|shares| shares.iter().sum::<f32>() / shares.len().max(1) as f32)
        };
        if let (Some(rate), Some(shaded)) = (mean(|p| p.rate_share), mean(|p| p.shaded_share)) {
            lines.push(format!(
                "{:.2} % of the pixels are open to be shaded: {:.2} % by their rates, the rest for reconstruction",
                shaded * 100.0,
                rate * 100.0
            ));
        }
        if masked_lanes_killed > 0 {
            lines.push(format!(
                "{masked_lanes_killed} fragments of alpha-masked draws lie behind earlier ones of their draw"
            ));
        }
        if not_finite > 0 {
            shell::warn(&format!(
                "{not_finite} records with texture coordinates that are not finite were left out"
            ));
        }
        lines.push(format!(
            "file {file_bytes} bytes; tiles {:.2} bytes a quad, {:.2} a record ({} raw)",
            per(tile_bytes, quads),
            per(tile_bytes, records),
            record::RECORD_BYTES
        ));
        lines.join("\n")
    }

    /// What was drawn and skipped.
    fn print_work(&self, frames: usize, work: &Work) {
        note(&format!(
            "shadow maps    {} in {:.3} s: {}",
            work.shadow_maps,
            self.shadows.as_secs_f64(),
            self.shadow_draws
        ));
        note(&format!(
            "driver         {} pipelines, {} samplers",
            work.pipelines, work.samplers
        ));
        note(&format!(
            "culling        {} boxes tested, {} more against depth that hides {} draws, in {:.3} ms a frame",
            self.cull_tests,
            self.occlusion_tests,
            self.occluded,
            self.culling.as_secs_f64() * 1e3 / frames as f64
        ));
        note(&format!(
            "never drawn    {} empty tiles, {} shadow cascades that nobody sees (draws found in {:.3} s)",
            self.counts.empty_tiles,
            self.skipped.cascades,
            self.looking.as_secs_f64()
        ));
    }

    fn print_times(&self) {
        let captured = self.captured.as_secs_f64();
        let includes = "all views";
        if !self.plain.is_zero() {
            let plain = self.plain.as_secs_f64();
            note(&format!(
                "plain render   {plain:.3} s ({includes}, reading the pictures back): {}",
                self.plain_draws
            ));
            note(&format!(
                "with capture   {captured:.3} s ({includes}, draining, and {:.3} s of sorting, encoding and writing the trace): {:.2} x plain; {}, {} regions",
                self.sorting.as_secs_f64(),
                captured / plain,
                self.capture_draws,
                self.capture_draws.regions
            ));
            let (plain, captured) = (
                self.plain_work.as_secs_f64(),
                self.captured_work.as_secs_f64(),
            );
            if plain > 0.0 {
                note(&format!(
                    "processors     {plain:.3} s plain, {captured:.3} s with capture: {:.2} x plain",
                    captured / plain
                ));
            }
            if let Some(what) = self.compared {
                note(&format!("{what} with and without capture: identical"));
            }
        } else {
            note(&format!(
                "with capture   {captured:.3} s ({includes}, draining, sorting, encoding and writing the trace): {}, {} regions",
                self.capture_draws, self.capture_draws.regions
            ));
        }
    }
}

/// Processor time since `before`.
pub fn worked_since(before: Option<Duration>) -> Duration {
    let since = before
        .zip(processor::time())
        .map(|(before, now)| now.saturating_sub(before));
    since.unwrap_or_default()
}
