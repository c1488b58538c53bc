//! `tracegen xr`.

use super::choice::choice;
use super::lens_args::LensArgs;
use super::program_args::ProgramArgs;
use super::program_run::ProgramRun;
use super::scene_args::HmdArgs;
use super::values::{numbers, parse_timeout};
use crate::hidden_mesh;
use crate::openxr::{Head, display_settings, eye_view};
use anyhow::{Context, ensure};
use clap::Args;
use clap::builder::TypedValueParser;
use formats::view::Hmd;
use programs::{
    Cameras, DrainError, Launch, Session, SessionError, ViewsError, XServer, openxr_library,
};
use scene::paths::{DEFAULT_FPS, HeadPath, Moments, PathOrigin, PathSpec};
use shell::find_program;
use spool::FramesBy;
use spool::openxr::{PathSpace, RuntimeSettings};
use std::collections::BTreeMap;
use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

/// Arguments of `tracegen xr`.
#[derive(Args, Debug)]
pub struct XrArgs {
    #[command(flatten)]
    capture: ProgramArgs,
    #[command(flatten)]
    hmd: HmdArgs,
    #[command(flatten)]
    lens: LensArgs,
    /// The display's hidden-area mesh, which programs may ask for [default: all outside of the lens's circle].
    #[arg(long, value_name = "FILE.json", help_heading = "Display")]
    hidden_area_mesh: Option<PathBuf>,
    /// Position of the head in metres, and pitch of its view in degrees, upwards; with `--path`, where the path
    /// starts [default: 0,0,0,0 in the space `local`, 0,1.6,0,0 in `stage`].
    #[arg(long, value_name = "X,Y,Z[,PITCH]", value_parser = parse_head, allow_hyphen_values = true,
          help_heading = "Head")]
    head: Option<Head>,
    /// Space of the program in which the head's position is given.
    #[arg(long, value_parser = space_parser(), value_name = "SPACE", default_value = "local", help_heading = "Head")]
    space: PathSpace,
    /// Path of the head: `walk` (slowly ahead), `head` (a model of a person who looks around), a CSV file of
    /// poses, or a glTF file's animated camera [default: it stands still].
    #[arg(
        long,
        value_name = "walk|head|FILE.csv|FILE.gltf[#CAMERA]",
        help_heading = "Head"
    )]
    path: Option<PathSpec>,
    /// Frames per second of the display and along the path. The clock of the runtime is virtual: a frame may take
    /// any time.
    #[arg(long, value_name = "HZ", default_value_t = DEFAULT_FPS, value_parser = parse_rate, help_heading = "Head")]
    fps: f32,
    /// Let the program run to its end. By default it is terminated 5 seconds after the last frame.
    #[arg(long)]
    to_end: bool,
    /// Timeout in seconds; a program that has not rendered the frames by then is terminated.
    #[arg(long, value_name = "SECONDS", default_value = "600", value_parser = parse_timeout)]
    timeout: Duration,
    /// The program and its arguments.
    #[arg(last = true, required = true, value_name = "PROGRAM")]
    program: Vec<OsString>,
}

fn space_parser() -> impl TypedValueParser<Value = PathSpace> {
    choice([
        (
            "local",
            PathSpace::Local,
            "The space LOCAL: its origin is where the head usually starts",
        ),
        (
            "stage",
            PathSpace::Stage,
            "The space STAGE: its origin is on the floor",
        ),
    ])
}

/// Height of the eyes above the floor, in metres.
const EYE_HEIGHT_M: f64 = 1.6;
/// Time for a program to end by itself after the last frame.
const GRACE: Duration = Duration::from_secs(5);
/// Frames in a row without a picture after which a program is asked to end: two minutes at 90 frames per second.
const MOST_EMPTY_FRAMES: u32 = 10_800;

fn parse_head(text: &str) -> Result<Head, String> {
    let expected = || {
        format!(
            "expected X,Y,Z or X,Y,Z,PITCH with a pitch between -90 and 90 degrees, found '{text}'"
        )
    };
    let (position_m, pitch_deg) = match (numbers::<3>(text), numbers::<4>(text)) {
        (Some(position), _) => (position, 0.0),
        (_, Some([x, y, z, pitch])) => ([x, y, z], pitch),
        _ => return Err(expected()),
    };
    let fits = position_m.iter().all(|at| at.is_finite()) && pitch_deg > -90.0 && pitch_deg < 90.0;
    match fits {
        true => Ok(Head {
            position_m,
            pitch_deg,
        }),
        false => Err(expected()),
    }
}

fn parse_rate(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(rate) if (1.0..=1000.0).contains(&rate) => Ok(rate),
        _ => Err(format!(
            "expected 1 to 1000 frames a second, found '{text}'"
        )),
    }
}

impl XrArgs {
    /// Where the head's path starts.
    fn head(&self) -> Head {
        let height = match self.space {
            PathSpace::Local => 0.0,
            PathSpace::Stage => EYE_HEIGHT_M as f32,
        };
        self.head.unwrap_or(Head {
            position_m: [0.0, height, 0.0],
            pitch_deg: 0.0,
        })
    }

    /// The simulated display and the head's path.
    fn runtime(&self, hmd: &Hmd) -> anyhow::Result<RuntimeSettings> {
        let camera = self.head().camera();
        let moments = Moments {
            frames: 0..self.capture.frames.end,
            fps: self.fps,
            scene_start_s: 0.0,
        };
        let heads = match &self.path {
            None => vec![scene::cameras::head_pose(&camera)],
            Some(spec) => {
                // The poses of a file start at the head's place, as those of the models do.
                let (path, warnings) = HeadPath::open(spec, Some(PathOrigin::Camera))?;
                for warning in warnings {
                    shell::warn(&format!("{spec}: {warning}"));
                }
                path.poses(&camera, &moments)?
            }
        };
        let mesh = self
            .hidden_area_mesh
            .as_deref()
            .map(hidden_mesh::read)
            .transpose()?;
        let settings = display_settings(hmd, &self.lens.lenses(hmd)?, mesh.as_ref(), &heads);
        Ok(RuntimeSettings {
            space: self.space,
            eye_height_m: EYE_HEIGHT_M,
            frame_ns: (1e9 / f64::from(self.fps)).round() as i64,
            frames: self.capture.frames.end,
            most_empty_frames: MOST_EMPTY_FRAMES,
            ..settings
        })
    }
}

/// Runs `tracegen xr`.
///
/// # Errors
/// Wrong use, a program that cannot be captured, and outputs that cannot be written.
pub fn run(args: &XrArgs) -> anyhow::Result<ExitCode> {
    let eyes = args.capture.check(None)?;
    let hmd = args.hmd.resolve(None, None)?;
    let runtime = args.runtime(&hmd)?;
    let (file, arguments) = args
        .program
        .split_first()
        .context("expected a program, found none")?;
    ensure!(
        find_program(file).is_some(),
        "cannot run {}: expected a program, found no such file",
        file.display()
    );
    let name = Path::new(file)
        .file_name()
        .unwrap_or(file)
        .to_string_lossy()
        .into_owned();
    let settings = args.capture.settings(FramesBy::OpenXr)?;
    let tool = std::env::current_exe().context("cannot find this program's own file")?;
    let library = openxr_library(&tool)?;
    let launch = Launch::new(&std::env::temp_dir(), &tool, &settings)?;
    let to_run = ProgramRun {
        name: &name,
        file,
        arguments: arguments.iter().map(OsStr::new).collect(),
        opengl: false,
        openxr: true,
        log: None,
        frames: args.capture.frames.clone(),
        grace: (!args.to_end).then_some(GRACE),
        timeout: args.timeout,
    };
    let x_server = XServer::start(launch.folder());
    // The supervisor watches over the capture's folder until the end.
    let (_program, run) = to_run.start(&launch, |command| {
        if let Some(server) = &x_server {
            command.env("DISPLAY", &server.display);
        }
        // OpenGL on zink, for programs that use it.
        launch.prepare(command, true);
        launch.prepare_openxr(command, &library, &runtime)
    })?;
    let mut session = to_run
        .session(&launch)
        .map_err(|error| run.explain(&error))?;
    let cameras = cameras(&session, hmd);
    let written = args
        .capture
        .finish(&mut session, name, &settings, &eyes, cameras);
    written.map_err(|error| match is_empty(&error) {
        true => error.context(format!(
            "the head starts at {} (--head, --space, --path)",
            args.head()
        )),
        false => error,
    })
}

/// Whether nothing was drawn in a frame.
fn is_empty(error: &anyhow::Error) -> bool {
    matches!(
        error.downcast_ref(),
        Some(
            DrainError::Session(SessionError::NotDrawn(_))
                | DrainError::Views(ViewsError::Empty(_))
                | DrainError::Nothing
        )
    )
}

/// The eyes that the program showed.
fn cameras(session: &Session, display: Hmd) -> Cameras {
    let eyes: BTreeMap<u32, _> = (session.shown.iter())
        .map(|(frame, eyes)| (*frame, [eye_view(&eyes[0]), eye_view(&eyes[1])]))
        .collect();
    Cameras {
        eyes,
        display: Some(display),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_head_is_a_place_and_a_pitch() {
        let head = parse_head("1,-2,3.5,-35").unwrap();
        assert_eq!((head.position_m, head.pitch_deg), ([1.0, -2.0, 3.5], -35.0));
        assert_eq!(parse_head("1,2,3").unwrap().pitch_deg, 0.0);
        for bad in ["", "1,2", "1,2,3,90", "1,2,3,4,5", "a,b,c", "1,2,nan"] {
            assert!(parse_head(bad).unwrap_err().contains("X,Y,Z"), "{bad}");
        }
    }
}
