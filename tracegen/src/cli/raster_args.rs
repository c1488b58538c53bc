//! Arguments of `tracegen raster`.

use super::cache_args::CacheArgs;
use super::capture_steps::SHADOW_FORMATS;
use super::choice::choice;
use super::drivers::Driver;
use super::frames_arg::{Chosen, Frames};
use super::objective_args::ObjectiveArgs;
use super::path_args::PathArgs;
use super::scene_args::SceneArgs;
use super::technique_args::TechniqueArgs;
use super::values::{encoding_parser, parse_bytes};
use crate::study::auto::{Budget, Schedule};
use anyhow::{bail, ensure};
use clap::Args;
use clap::builder::TypedValueParser;
use formats::textrace::Encoding;
use formats::texture::TexelFormat;
use formats::view::Eye;
use raster::backend::Fragments;
use shell::Threads;
use std::path::PathBuf;
use techniques::skips::Skip;

/// Arguments of `tracegen raster`.
#[derive(Args, Debug)]
pub struct RasterArgs {
    #[command(flatten)]
    pub(super) scene: SceneArgs,
    /// Trace to write.
    #[arg(short, long, value_name = "FILE.textrace")]
    pub(super) output: PathBuf,
    /// Picture of all views side by side.
    #[arg(long, value_name = "FILE.png")]
    pub(super) image: Option<PathBuf>,
    #[command(flatten)]
    pub(super) path: PathArgs,
    /// Frames along the path: their number, or a list of numbers and ranges without their end, as in
    /// `3,17,40..43`; the last `--frames` counts [default: 1, or all views of `--cameras`].
    #[arg(
        long,
        value_name = "N|LIST",
        help_heading = "Camera",
        overrides_with = "frames"
    )]
    frames: Option<Frames>,
    /// Frames before each run of listed frames that are captured to fill the caches.
    #[arg(long, value_name = "N", help_heading = "Camera", default_value_t = 1, value_parser = clap::value_parser!(u32).range(0..=16))]
    warm: u32,
    /// Write what the plan of each frame knows, without drawing: a trace without passes, for `replay sample`.
    #[arg(long, help_heading = "Camera",
          conflicts_with_all = ["image", "auto", "technique", "occlusion", "geometry", "warm"])]
    pub(super) plan_only: bool,
    /// Light the scene through 4 shadow cascades of 2048x2048.
    #[arg(long)]
    pub(super) shadows: bool,
    /// Format of the shadow maps that draws sample and the trace names. Smaller formats are made of finished
    /// maps, with depths rounded away from the light.
    #[arg(long, value_parser = choice(SHADOW_FORMATS), default_value = "r32f", value_name = "FORMAT",
          conflicts_with_all = ["auto", "technique", "plan_only"])]
    pub(super) shadow_format: TexelFormat,
    /// Views of each frame.
    #[arg(long, value_parser = views_parser(), default_value = "stereo", help_heading = "Camera")]
    pub(super) views: &'static [Eye],
    /// Driver that captures; osmesa captures plain frames alone, without techniques.
    #[arg(long, value_parser = driver_parser(), default_value = "lavapipe", value_name = "NAME")]
    pub(super) backend: Driver,
    /// Skip the render without capture, which times and depths are compared with.
    #[arg(long)]
    pub(super) no_plain: bool,
    /// Also draw the picture while capturing, and compare it with the picture without capture.
    #[arg(long)]
    pub(super) shade: bool,
    /// Hidden-surface removal of the renderer whose texture accesses are captured.
    #[arg(long, value_parser = hsr_parser(), default_value = "early-z")]
    pub(super) hsr: Fragments,
    /// Memory for raw records; a frame that needs more is captured in parts. The driver's limit is
    /// 128MiB.
    #[arg(long, value_name = "SIZE", default_value = "128MiB", value_parser = parse_bytes)]
    pub(super) record_budget: u64,
    /// How the trace's tiles are packed.
    #[arg(long, value_parser = encoding_parser(), default_value = "delta", value_name = "NAME")]
    pub(super) encoding: Encoding,
    /// Add the data that vertex processing reads and the primitives per tile, for `replay run --frame`.
    #[arg(long)]
    pub(super) geometry: bool,
    /// Draw or prepare invisible things as well: images, mip-levels, cascades, regions or all of them.
    /// Pictures and trace stay the same.
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    pub(super) no_skip: Vec<Skip>,
    /// Choose the techniques of each frame under a budget: `flip=ERROR` (mean FLIP inside the lens; 0 allows
    /// only lossless techniques) or `pixels=PX` choose the least cost within that error; `budget-ms=MS`
    /// chooses the least error whose median frame time stays within the budget.
    #[arg(long, value_name = "BUDGET", help_heading = "Techniques",
          conflicts_with_all = ["cull", "occlusion", "multiview", "hidden_area_mask", "hidden_area_mesh",
                                "cull_distance", "cull_px", "reuse_shading", "highlight_disparity", "far_field", "foveate",
                                "views", "no_plain", "shade", "no_skip"])]
    pub(super) auto: Option<Budget>,
    #[command(flatten)]
    pub(super) objective: ObjectiveArgs,
    /// Render with techniques by name: `TECHNIQUE` as in `tracegen techniques --only`, joined by `+`,
    /// followed by exceptions for single frames, `,FRAME:TECHNIQUE` or `,FIRST-LAST:TECHNIQUE`. `--auto`
    /// prints its choice in this form.
    #[arg(long, value_name = "TECHNIQUE", help_heading = "Techniques",
          conflicts_with_all = ["auto", "cull", "occlusion", "multiview", "hidden_area_mask", "reuse_shading", "highlight_disparity", "far_field", "foveate",
                                "views", "no_plain", "shade", "no_skip"])]
    pub(super) technique: Option<Schedule>,
    #[command(flatten)]
    pub(super) techniques: TechniqueArgs,
    #[command(flatten)]
    pub(super) cache: CacheArgs,
    #[command(flatten)]
    pub(super) threads: Threads,
}

impl RasterArgs {
    /// Number of frames.
    pub(super) fn frames(&self) -> u32 {
        let frames = self.frames.as_ref().map(Frames::end);
        frames.or(self.path.cameras).unwrap_or(1)
    }

    /// The listed frames and the frames that warm them, or none if a path is captured from its start.
    pub(super) fn chosen(&self) -> Option<Chosen> {
        Some(Chosen::new(self.frames.as_ref()?.list()?, self.warm))
    }

    /// Refuses a list of frames beside options with which a frame depends on the frames before it.
    ///
    /// # Errors
    /// Such an option.
    pub(super) fn check_frames(&self) -> anyhow::Result<()> {
        let listed = self
            .frames
            .as_ref()
            .is_some_and(|frames| frames.list().is_some());
        let depends = [
            (self.auto.is_some(), "--auto"),
            (self.technique.is_some(), "--technique"),
            (self.techniques.occludes(), "--occlusion"),
        ];
        match depends.iter().find(|flag| flag.0 && listed) {
            Some((_, flag)) => bail!(
                "{flag}: expected a number of frames, found a list, whose frames would need all frames before them"
            ),
            None => Ok(()),
        }
    }

    /// Pixels of all frames, as far as they are known without the scene.
    ///
    /// # Errors
    /// An invalid display.
    pub(super) fn pixels(&self) -> anyhow::Result<u64> {
        let [width, height] = self
            .scene
            .hmd
            .resolve(None, None)?
            .eye_size_px
            .map(u64::from);
        let views = self.views.len() as u64;
        Ok(width * height * views * u64::from(self.frames()))
    }
}

fn driver_parser() -> impl TypedValueParser<Value = Driver> {
    choice([
        (
            "lavapipe",
            Driver::Lavapipe,
            "Mesa's Vulkan driver on the processor",
        ),
        (
            "osmesa",
            Driver::Osmesa,
            "OpenGL without a window, through llvmpipe or (GALLIUM_DRIVER=softpipe) softpipe",
        ),
        (
            "auto",
            Driver::Auto,
            "lavapipe where it is found, else OSMesa",
        ),
    ])
}

fn views_parser() -> impl TypedValueParser<Value = &'static [Eye]> {
    const BOTH: &[Eye] = &[Eye::Left, Eye::Right];
    choice([
        ("stereo", BOTH, "Both eyes, left before right"),
        ("left", &BOTH[..1], "The left eye alone"),
        ("right", &BOTH[1..], "The right eye alone"),
    ])
}

/// Names as in `replay run --hsr`.
fn hsr_parser() -> impl TypedValueParser<Value = Fragments> {
    choice([
        (
            "none",
            Fragments::All,
            "Every fragment that a draw covers, whatever lies before it; for `replay run --hsr none`",
        ),
        (
            "early-z",
            Fragments::DepthTested,
            "Fragments that pass the depth test when they are drawn; for `--hsr early-z` and `deferred`",
        ),
    ])
}

impl RasterArgs {
    /// Refuses options that the OSMesa backend does not support.
    pub(super) fn check_plain_frames(&self) -> anyhow::Result<()> {
        let auto = self.auto.map(|_| "--auto");
        let named = self.technique.as_ref().map(|_| "--technique");
        if let Some(flag) = auto
            .or(named)
            .or((self.shadow_format != TexelFormat::R32f).then_some("--shadow-format"))
            .or_else(|| self.techniques.beyond_plain_frames())
        {
            bail!(
                "{flag}: expected with --backend lavapipe, found with osmesa, which captures plain frames alone"
            );
        }
        Ok(())
    }

    /// Refuses options that depend on the depth test.
    pub(super) fn check_without_depth_test(&self) -> anyhow::Result<()> {
        if let Some(flag) = self.techniques.layers_by_depth() {
            bail!(
                "--hsr none: expected every fragment to be drawn, found {flag}, whose layers hold only what the depth of others leaves open"
            );
        }
        ensure!(
            self.auto.is_none(),
            "--hsr none: expected techniques by their own options, found --auto, which measures frames with the depth test"
        );
        ensure!(
            self.technique.is_none(),
            "--hsr none: expected techniques by their own options, found --technique, which captures with the depth test"
        );
        Ok(())
    }
}
