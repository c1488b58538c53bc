//! Flags for the path of the head.

use super::choice::choice;
use clap::Args;
use clap::builder::TypedValueParser;
use scene::paths::{DEFAULT_FPS, HeadPath, MAX_FRAMES, Moments, PathOrigin, PathSpec};
use std::ops::Range;
use std::path::PathBuf;

/// Most views of `--cameras`.
const MAX_AROUND: u32 = 360;

/// The head's path.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Camera")]
pub struct PathArgs {
    /// Path of the head: `walk` (slowly ahead), `head` (a model of a person who looks around), a CSV file of
    /// poses, or a glTF file's animated camera.
    #[arg(
        long,
        value_name = "walk|head|FILE.csv|FILE.gltf[#CAMERA]",
        default_value = "walk"
    )]
    pub path: PathSpec,
    /// Views from all sides instead of a path: frame 0 to N - 1 look at the scene from N directions.
    #[arg(long, value_name = "auto:N", value_parser = parse_around,
          conflicts_with_all = ["path", "path_origin", "camera", "eye"])]
    pub cameras: Option<u32>,
    /// Coordinate system of a file's poses [default: camera for CSV, world for glTF].
    #[arg(long, value_parser = origin_parser(), value_name = "ORIGIN")]
    pub path_origin: Option<PathOrigin>,
    /// Frames per second along the path.
    #[arg(long, value_name = "HZ", default_value_t = DEFAULT_FPS, value_parser = parse_fps)]
    pub fps: f32,
}

fn origin_parser() -> impl TypedValueParser<Value = PathOrigin> {
    choice([
        (
            "camera",
            PathOrigin::Camera,
            "The path starts at the camera's place and heading",
        ),
        (
            "world",
            PathOrigin::World,
            "Poses stand as the file has them",
        ),
    ])
}

impl PathArgs {
    /// The path of a single frame, at the start of every path.
    pub fn still() -> Self {
        Self {
            path: PathSpec::Walk,
            cameras: None,
            path_origin: None,
            fps: DEFAULT_FPS,
        }
    }

    /// The file that the path is read from.
    pub fn file(&self) -> Option<PathBuf> {
        match &self.path {
            PathSpec::Walk | PathSpec::Head => None,
            PathSpec::Poses(file) | PathSpec::Gltf(file, _) => Some(file.clone()),
        }
    }

    /// The path and its frame times; warnings about its file go to stderr.
    ///
    /// # Errors
    /// An unreadable file, or one that ends before the last frame.
    pub fn open(&self, frames: Range<u32>) -> anyhow::Result<(HeadPath, Moments)> {
        let (path, warnings) = match self.cameras {
            Some(count) => {
                anyhow::ensure!(
                    frames.end <= count,
                    "--cameras auto:{count}: expected frames below {count}, found {}",
                    frames.end - 1
                );
                (HeadPath::around(count), Vec::new())
            }
            None => HeadPath::open(&self.path, self.path_origin)?,
        };
        for warning in warnings {
            shell::warn(&format!("{}: {warning}", self.path));
        }
        let moments = Moments {
            frames,
            fps: self.fps,
            scene_start_s: 0.0,
        };
        path.check(&moments)?;
        Ok((path, moments))
    }
}

/// Parser for a number of frames.
pub fn frame_count() -> clap::builder::RangedI64ValueParser<u32> {
    clap::value_parser!(u32).range(1..=i64::from(MAX_FRAMES))
}

fn parse_around(text: &str) -> Result<u32, String> {
    let count = text
        .strip_prefix("auto:")
        .and_then(|count| count.parse().ok());
    count
        .filter(|count| (1..=MAX_AROUND).contains(count))
        .ok_or_else(|| format!("expected auto:N with N from 1 to {MAX_AROUND}, found '{text}'"))
}

fn parse_fps(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(fps) if (0.01..=10_000.0).contains(&fps) => Ok(fps),
        _ => Err(format!(
            "expected 0.01 to 10000 frames a second, found '{text}'"
        )),
    }
}
