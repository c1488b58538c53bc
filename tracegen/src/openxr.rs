//! The simulated display of an OpenXR program: what its runtime gets, and the eyes that the program showed.

use formats::view::{EyeView, FovTangents, Hmd, Lens};
use glam::{Affine3A, DAffine3, DQuat, DVec3, Vec3};
use scene::{Camera, cameras};
use spool::openxr::{DisplayEye, PathSpace, Pose, RuntimeSettings, ShownEye};
use std::fmt;
use techniques::hidden_mesh::{HiddenMesh, Triangle};

/// Place and pitch of a head that looks along -z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Head {
    /// Position in metres.
    pub position_m: [f32; 3],
    /// Degrees upwards.
    pub pitch_deg: f32,
}

impl fmt::Display for Head {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y, z] = self.position_m;
        write!(
            f,
            "{x},{y},{z} m with a pitch of {} degrees",
            self.pitch_deg
        )
    }
}

/// Planes of a camera, in metres, for programs that do not tell theirs.
const NEAR_M: f32 = 0.1;
const FAR_M: f32 = f32::INFINITY;

impl Head {
    /// The camera at the head.
    pub fn camera(&self) -> Camera {
        let pitch = self.pitch_deg.to_radians();
        let eye = Vec3::from(self.position_m);
        Camera {
            name: "head".to_owned(),
            eye,
            target: eye + Vec3::new(0.0, pitch.sin(), -pitch.cos()),
            up: Vec3::Y,
            vfov_deg: 90.0,
            near: NEAR_M,
            far: FAR_M,
        }
    }
}

fn pose(of: &Affine3A) -> Pose {
    let of = of.as_daffine3();
    Pose {
        orientation: DQuat::from_mat3(&of.matrix3).normalize().to_array(),
        position_m: of.translation.to_array(),
    }
}

/// Number of corners of the polygon around a lens's circle.
const CORNERS: u32 = 64;

/// Triangles that cover all outside of a lens's circle, as tangents. The polygon is around the circle, so they cover
/// nothing that is visible.
fn outside(lens: &Lens, fov: &FovTangents) -> Vec<Triangle> {
    let radius = lens.radius / (std::f32::consts::PI / CORNERS as f32).cos();
    let reach = [fov.left, fov.right, fov.up, fov.down]
        .iter()
        .fold(0.0f32, |a, b| a.max(b.abs()));
    let far = 2.0 * (reach + lens.center[0].abs().max(lens.center[1].abs())) / lens.radius;
    let at = |corner: u32, scale: f32| {
        let angle = std::f32::consts::TAU * (corner as f32) / CORNERS as f32;
        let (sin, cos) = angle.sin_cos();
        [
            lens.center[0] + scale * radius * cos,
            lens.center[1] + scale * radius * sin,
        ]
    };
    let far = far.max(2.0);
    (0..CORNERS)
        .flat_map(|corner| {
            let [a, b] = [at(corner, 1.0), at(corner + 1, 1.0)];
            let [c, d] = [at(corner, far), at(corner + 1, far)];
            [[a, c, b], [b, c, d]]
        })
        .collect()
}

/// Corners as fractions of a picture, in tangents.
fn in_tangents(triangle: &Triangle, fov: &FovTangents) -> Triangle {
    triangle.map(|[x, y]| {
        [
            x.mul_add(fov.left + fov.right, -fov.left),
            y.mul_add(fov.up + fov.down, -fov.down),
        ]
    })
}

/// Settings of a runtime for a display and a path. The hidden area is a mesh of fractions of the pictures or, without
/// one, all outside of the lenses.
pub fn display_settings(
    hmd: &Hmd,
    lenses: &[Lens; 2],
    mesh: Option<&HiddenMesh>,
    heads: &[Affine3A],
) -> RuntimeSettings {
    let in_head = cameras::eyes_in_head(hmd);
    let eyes = [0, 1].map(|eye| {
        let fov = &hmd.fov[eye];
        DisplayEye {
            in_head: pose(&in_head[eye]),
            tangents: [fov.left, fov.right, fov.up, fov.down],
            hidden: match mesh {
                Some(mesh) => mesh.eye(eye).iter().map(|t| in_tangents(t, fov)).collect(),
                None => outside(&lenses[eye], fov),
            },
        }
    });
    RuntimeSettings {
        system: format!("Parallax {}", hmd.name),
        eye_size_px: hmd.eye_size_px,
        eyes,
        heads: heads.iter().map(pose).collect(),
        space: PathSpace::Local,
        eye_height_m: 0.0,
        frame_ns: 1,
        frames: 1,
        most_empty_frames: 1,
    }
}

/// An eye that a program showed, in the form of a trace. Unknown planes are 0.1 m and infinity.
pub fn eye_view(shown: &ShownEye) -> EyeView {
    let turn = DQuat::from_array(shown.orientation.map(f64::from)).normalize();
    let place = DVec3::from_array(shown.position_m.map(f64::from));
    let eye_to_world = DAffine3::from_rotation_translation(turn, place);
    let [left, right, up, down] = shown.angles.map(|angle| f64::from(angle).tan() as f32);
    let (near, far) = match shown.planes_m {
        Some((near, far)) => (near, far.unwrap_or(f32::INFINITY)),
        None => (NEAR_M, FAR_M),
    };
    let fov = FovTangents::new(-left, right, up, -down);
    EyeView {
        world_to_eye: glam::DMat4::from(eye_to_world.inverse())
            .as_mat4()
            .to_cols_array_2d(),
        eye_to_clip: cameras::projection(&fov, near, far).to_cols_array_2d(),
        position: shown.position_m,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use scene::hmd;

    /// Left and right eye of a display, as the runtime gives them, at a head.
    fn shown(hmd: &Hmd, head: &Head) -> [ShownEye; 2] {
        let heads = [cameras::head_pose(&head.camera())];
        let lenses = hmd.fov.map(|fov| Lens::of(&fov));
        let settings = display_settings(hmd, &lenses, None, &heads);
        let affine = |pose: &Pose| {
            let turn = DQuat::from_array(pose.orientation);
            DAffine3::from_rotation_translation(turn, DVec3::from_array(pose.position_m))
        };
        [0, 1].map(|eye| {
            let of = &settings.eyes[eye];
            let world = affine(&settings.heads[0]) * affine(&of.in_head);
            let turn = DQuat::from_mat3(&world.matrix3);
            let [left, right, up, down] = of.tangents.map(|t| f64::from(t).atan() as f32);
            ShownEye {
                image: 0,
                layer: 0,
                rect: [0; 4],
                orientation: turn.to_array().map(|part| part as f32),
                position_m: world.translation.as_vec3().to_array(),
                angles: [-left, right, up, -down],
                planes_m: None,
            }
        })
    }

    #[test]
    fn eyes_of_every_preset_equal_those_of_a_scene() {
        let head = Head {
            position_m: [0.3, 1.7, -2.0],
            pitch_deg: -35.0,
        };
        for name in hmd::PRESETS {
            let hmd = hmd::preset(name).unwrap();
            let expected = cameras::eye_views(&head.camera(), &hmd);
            for (shown, expected) in shown(&hmd, &head).iter().zip(expected) {
                let found = eye_view(shown);
                let pairs = [
                    (found.world_to_eye, expected.world_to_eye),
                    (found.eye_to_clip, expected.eye_to_clip),
                ];
                for (found, expected) in pairs {
                    for (a, b) in found.as_flattened().iter().zip(expected.as_flattened()) {
                        assert!((a - b).abs() <= 1e-6, "{name}: {a} {b}");
                    }
                }
                for (a, b) in found.position.iter().zip(expected.position) {
                    assert!((a - b).abs() <= 1e-6, "{name}: {a} {b}");
                }
            }
        }
    }

    #[test]
    fn the_default_mesh_hides_what_the_lens_does_not_show() {
        let hmd = hmd::preset("index").unwrap();
        let size_px = [144, 160];
        let lenses = hmd.fov.map(|fov| Lens::of(&fov));
        for (eye, lens) in lenses.iter().enumerate() {
            let fov = &hmd.fov[eye];
            let part = |[x, y]: [f32; 2]| {
                [
                    (x + fov.left) / (fov.left + fov.right),
                    (y + fov.down) / (fov.up + fov.down),
                ]
            };
            let triangles: Vec<Triangle> = outside(lens, fov).iter().map(|t| t.map(part)).collect();
            let mesh = HiddenMesh {
                left: triangles.clone(),
                right: triangles,
            };
            let shown = mesh.shown(eye, size_px);
            // The polygon leaves the circle by a thousandth of its radius.
            let wider = Lens {
                radius: 1.003 * lens.radius,
                ..*lens
            };
            for y in 0..size_px[1] {
                for x in 0..size_px[0] {
                    let lens = lens.pixel_visible(fov, size_px, [x, y]);
                    assert!(
                        !lens || shown.get(x, y),
                        "{eye} {x} {y}: visible and hidden"
                    );
                    assert!(
                        lens || !shown.get(x, y) || wider.pixel_visible(fov, size_px, [x, y]),
                        "{eye} {x} {y}"
                    );
                }
            }
        }
    }

    #[test]
    fn a_mesh_of_fractions_is_told_in_tangents() {
        let hmd = hmd::preset("rift-s").unwrap();
        let mesh = HiddenMesh {
            left: vec![[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]],
            right: Vec::new(),
        };
        let lenses = hmd.fov.map(|fov| Lens::of(&fov));
        let settings = display_settings(&hmd, &lenses, Some(&mesh), &[Affine3A::IDENTITY]);
        let fov = &hmd.fov[0];
        let expected = [
            [-fov.left, -fov.down],
            [fov.right, -fov.down],
            [-fov.left, fov.up],
        ];
        for (found, expected) in settings.eyes[0].hidden[0].iter().zip(expected) {
            assert!((found[0] - expected[0]).abs() < 1e-6 && (found[1] - expected[1]).abs() < 1e-6);
        }
        assert!(settings.eyes[1].hidden.is_empty());
    }
}
