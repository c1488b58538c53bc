//! Flags for the scene, the camera and the display.

use super::path_args::PathArgs;
use super::pose_args::PoseArgs;
use clap::Args;
use clap::builder::{OsStringValueParser, TypedValueParser};
use formats::error::{Broken, ensure};
use formats::view::{FovTangents, FrameViews, Hmd};
use glam::{DVec3, Vec3};
use scene::paths::{HeadPath, Moments};
use scene::{Camera, LoadOptions, Loaded, Scene, cameras, hmd, units};
use scenes::load_with;
use shell::Output;
use std::ops::{Deref, Range};
use std::path::{Path, PathBuf};

/// Scene, camera and display of a capture.
#[derive(Args, Clone, Debug)]
pub struct SceneArgs {
    /// A built-in scene (see `tracegen scenes`) or a .gltf, .glb or .obj file.
    ///
    /// The images of a file may decode to at most 512 MiB of RGBA8 texels, or to 128 bytes per byte of their
    /// files if that is more.
    #[arg(value_name = "SCENE", value_parser = SceneSpec::parser())]
    pub scene: SceneSpec,
    /// Material variant of a glTF file to show (KHR_materials_variants).
    #[arg(long, value_name = "NAME")]
    pub variant: Option<String>,
    /// Time and animation.
    #[command(flatten)]
    pub pose: PoseArgs,
    /// Camera flags.
    #[command(flatten)]
    pub camera: CameraArgs,
    /// Display flags.
    #[command(flatten)]
    pub hmd: HmdArgs,
}

/// A capture's outputs: the trace and optionally a picture.
pub fn capture_outputs(trace: &Path, image: Option<&Path>) -> Vec<Output> {
    let mut outputs = vec![Output::binary("--output", trace)];
    outputs.extend(image.map(|image| Output::binary("--image", image)));
    outputs
}

/// Scene and views of a capture.
#[derive(Debug)]
pub struct SceneSetup {
    /// The scene.
    pub scene: Scene,
    /// The pose at the start of the head's path.
    pub camera: Camera,
    /// The display.
    pub hmd: Hmd,
    /// The eyes' matrices by frame.
    pub frames: Vec<FrameViews>,
    /// Times of the frames.
    pub moments: Moments,
    /// Every file that was read for the scene and the path.
    pub inputs: Vec<PathBuf>,
}

impl SceneArgs {
    /// Checks outputs before the scene is loaded, as far as the arguments allow; see
    /// [`SceneSetup::check_outputs`] for the rest.
    ///
    /// # Errors
    /// An output that cannot be written, or that would replace the scene, the path or another output.
    pub fn check_outputs(&self, path: &PathArgs, outputs: &[Output]) -> anyhow::Result<()> {
        // Names of built-in scenes have no extension and are not files.
        let scene = self.scene.path();
        let path = path.file();
        let inputs = scene.extension().map(|_| scene).into_iter();
        shell::check_outputs(outputs, inputs.chain(path.as_deref()))?;
        Ok(())
    }

    /// Loads the scene (its warnings go to stderr) and computes the views.
    ///
    /// `default_size_px` is the eye size without `--size` and `--hmd`; `frames` are the numbers of the frames
    /// along the path.
    ///
    /// # Errors
    /// Wrong flags and an unreadable path, which are checked first, or an unreadable scene.
    pub fn setup(
        &self,
        default_size_px: Option<[u32; 2]>,
        path: &PathArgs,
        frames: Range<u32>,
        options: &LoadOptions,
    ) -> anyhow::Result<SceneSetup> {
        // Flags that do not depend on the scene are checked before it is loaded, which may take minutes.
        self.hmd.resolve(default_size_px, None)?;
        self.camera.validate_alone()?;
        let path_file = path.file();
        let (path, mut moments) = path.open(frames)?;
        moments.scene_start_s = self.pose.time;
        let options = LoadOptions {
            variant: self.variant.clone(),
            ..self.pose.applied_to(options)
        };
        let Loaded {
            scene,
            files: mut inputs,
            ..
        } = load_scene(&self.scene, &options)?;
        inputs.extend(path_file);
        let path = path.in_scene(&scene);
        let mut camera = self.camera.resolve(&scene)?;
        if let HeadPath::Around(views) = &path
            && let Some(first) = views.first()
        {
            camera = Camera {
                near: self.camera.near.unwrap_or(first.near),
                ..first.clone()
            };
        }
        let vfov_deg = match self.camera.vfov {
            Some(VerticalFov::File) => Some(camera.vfov_deg),
            Some(VerticalFov::Degrees(degrees)) => Some(degrees),
            None => None,
        };
        let hmd = self.hmd.resolve(default_size_px, vfov_deg)?;
        if self.hmd.ipd.is_none()
            && let Some(warning) = units::warning(&scene, &camera, hmd.ipd_m)
        {
            shell::warn(&format!("{}: {warning}", &*self.scene));
        }
        let heads = path.poses(&camera, &moments)?;
        let camera = path.start(&camera)?;
        let frames = cameras::frame_views(&camera, &hmd, moments.frames.start, &heads);
        warn_of_coarse_places(&camera, &frames, scene.origin);
        Ok(SceneSetup {
            scene,
            camera,
            hmd,
            frames,
            moments,
            inputs,
        })
    }
}

impl SceneSetup {
    /// Checks a command's outputs against every file that scene and path refer to, which are only known after
    /// loading.
    ///
    /// # Errors
    /// See [`shell::check_outputs`].
    pub fn check_outputs(&self, outputs: &[Output]) -> anyhow::Result<()> {
        shell::check_outputs(outputs, self.inputs.iter().map(PathBuf::as_path))?;
        Ok(())
    }
}

/// Warns if the eyes are so far from the scene's origin that nearby coordinates are coarse.
fn warn_of_coarse_places(camera: &Camera, frames: &[FrameViews], origin: DVec3) {
    let eyes = frames.iter().flat_map(|views| &views.eyes);
    let farthest = (eyes.flat_map(|eye| eye.position)).fold(0.0_f32, |far, at| far.max(at.abs()));
    let step_m = farthest * f32::EPSILON;
    // A sixty-fourth of the near plane's distance is about one pixel there.
    if step_m > camera.near / 64.0 {
        shell::warn(&format!(
            "the eyes are {farthest:.0} m from where the scene's coordinates are counted from ({origin:.0}): \
             places near them are off by up to {step_m} m"
        ));
    }
}

/// Loads a scene, and prints its warnings on stderr.
///
/// # Errors
/// An unreadable scene.
pub fn load_scene(spec: &SceneSpec, options: &LoadOptions) -> anyhow::Result<Loaded> {
    let loaded = match spec.path().to_str() {
        Some(text) => load_with(text, options)?,
        None => scene::load_file(spec.path(), options)?,
    };
    for warning in &loaded.warnings {
        shell::warn(&format!("{}: {warning}", &**spec));
    }
    Ok(loaded)
}

/// The name of a built-in scene or of a file, which need not be UTF-8.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneSpec {
    path: PathBuf,
    /// The same for people and for traces.
    text: String,
}

impl SceneSpec {
    /// Parser of an argument.
    pub fn parser() -> impl TypedValueParser<Value = Self> {
        OsStringValueParser::new().map(|spec| Self {
            text: spec.to_string_lossy().into_owned(),
            path: spec.into(),
        })
    }

    /// The file, if it is one.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

impl Deref for SceneSpec {
    type Target = str;

    fn deref(&self) -> &str {
        &self.text
    }
}

/// Warns that no part of the scene is in the picture; coordinates are relative to `origin`.
pub fn warn_of_nothing_seen(camera: &Camera, (low, high): (Vec3, Vec3), origin: DVec3) {
    let [eye, target, low, high] =
        [camera.eye, camera.target, low, high].map(|point| origin + point.as_dvec3());
    shell::warn(&format!(
        "nothing of the scene is seen from {eye:.2} towards {target:.2} (camera {}); it reaches \
         from {low:.2} to {high:.2} m: choose another --camera, or --eye and --target",
        camera.name
    ));
}

/// Position and direction of the head.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Camera")]
pub struct CameraArgs {
    /// Name of a camera of the scene, with or without `cam_` [default: the first camera].
    #[arg(long, value_name = "NAME")]
    pub camera: Option<String>,
    /// Position between the eyes in metres (with --target, instead of --camera).
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_point, allow_hyphen_values = true,
          requires = "target", conflicts_with = "camera")]
    pub eye: Option<DVec3>,
    /// Point looked at.
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_point, allow_hyphen_values = true,
          requires = "eye")]
    pub target: Option<DVec3>,
    /// Up direction.
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_vec3, allow_hyphen_values = true,
          default_value = "0,1,0", requires = "eye")]
    pub up: Vec3,
    /// Distance of the near plane in metres [default: the camera's; without one, 0.05 for glTF and 1 % of
    /// the scene's radius for others].
    #[arg(long, value_name = "M", value_parser = parse_near, allow_negative_numbers = true)]
    pub near: Option<f32>,
    /// Vertical field of view instead of the display's: degrees, or `file` for the camera's own.
    #[arg(long, value_name = "DEG|file", value_parser = parse_vfov,
          conflicts_with_all = ["hfov", "fov_tangents"])]
    pub vfov: Option<VerticalFov>,
}

/// `--vfov`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum VerticalFov {
    /// The camera's own.
    File,
    /// Degrees.
    Degrees(f32),
}

impl CameraArgs {
    /// The head's pose in `scene`.
    ///
    /// # Errors
    /// An unknown camera, or one without a direction.
    pub fn resolve(&self, scene: &Scene) -> anyhow::Result<Camera> {
        let from_scene = cameras::find(scene, self.camera.as_deref())?;
        let camera = match (self.eye, self.target) {
            (Some(eye), Some(target)) => {
                cameras::posed(eye, target, self.up, scene.origin, from_scene)?
            }
            _ => from_scene.clone(),
        };
        let camera = Camera {
            near: self.near.unwrap_or(camera.near),
            ..camera
        };
        cameras::validate(&camera)?;
        Ok(camera)
    }

    /// Checks the pose from the flags, as far as that is possible without a scene.
    fn validate_alone(&self) -> Result<(), Broken> {
        let (Some(eye), Some(target)) = (self.eye, self.target) else {
            return Ok(());
        };
        let planes = cameras::default_camera(&Scene::default());
        cameras::posed(eye, target, self.up, eye, &planes).map(|_| ())
    }
}

/// The display.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Display")]
pub struct HmdArgs {
    /// Name of a preset.
    #[arg(long, value_name = "NAME", default_value = hmd::PRESETS[0], help = preset_help())]
    pub hmd: String,
    /// Pixels per eye [default: the preset's].
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    pub size: Option<[u32; 2]>,
    /// Horizontal field of view of symmetric eyes with square pixels.
    #[arg(long, value_name = "DEG", conflicts_with = "fov_tangents")]
    pub hfov: Option<f32>,
    /// Tangents of the half-angles (left,right,up,down) of the left eye, and after a semicolon of the right
    /// eye; without a semicolon the right eye mirrors the left.
    #[arg(long, value_name = "L,R,U,D[;L,R,U,D]", value_parser = parse_tangents,
          allow_hyphen_values = true)]
    pub fov_tangents: Option<[FovTangents; 2]>,
    /// Distance between the eyes in millimetres [default: the preset's 64].
    #[arg(long, value_name = "MM", allow_hyphen_values = true)]
    pub ipd: Option<f32>,
    /// Outward turn of each eye in degrees.
    #[arg(long, value_name = "DEG", allow_hyphen_values = true)]
    pub cant: Option<f32>,
}

fn preset_help() -> String {
    let [others @ .., last] = &hmd::PRESETS;
    format!("Preset: {} or {last}", others.join(", "))
}

impl HmdArgs {
    /// The display that the flags describe; named `custom` if any flag changes the preset.
    ///
    /// `default_size_px` is a command's own eye size for the default preset; `vfov_deg` makes the eyes
    /// symmetric with that vertical field of view.
    ///
    /// # Errors
    /// An unknown preset or a figure out of range.
    pub fn resolve(
        &self,
        default_size_px: Option<[u32; 2]>,
        vfov_deg: Option<f32>,
    ) -> anyhow::Result<Hmd> {
        let mut result = hmd::preset(&self.hmd)?;
        let is_default = self.hmd == hmd::PRESETS[0];
        let size = self.size.or(default_size_px.filter(|_| is_default));
        if let Some(size) = size {
            result.eye_size_px = size;
            if is_default {
                // The default is defined by its angle, so another aspect ratio keeps square pixels.
                result.fov = [hmd::symmetric(100.0, size); 2];
            }
        }
        let size = result.eye_size_px;
        if let Some(degrees) = self.hfov {
            check_angle("horizontal field of view", degrees)?;
            result.fov = [hmd::symmetric(degrees, size); 2];
        }
        if let Some(degrees) = vfov_deg {
            check_angle("vertical field of view", degrees)?;
            let turned = hmd::symmetric(degrees, [size[1], size[0]]);
            let fov = FovTangents::new(turned.up, turned.down, turned.left, turned.right);
            result.fov = [fov; 2];
        }
        if let Some(fov) = self.fov_tangents {
            result.fov = fov;
        }
        if let Some(ipd_mm) = self.ipd {
            result.ipd_m = ipd_mm / 1000.0;
        }
        if let Some(cant_deg) = self.cant {
            result.cant_deg = cant_deg;
        }
        if result != hmd::preset(&self.hmd)? {
            result.name = "custom".into();
            result.source = format!("flags on preset {}", self.hmd);
        }
        hmd::validate(&result)?;
        Ok(result)
    }
}

fn check_angle(what: &str, degrees: f32) -> Result<(), Broken> {
    ensure(
        degrees > 0.0 && degrees < 180.0,
        what,
        "more than 0 and less than 180 degrees",
        format_args!("{degrees} degrees"),
    )
}

/// Exactly `N` finite numbers separated by commas.
fn parse_numbers<const N: usize>(text: &str) -> Result<[f32; N], String> {
    Ok(parse_doubles::<N>(text)?.map(|number| number as f32))
}

/// Exactly `N` numbers separated by commas that are finite in single precision as well.
fn parse_doubles<const N: usize>(text: &str) -> Result<[f64; N], String> {
    let numbers = text
        .split(',')
        .map(|part| match part.trim().parse::<f64>() {
            Ok(number) if (number as f32).is_finite() => Ok(number),
            _ => Err(format!("expected a finite number, found '{}'", part.trim())),
        })
        .collect::<Result<Vec<_>, _>>()?;
    <[f64; N]>::try_from(numbers).map_err(|found| {
        format!(
            "expected {N} numbers separated by commas, found {}",
            found.len()
        )
    })
}

fn parse_vec3(text: &str) -> Result<Vec3, String> {
    parse_numbers::<3>(text).map(Vec3::from)
}

/// A point of the world, which may be far from the origin.
fn parse_point(text: &str) -> Result<DVec3, String> {
    parse_doubles::<3>(text).map(DVec3::from)
}

fn parse_near(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(near_m) if near_m >= f32::MIN_POSITIVE && near_m.is_finite() => Ok(near_m),
        _ => Err(format!("expected a distance above 0 m, found '{text}'")),
    }
}

fn parse_vfov(text: &str) -> Result<VerticalFov, String> {
    if text == "file" {
        return Ok(VerticalFov::File);
    }
    parse_numbers::<1>(text).map(|[degrees]| VerticalFov::Degrees(degrees))
}

pub(super) fn parse_size(text: &str) -> Result<[u32; 2], String> {
    let max = hmd::MAX_EYE_SIZE_PX;
    text.split_once(['x', 'X'])
        .and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]))
        .filter(|size: &[u32; 2]| size.iter().all(|e| (1..=max).contains(e)))
        .ok_or_else(|| format!("expected WIDTHxHEIGHT, each from 1 to {max}, found '{text}'"))
}

fn parse_tangents(text: &str) -> Result<[FovTangents; 2], String> {
    let eye = |part: &str| {
        parse_numbers::<4>(part)
            .map(|[left, right, up, down]| FovTangents::new(left, right, up, down))
    };
    match text.split_once(';') {
        Some((left, right)) => Ok([eye(left)?, eye(right)?]),
        None => eye(text).map(|left| [left, hmd::mirrored(&left)]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Debug, Parser)]
    struct Cli {
        #[command(flatten)]
        args: SceneArgs,
        #[command(flatten)]
        path: PathArgs,
    }

    fn parse(flags: &str) -> Result<SceneArgs, String> {
        parse_all(flags).map(|cli| cli.args)
    }

    fn parse_all(flags: &str) -> Result<Cli, String> {
        Cli::try_parse_from(
            ["test", "scene"]
                .into_iter()
                .chain(flags.split_whitespace()),
        )
        .map_err(|e| e.to_string())
    }

    fn hmd_of(flags: &str) -> Hmd {
        parse(flags).unwrap().hmd.resolve(None, None).unwrap()
    }

    #[test]
    fn no_flags_mean_the_default_display() {
        assert_eq!(hmd_of(""), hmd::preset("symmetric-100").unwrap());
    }

    #[test]
    fn another_size_keeps_the_angle_and_square_pixels() {
        let hmd = hmd_of("--size 1024x1024");
        assert_eq!(hmd.name, "custom");
        let fov = hmd.fov[0];
        assert_eq!(fov.left, fov.up);
        assert!((fov.left - 50f32.to_radians().tan()).abs() < 1e-6);
    }

    #[test]
    fn a_vertical_field_of_view_decides_the_horizontal_one() {
        let args = parse("--size 200x100 --vfov 90").unwrap();
        assert_eq!(args.camera.vfov, Some(VerticalFov::Degrees(90.0)));
        let fov = args.hmd.resolve(None, Some(90.0)).unwrap().fov[0];
        assert!(
            (fov.up - 1.0).abs() < 1e-6 && (fov.right - 2.0).abs() < 1e-6,
            "{fov:?}"
        );
    }

    #[test]
    fn tangents_of_one_eye_are_mirrored_for_the_other() {
        let [left, right] = hmd_of("--fov-tangents 1.4,1.2,1,0.9").fov;
        assert_eq!((left.left, left.right, left.down), (1.4, 1.2, 0.9));
        assert_eq!(right, hmd::mirrored(&left));
        let [_, right] = hmd_of("--fov-tangents 1,1,1,1;2,1,1,1").fov;
        assert_eq!(right.left, 2.0);
    }

    #[test]
    fn lengths_are_given_in_millimetres() {
        assert!((hmd_of("--ipd 70").ipd_m - 0.07).abs() < 1e-9);
    }

    #[test]
    fn what_cannot_be_parsed_is_reported() {
        for (flags, part) in [
            ("--size 0x5", "0x5"),
            ("--size 9000x10", "8192"),
            ("--size wide", "WIDTHxHEIGHT"),
            ("--eye 1,2 --target 0,0,0", "3 numbers"),
            ("--eye 1,2,nan --target 0,0,0", "finite"),
            ("--eye 1,2,3", "--target"),
            (
                "--camera a --eye 1,2,3 --target 0,0,0",
                "cannot be used with",
            ),
            ("--fov-tangents 1,2,3", "4 numbers"),
            ("--vfov 60 --hfov 90", "cannot be used with"),
            ("--near 0", "a distance above 0 m"),
            ("--near -1", "a distance above 0 m"),
            ("--near nan", "a distance above 0 m"),
            ("--near inf", "a distance above 0 m"),
            ("--cameras 8", "auto:N"),
            ("--cameras auto:0", "auto:N"),
            ("--cameras auto:8 --path head", "cannot be used with"),
            ("--cameras auto:8 --camera a", "cannot be used with"),
            (
                "--path run",
                "walk, head, FILE.csv or FILE.gltf[#CAMERA], found 'run'",
            ),
            ("--path a.gltf#", "found 'a.gltf#'"),
            ("--fps 0", "0.01 to 10000"),
            ("--fps nan", "0.01 to 10000"),
        ] {
            let error = parse(flags).expect_err(flags);
            assert!(error.contains(part), "{flags}: {error}");
        }
    }

    #[test]
    fn angles_and_poses_out_of_range_are_reported_before_the_scene_is_read() {
        for (flags, part) in [
            ("--hfov 180", "less than 180"),
            ("--hfov 0", "more than 0"),
            ("--hfov nan", "NaN"),
            ("--ipd -1", "0 to 1000 mm"),
            ("--cant 60", "-45 to 45"),
            ("--hmd rift", "rift"),
            ("--eye 1,1,1 --target 1,1,1", "away from the eye"),
            ("--path no-such.csv", "no-such.csv: path: cannot read"),
            ("--path no-such.gltf#a", "no-such.gltf: path: cannot read"),
        ] {
            let Cli { args, path } = parse_all(flags).unwrap();
            let error = args
                .setup(None, &path, 0..1, &LoadOptions::ALL)
                .unwrap_err()
                .to_string();
            assert!(error.contains(part), "{flags}: {error}");
        }
    }
}
