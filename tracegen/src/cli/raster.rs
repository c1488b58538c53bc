//! `tracegen raster`.

use super::cache_args::CacheArgs;
use super::choice::choice;
use super::objective_args::ObjectiveArgs;
use super::path_args::{PathArgs, frame_count};
use super::raster_auto::Techniques;
use super::scene_args::{SceneArgs, SceneSetup, capture_outputs};
use super::technique_args::TechniqueArgs;
use crate::study::auto::{Budget, Schedule};
use anyhow::{bail, ensure};
use clap::Args;
use clap::builder::TypedValueParser;
use formats::textrace::{Encoding, Pass, Tables, TraceMeta};
use formats::view::Eye;
use raster::backend::{CaptureBackend, Fragments};
use raster::draws::DrawList;
use raster::drivers::Driver;
use scene::Scene;
use shell::{Threads, lasting_arguments};
use std::path::PathBuf;
use techniques::skips::Skip;
use textures::TextureSet;

/// Cascades that `--shadows` adds (Z2 paper section 4.1).
const CASCADES: u32 = 4;

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
    /// Frames along the path.
    #[arg(long, value_name = "N", default_value_t = 1, help_heading = "Camera",
          value_parser = frame_count())]
    pub(super) frames: u32,
    /// Light the scene through 4 shadow cascades of 2048x2048.
    #[arg(long)]
    pub(super) shadows: bool,
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
                                "cull_distance", "cull_px", "far_field", "foveate",
                                "views", "no_plain", "shade", "no_skip"])]
    auto: Option<Budget>,
    #[command(flatten)]
    objective: ObjectiveArgs,
    /// Render with techniques by name: `TECHNIQUE` as in `tracegen techniques --only`, joined by `+`,
    /// followed by exceptions for single frames, `,FRAME:TECHNIQUE` or `,FIRST-LAST:TECHNIQUE`. `--auto`
    /// prints its choice in this form.
    #[arg(long, value_name = "TECHNIQUE", help_heading = "Techniques",
          conflicts_with_all = ["auto", "cull", "occlusion", "multiview", "hidden_area_mask", "far_field", "foveate",
                                "views", "no_plain", "shade", "no_skip"])]
    technique: Option<Schedule>,
    #[command(flatten)]
    pub(super) techniques: TechniqueArgs,
    #[command(flatten)]
    pub(super) cache: CacheArgs,
    #[command(flatten)]
    threads: Threads,
}

impl RasterArgs {
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
        Ok(width * height * views * u64::from(self.frames))
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

pub(super) fn encoding_parser() -> impl TypedValueParser<Value = Encoding> {
    choice([
        ("delta", Encoding::Delta, "Bit-packed differences"),
        (
            "planes",
            Encoding::Planes,
            "A plane for each primitive: about 0.5 of the size, slower to read and to write",
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
            .or_else(|| self.techniques.beyond_plain_frames())
        {
            bail!(
                "{flag}: expected with --backend lavapipe, found with osmesa, which captures plain frames alone"
            );
        }
        Ok(())
    }

    /// Refuses options that depend on the depth test.
    fn check_without_depth_test(&self) -> anyhow::Result<()> {
        ensure!(
            !self.techniques.has_far_field(),
            "--hsr none: expected every fragment to be drawn, found --far-field, whose layers hold only what the depth of others leaves open"
        );
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

/// Runs `tracegen raster`.
///
/// # Errors
/// Unreadable input, no driver, or a file that cannot be written.
pub fn run(args: &RasterArgs) -> anyhow::Result<()> {
    prepare_environment(args.threads.count);
    args.threads.start()?;
    let outputs = capture_outputs(&args.output, args.image.as_deref());
    args.scene.check_outputs(&args.path, &outputs)?;
    shell::check_outputs(
        &outputs,
        args.techniques.inputs().iter().map(PathBuf::as_path),
    )?;
    if args.hsr == Fragments::All {
        args.check_without_depth_test()?;
    }
    if args.backend == Driver::Osmesa {
        args.check_plain_frames()?;
    }
    let objective = args.objective.of(args.auto)?;
    let techniques = match (args.auto, &args.technique) {
        (Some(budget), _) => Techniques::Chosen(budget, objective),
        (None, Some(schedule)) => Techniques::Named(Box::new(schedule.clone())),
        (None, None) => return super::raster_frames::run(args, &outputs),
    };
    super::raster_auto::run(args, &techniques, &outputs)
}

/// Shadow cascades of a scene, or the cascades that `--shadows` adds.
pub(super) fn cascades(scene: &Scene, shadows: bool) -> u32 {
    if shadows {
        CASCADES
    } else {
        scene.shadow_cascades.min(CASCADES)
    }
}

/// The tables of a trace of the scene's frames that records `fragments`.
pub(super) fn tables(
    setup: &SceneSetup,
    spec: &str,
    draws: &DrawList,
    uploads: &TextureSet,
    backend: &dyn CaptureBackend,
    passes: Vec<Pass>,
    fragments: Fragments,
) -> Tables {
    let textures = draws.textures(uploads);
    let (samplers, draw_table) = draws.tables(&setup.scene, uploads, &textures);
    Tables {
        meta: TraceMeta {
            tool: super::tool(),
            command_line: lasting_arguments(std::env::args_os().skip(1)),
            scene: spec.into(),
            scene_triangles: setup.scene.triangle_count(),
            camera: setup.camera.name.clone(),
            backend: backend.name().into(),
            driver: backend.driver().into(),
            seed: 0,
            hmd: setup.hmd.clone(),
            frames: setup.frames.clone(),
            surfaces: Some(draws.surfaces(fragments)),
            origin_m: setup.scene.origin.to_array(),
            techniques: None,
            program: None,
        },
        textures,
        samplers,
        draws: draw_table,
        passes,
    }
}

/// Sets the environment variables that Mesa reads.
pub(super) fn prepare_environment(threads: Option<u16>) {
    // SAFETY: the only other thread waits for signals; nothing reads the environment meanwhile.
    unsafe {
        // Mesa's device selection tries to connect to a display server, and prints errors if there is none.
        std::env::set_var("NODEVICE_SELECT", "1");
        // At narrow vectors Mesa 22.3 corrupts memory where the processor has AVX2, and on some that have AVX.
        let set = |name: &str| std::env::var_os(name);
        if set("LP_NATIVE_VECTOR_WIDTH").is_some_and(|bits| bits == "128")
            && set("GALLIUM_OVERRIDE_CPU_CAPS").is_none()
        {
            std::env::set_var("GALLIUM_OVERRIDE_CPU_CAPS", "sse4.1");
        }
        // softpipe provides all features of OpenGL 4.5 that the capture needs, as extensions of 3.3.
        if set("GALLIUM_DRIVER").is_some_and(|driver| driver == "softpipe") {
            std::env::set_var("MESA_GL_VERSION_OVERRIDE", "4.5");
            std::env::set_var("MESA_GLSL_VERSION_OVERRIDE", "450");
        }
        if let Some(threads) = threads {
            std::env::set_var("LP_NUM_THREADS", threads.to_string());
        }
    }
}

/// Bytes with an optional binary suffix: `64MiB`, `512KiB`, `1GiB`, `4096`.
pub(super) fn parse_bytes(text: &str) -> Result<u64, String> {
    let digits = text
        .find(|c: char| !c.is_ascii_digit())
        .unwrap_or(text.len());
    let (number, suffix) = text.split_at(digits);
    let shift = match suffix {
        "" | "B" => Some(0),
        "KiB" => Some(10),
        "MiB" => Some(20),
        "GiB" => Some(30),
        _ => None,
    };
    shift
        .and_then(|shift| number.parse::<u64>().ok()?.checked_mul(1 << shift))
        .filter(|bytes| *bytes >= 4096)
        .ok_or_else(|| format!("expected at least 4KiB as in 64MiB or 1048576, found '{text}'"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_take_binary_suffixes() {
        assert_eq!(parse_bytes("64MiB"), Ok(64 << 20));
        assert_eq!(parse_bytes("65536"), Ok(65536));
        for bad in ["", "MiB", "1", "64MB", "-4MiB", "99999999999999999999GiB"] {
            assert!(parse_bytes(bad).is_err(), "{bad}");
        }
    }
}
