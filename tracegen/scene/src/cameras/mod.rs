//! Head poses: a scene's cameras, the pose given by flags, and the matrices of both eyes.
//!
//! Conventions: right-handed, y up, each eye looks down its own -z; clip space has y up and depth
//! 1 at the near plane to 0 at the far plane, which may be infinitely far away. Floating-point numbers are
//! densest at 0, so that depth in single precision has the same relative steps at every distance. Tests
//! compare with `Greater`.

mod default;
mod probe;

pub use default::{DEFAULT_NAME, around, default_camera};

use super::{Camera, Scene};
use crate::origin::relative;
use crate::suggest::did_you_mean;
use formats::error::{Broken, UnknownName};
use formats::view::{EyeView, FovTangents, FrameViews, Hmd};
use glam::{Affine3A, DVec3, Mat3, Mat4, Vec3, Vec4};

/// Finds a scene's camera by its exact name, or by its name without the prefix `cam_`; the first
/// camera where no name is given.
///
/// # Errors
/// An unknown name; the error lists the names.
pub fn find<'a>(scene: &'a Scene, name: Option<&str>) -> Result<&'a Camera, UnknownName> {
    let wanted = name.unwrap_or_default();
    let matches = |c: &&Camera| c.name == wanted || c.name.strip_prefix("cam_") == Some(wanted);
    let found = match name {
        None => scene.cameras.first(),
        Some(_) => (scene.cameras.iter().find(|c| c.name == wanted))
            .or_else(|| scene.cameras.iter().find(matches)),
    };
    found.ok_or_else(|| {
        let names: Vec<&str> = scene.cameras.iter().map(|c| c.name.as_str()).collect();
        let short = names.iter().filter_map(|name| name.strip_prefix("cam_"));
        let suggestion = did_you_mean(wanted, names.iter().copied().chain(short));
        UnknownName {
            what: "no camera",
            name: wanted.to_owned(),
            known: format!("one of {}{suggestion}", names.join(", ")),
        }
    })
}

/// Checks that a camera has a direction and that its planes are in order.
///
/// # Errors
/// What is wrong.
pub fn validate(camera: &Camera) -> Result<(), Broken> {
    let Camera {
        eye, target, up, ..
    } = *camera;
    let steps = 16.0 * f64::from(f32::EPSILON);
    check_direction(&camera.name, eye.as_dvec3(), target.as_dvec3(), up, steps)?;
    let (near, far) = (camera.near, camera.far);
    if !(near.is_finite() && near > 0.0 && far > near) {
        let found = format!("near {near}, far {far}");
        return Err(broken(&camera.name, "0 < near < far", found));
    }
    Ok(())
}

fn broken(camera: &str, expected: &str, found: String) -> Broken {
    Broken::new(format!("camera '{camera}'"), expected, found)
}

/// Checks that a camera's eye has a viewing direction: the distance to its target must exceed the
/// rounding error, `steps` times the eye's distance from zero.
fn check_direction(
    name: &str,
    eye: DVec3,
    target: DVec3,
    up: Vec3,
    steps: f64,
) -> Result<(), Broken> {
    if !(eye.is_finite() && target.is_finite() && up.is_finite()) {
        let found = format!("eye {eye}, target {target}, up {up}");
        return Err(broken(name, "finite coordinates", found));
    }
    let forward = target - eye;
    // The square must be representable in single precision.
    let least = f64::from(f32::MIN_POSITIVE).sqrt();
    if forward.length() < (steps * eye.length()).max(least) {
        let found = format!("eye {eye}, target {target}");
        return Err(broken(name, "a target away from the eye", found));
    }
    let forward = forward.as_vec3();
    if forward.normalize().cross(up.normalize_or_zero()).length() < 1e-4 {
        let found = format!("up {up}, direction {forward}");
        let expected = "an up vector that is not along the viewing direction";
        return Err(broken(name, expected, found));
    }
    Ok(())
}

/// Distance from zero beyond which one step of single precision, relative to a target one metre
/// ahead, visibly changes a camera's direction.
const FAR_OUT: f32 = 1024.0;

/// Eye, target and up direction of a camera node, which looks along its -z. The target is one metre
/// ahead, or further for an eye so far from zero that single precision has few steps in a metre.
/// Returns `None` if the node has no direction.
pub(crate) fn look_of_node(place: &Affine3A) -> Option<(Vec3, Vec3, Vec3)> {
    let eye = Vec3::from(place.translation);
    let forward = Vec3::from(-place.matrix3.z_axis).normalize_or_zero();
    let up = Vec3::from(place.matrix3.y_axis).normalize_or_zero();
    if forward.cross(up).length() < 1e-4 {
        return None;
    }
    let out = eye.abs().max_element();
    let ahead = if out > FAR_OUT { out } else { 1.0 };
    Some((eye, eye + forward * ahead, up))
}

/// A camera of this pose in the world, for a scene whose coordinates are relative to `origin`. Near
/// and far planes are those of `like`, a camera of the scene: they fit its scale.
///
/// # Errors
/// A pose without a viewing direction.
pub fn posed(
    eye: DVec3,
    target: DVec3,
    up: Vec3,
    origin: DVec3,
    like: &Camera,
) -> Result<Camera, Broken> {
    let camera = Camera {
        name: "custom".into(),
        eye: relative(eye, origin),
        target: relative(target, origin),
        up,
        ..like.clone()
    };
    // Checked before rounding, which may make the two points equal.
    check_direction(&camera.name, eye, target, up, 16.0 * f64::EPSILON)?;
    Ok(camera)
}

/// The head's frame: columns right, up, backwards, and the point between the eyes.
pub fn head_pose(camera: &Camera) -> Affine3A {
    let back = (camera.eye - camera.target).normalize();
    let right = camera.up.cross(back).normalize();
    let up = back.cross(right);
    Affine3A::from_mat3_translation(Mat3::from_cols(right, up, back), camera.eye)
}

/// Off-axis perspective from tangents, depth 1 (near) to 0 (far, which may be infinite).
pub fn projection(fov: &FovTangents, near: f32, far: f32) -> Mat4 {
    let (width, height) = (fov.left + fov.right, fov.up + fov.down);
    let [scale, shift] = if far.is_finite() {
        [near / (far - near), near * far / (far - near)]
    } else {
        [0.0, near]
    };
    Mat4::from_cols(
        Vec4::new(2.0 / width, 0.0, 0.0, 0.0),
        Vec4::new(0.0, 2.0 / height, 0.0, 0.0),
        Vec4::new(
            (fov.right - fov.left) / width,
            (fov.up - fov.down) / height,
            scale,
            -1.0,
        ),
        Vec4::new(0.0, 0.0, shift, 0.0),
    )
}

/// Both eyes' matrices for the head at a camera.
pub fn eye_views(camera: &Camera, hmd: &Hmd) -> [EyeView; 2] {
    views_of_head(head_pose(camera), camera, hmd)
}

/// Poses of the left and the right eye relative to the head.
pub fn eyes_in_head(hmd: &Hmd) -> [Affine3A; 2] {
    [-1.0f32, 1.0].map(|side| {
        // Outward is to the left for the left eye: a positive rotation about +y.
        let turn = Mat3::from_rotation_y(-side * hmd.cant_deg.to_radians());
        Affine3A::from_mat3_translation(turn, Vec3::new(side * hmd.ipd_m / 2.0, 0.0, 0.0))
    })
}

/// Both eyes' matrices for a head pose; near and far planes are the camera's.
fn views_of_head(head: Affine3A, camera: &Camera, hmd: &Hmd) -> [EyeView; 2] {
    let in_head = eyes_in_head(hmd);
    [0, 1].map(|eye| {
        let eye_to_world = head * in_head[eye];
        let fov = &hmd.fov[eye];
        EyeView {
            world_to_eye: Mat4::from(eye_to_world.inverse()).to_cols_array_2d(),
            eye_to_clip: projection(fov, camera.near, camera.far).to_cols_array_2d(),
            position: Vec3::from(eye_to_world.translation).to_array(),
        }
    })
}

/// The views of frames with these head poses, numbered from `first_frame`; near and far planes
/// are the camera's.
pub fn frame_views(
    camera: &Camera,
    hmd: &Hmd,
    first_frame: u32,
    heads: &[Affine3A],
) -> Vec<FrameViews> {
    (first_frame..)
        .zip(heads)
        .map(|(frame, head)| FrameViews {
            frame,
            eyes: views_of_head(*head, camera, hmd),
        })
        .collect()
}

/// The frame of a head that stands still at a camera.
///
/// # Errors
/// A camera that cannot be used.
pub fn still_frame(camera: &Camera, hmd: &Hmd) -> Result<Vec<FrameViews>, Broken> {
    validate(camera)?;
    Ok(frame_views(camera, hmd, 0, &[head_pose(camera)]))
}

#[cfg(test)]
pub(crate) mod tests;
