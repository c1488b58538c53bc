//! Head paths: named models of a moving head, and paths and gazes from files.
//!
//! A path gives the head's pose as a function of time. Frame k is seen at k / fps seconds from the
//! path's start. Head space is right-handed: x right, y up, looking down -z.

mod gaze;
mod gltf;
mod head;
mod keys;
mod poses;
mod table;
mod walk;

#[cfg(test)]
mod tests;

pub use gaze::{GazeRow, read_gazes};
pub use gltf::CameraTrack;
pub(crate) use keys::bracket;
pub use poses::PoseTrack;

use crate::cameras::{self, head_pose};
use crate::files::Origin;
use crate::{Camera, Scene, SceneError};
use glam::{Affine3A, DAffine3, DMat3, DVec3};
use std::fmt;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// Frames per second unless given otherwise.
pub const DEFAULT_FPS: f32 = 72.0;

/// Most frames of a path.
pub const MAX_FRAMES: u32 = 10_000;

/// A path as specified by the user.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum PathSpec {
    /// `walk`, see [`HeadPath::Walk`].
    #[default]
    Walk,
    /// `head`, see [`HeadPath::Head`].
    Head,
    /// A CSV file of poses.
    Poses(PathBuf),
    /// A glTF file with an animated camera, and the name of the camera.
    Gltf(PathBuf, Option<String>),
}

impl FromStr for PathSpec {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let ends = |text: &str, extensions: &[&str]| {
            let extension = Path::new(text).extension().unwrap_or_default();
            extensions.iter().any(|e| extension.eq_ignore_ascii_case(e))
        };
        const GLTF: [&str; 2] = ["gltf", "glb"];
        match text {
            "walk" => Ok(Self::Walk),
            "head" => Ok(Self::Head),
            _ if ends(text, &["csv"]) => Ok(Self::Poses(text.into())),
            _ if ends(text, &GLTF) => Ok(Self::Gltf(text.into(), None)),
            _ => match text.rsplit_once('#') {
                Some((file, camera)) if ends(file, &GLTF) && !camera.is_empty() => {
                    Ok(Self::Gltf(file.into(), Some(camera.to_owned())))
                }
                _ => Err(format!(
                    "expected walk, head, FILE.csv or FILE.gltf[#CAMERA], found '{text}'"
                )),
            },
        }
    }
}

impl fmt::Display for PathSpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Walk => write!(f, "walk"),
            Self::Head => write!(f, "head"),
            Self::Poses(file) | Self::Gltf(file, None) => write!(f, "{}", file.display()),
            Self::Gltf(file, Some(camera)) => write!(f, "{}#{camera}", file.display()),
        }
    }
}

/// The frame of reference of a file's poses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PathOrigin {
    /// The camera: the path is moved and turned about the vertical so that its first pose has the
    /// camera's place and heading. Pitch and roll stay as recorded.
    Camera,
    /// The world: poses are used unchanged.
    World,
}

/// A path that can be evaluated.
#[derive(Clone, Debug)]
pub enum HeadPath {
    /// A slow straight walk from the camera, see [`walk`](self::walk).
    Walk,
    /// A standing person who looks around from the camera, see [`head`](self::head).
    Head,
    /// Recorded poses.
    Poses(PoseTrack, PathOrigin),
    /// An animated camera.
    Gltf(CameraTrack, PathOrigin),
    /// One view after the other; placeholders until [`HeadPath::in_scene`].
    Around(Vec<Camera>),
}

/// The frames to evaluate, and their rate.
#[derive(Clone, Debug, PartialEq)]
pub struct Moments {
    /// Frame numbers.
    pub frames: Range<u32>,
    /// Frames per second.
    pub fps: f32,
    /// Scene time of frame 0, seconds.
    pub scene_start_s: f64,
}

impl Moments {
    /// The first `frames` frames at the default rate.
    pub fn first(frames: u32) -> Self {
        Self {
            frames: 0..frames,
            fps: DEFAULT_FPS,
            scene_start_s: 0.0,
        }
    }

    /// Time of a frame, seconds from the start of the path.
    pub fn time_s(&self, frame: u32) -> f32 {
        frame as f32 / self.fps
    }

    /// Scene time of a frame, seconds.
    pub fn scene_time_s(&self, frame: u32) -> f64 {
        self.scene_start_s + seconds(self, frame)
    }
}

impl HeadPath {
    /// Reads what `spec` names. Unless `origin` says otherwise, poses of a CSV file start at the
    /// camera and an animated camera is placed in the world. Also returns warnings about the file.
    ///
    /// # Errors
    /// A file that cannot be read or is not a path.
    pub fn open(
        spec: &PathSpec,
        origin: Option<PathOrigin>,
    ) -> Result<(Self, Vec<String>), SceneError> {
        match spec {
            PathSpec::Walk => Ok((Self::Walk, Vec::new())),
            PathSpec::Head => Ok((Self::Head, Vec::new())),
            PathSpec::Poses(file) => {
                let track = PoseTrack::read(file)?;
                let origin = origin.unwrap_or(PathOrigin::Camera);
                Ok((Self::Poses(track, origin), Vec::new()))
            }
            PathSpec::Gltf(file, camera) => {
                let (track, warnings) = crate::gltf::camera_track(file, camera.as_deref())?;
                let origin = origin.unwrap_or(PathOrigin::World);
                Ok((Self::Gltf(track, origin), warnings))
            }
        }
    }

    /// This many views of a scene from all sides, one in each frame.
    pub fn around(count: u32) -> Self {
        Self::Around(cameras::around(&Scene::default(), count))
    }

    /// The same path in a scene.
    #[must_use]
    pub fn in_scene(self, scene: &Scene) -> Self {
        match self {
            Self::Around(views) => Self::Around(cameras::around(scene, views.len() as u32)),
            path => path.relative_to(scene.origin),
        }
    }

    /// The same path for a scene whose coordinates are relative to `origin`.
    #[must_use]
    pub fn relative_to(mut self, origin: DVec3) -> Self {
        match &mut self {
            Self::Walk | Self::Head | Self::Around(_) => {}
            Self::Poses(track, _) => {
                for (position, _) in &mut track.poses {
                    *position -= origin;
                }
            }
            Self::Gltf(track, _) => track.origin += origin,
        }
        self
    }

    /// The head's poses (head to world, rigid) in the frames of `moments`, for a head that starts
    /// at `camera`.
    ///
    /// # Errors
    /// A frame after the end of a file's path, or a camera whose scale is zero.
    pub fn poses(&self, camera: &Camera, moments: &Moments) -> Result<Vec<Affine3A>, SceneError> {
        self.check(moments)?;
        let frames = moments.frames.clone();
        match self {
            Self::Walk => Ok(frames
                .map(|frame| head_pose(&walk::camera_at(camera, moments.time_s(frame))))
                .collect()),
            Self::Around(views) => Ok((frames.filter_map(|frame| views.get(frame as usize)))
                .map(head_pose)
                .collect()),
            Self::Head => Ok(frames
                .map(|frame| head::pose_at(camera, moments.time_s(frame)))
                .collect()),
            Self::Poses(track, origin) => {
                let start = align(track.pose(0.0), *origin, camera);
                Ok(frames
                    .map(|frame| (start * track.pose(seconds(moments, frame))).as_affine3a())
                    .collect())
            }
            Self::Gltf(track, origin) => {
                let start = align(track.pose(0.0)?, *origin, camera);
                frames
                    .map(|frame| Ok((start * track.pose(seconds(moments, frame))?).as_affine3a()))
                    .collect()
            }
        }
    }

    /// The camera at which the path starts: `camera`, or the start of a path in the world.
    ///
    /// # Errors
    /// A camera whose scale is zero.
    pub fn start(&self, camera: &Camera) -> Result<Camera, SceneError> {
        let first = match self {
            Self::Poses(track, PathOrigin::World) => track.pose(0.0),
            Self::Gltf(track, PathOrigin::World) => track.pose(0.0)?,
            _ => return Ok(camera.clone()),
        };
        let [eye, back, up] = [
            first.translation,
            first.matrix3.z_axis,
            first.matrix3.y_axis,
        ]
        .map(|v| v.as_vec3());
        Ok(Camera {
            name: "path".into(),
            eye,
            target: eye - back,
            up,
            ..camera.clone()
        })
    }

    /// Checks that a file's path covers all frames.
    ///
    /// # Errors
    /// The path is too short.
    pub fn check(&self, moments: &Moments) -> Result<(), SceneError> {
        let (file, duration_s) = match self {
            Self::Walk | Self::Head | Self::Around(_) => return Ok(()),

            Self::Poses(track, _) => (track.file(), track.duration_s()),
            Self::Gltf(track, _) => (track.file(), track.duration_s()),
        };
        // Rounding must not remove the last frame of a path of whole frames.
        let frames = (duration_s * f64::from(moments.fps) + 1e-3).floor() + 1.0;
        if f64::from(moments.frames.end) <= frames {
            return Ok(());
        }
        Err(Origin::new(file).invalid(
            "path",
            format!(
                "at most {frames} frames: it lasts {duration_s:.3} s, at {} frames a second",
                moments.fps
            ),
            format!("{} frames asked for", moments.frames.end),
        ))
    }
}

/// Double precision, because times of recorded poses may be large.
fn seconds(moments: &Moments, frame: u32) -> f64 {
    f64::from(frame) / f64::from(moments.fps)
}

/// The transform that moves a path from its first pose `first` to its origin.
fn align(first: DAffine3, origin: PathOrigin, camera: &Camera) -> DAffine3 {
    if origin == PathOrigin::World {
        return DAffine3::IDENTITY;
    }
    let wanted = head_pose(camera).as_daffine3();
    let turn = heading(&wanted) - heading(&first);
    let turn = DMat3::from_rotation_y(turn);
    DAffine3::from_mat3_translation(turn, wanted.translation - turn * first.translation)
}

/// Angle of a pose's direction about +y from -z, radians. For a pose that looks straight up or
/// down, the direction of the chin or of the top of the head.
fn heading(pose: &DAffine3) -> f64 {
    let back = pose.matrix3.z_axis;
    let level = |v: DVec3| v.x.hypot(v.z);
    let back = if level(back) > 1e-3 {
        back
    } else {
        pose.matrix3.y_axis * -back.y.signum()
    };
    back.x.atan2(back.z)
}
