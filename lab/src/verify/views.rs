//! Compares the eyes' matrices of a trace with the parameters of its display.

use super::faults::Faults;
use formats::view::{EyeView, FovTangents, FrameViews, Hmd};
use glam::{DMat3, DMat4, DVec3, Mat4};

/// Largest number of roundings of a view's matrix: a pose, an inverse, a product. Each is half a unit in the
/// last place of the largest term.
const ROUNDINGS: f64 = 64.0;

/// Relative error of one rounding.
const UNIT: f64 = f32::EPSILON as f64 / 2.0;

/// The views of a trace.
pub(super) struct Views<'a> {
    pub hmd: &'a Hmd,
    pub frames: &'a [FrameViews],
}

impl Views<'_> {
    /// Compares every frame's matrices with each other and with the display.
    pub fn hold(&self, faults: &mut Faults) {
        for views in self.frames {
            for (eye, (view, fov)) in views.eyes.iter().zip(&self.hmd.fov).enumerate() {
                let place = format!("frame {} eye {eye}", views.frame);
                hold_projection(&place, view, fov, faults);
                hold_position(&place, view, faults);
                self.hold_planes(&place, view, faults);
            }
            self.hold_eyes(views, faults);
        }
    }

    /// All eyes have the planes of the first one.
    fn hold_planes(&self, place: &str, view: &EyeView, faults: &mut Faults) {
        let planes = |view: &EyeView| [view.eye_to_clip[2][2], view.eye_to_clip[3][2]];
        if let Some(first) = self.frames.first() {
            let place = format!("{place}: eye_to_clip, near and far plane");
            faults.hold(&place, &planes(&first.eyes[0]), &planes(view));
        }
    }

    /// From the right eye's space to the left's. It depends on the distance between the eyes and on their
    /// cant, by which both turn outwards.
    fn hold_eyes(&self, views: &FrameViews, faults: &mut Faults) {
        let cant = f64::from(self.hmd.cant_deg).to_radians();
        let turn = DMat3::from_rotation_y(-cant);
        let offset = turn * DVec3::X * f64::from(self.hmd.ipd_m);
        let [left, right] = views.eyes.each_ref().map(|eye| wide(&eye.world_to_eye));
        let found = left * right.inverse();
        let rotation = turn * turn;
        let largest = views.eyes.iter().flat_map(|eye| eye.position);
        let largest = largest.fold(1.0, |most, at| f64::from(at.abs()).max(most));
        let allowed = |scale: f64| ROUNDINGS * UNIT * scale;
        let turned = (0..3).all(|column| {
            let error = found.col(column).truncate() - rotation.col(column);
            error.abs().max_element() <= allowed(1.0)
        });
        let moved = (found.w_axis.truncate() - offset).abs().max_element();
        let place = format!("frame {}: from the right eye to the left", views.frame);
        if !turned {
            let expected = format!(
                "a turn by {} degrees, twice hmd.cant_deg",
                2.0 * self.hmd.cant_deg
            );
            faults.add(&place, &expected, "another one in world_to_eye");
        }
        if moved > allowed(largest + f64::from(self.hmd.ipd_m)) {
            let expected = format!("{} m, hmd.ipd_m", self.hmd.ipd_m);
            let found = format!("{} m in world_to_eye", found.w_axis.truncate().length());
            faults.add(&place, &expected, &found);
        }
    }
}

fn wide(matrix: &[[f32; 4]; 4]) -> DMat4 {
    Mat4::from_cols_array_2d(matrix).as_dmat4()
}

/// Except for its near and far planes, `eye_to_clip` follows from the tangents.
fn hold_projection(place: &str, view: &EyeView, fov: &FovTangents, faults: &mut Faults) {
    let [left, right, up, down] = [fov.left, fov.right, fov.up, fov.down].map(f64::from);
    let (width, height) = (left + right, up + down);
    let found = view.eye_to_clip.map(|column| column.map(f64::from));
    let depth = [found[2][2], found[3][2]];
    let expected = [
        [2.0 / width, 0.0, 0.0, 0.0],
        [0.0, 2.0 / height, 0.0, 0.0],
        [(right - left) / width, (up - down) / height, depth[0], -1.0],
        [0.0, 0.0, depth[1], 0.0],
    ];
    for (column, (expected, found)) in expected.iter().zip(&found).enumerate() {
        for (row, (expected, found)) in expected.iter().zip(found).enumerate() {
            // Tangents of both signs may cancel in their sum.
            let terms = left.abs() + right.abs() + up.abs() + down.abs();
            let allowed = 4.0 * UNIT * (1.0 + expected.abs()) * (1.0 + terms / width.min(height));
            if (expected - found).abs() > allowed {
                let place = format!("{place}: eye_to_clip, column {column} row {row}");
                faults.add(
                    &place,
                    &format!("{expected} by hmd.fov"),
                    &found.to_string(),
                );
            }
        }
    }
    // At distance d the depth is offset / d - scale. Both planes are ahead of the eye, the far one behind the
    // near one or infinitely far, where the scale is -1, or 0 if the depth is reversed.
    let [scale, offset] = depth;
    let ascending = scale <= -1.0 && offset < 0.0;
    let reversed = scale >= 0.0 && offset > 0.0;
    if !(ascending || reversed) {
        let expected = "planes of depth 0 and 1 ahead of the eye";
        faults.add(
            &format!("{place}: eye_to_clip"),
            expected,
            &format!("{scale} and {offset}"),
        );
    }
}

/// `world_to_eye` rotates and translates, and maps `position` to zero.
fn hold_position(place: &str, view: &EyeView, faults: &mut Faults) {
    let matrix = wide(&view.world_to_eye);
    let turn = DMat3::from_mat4(matrix);
    let products = turn.transpose() * turn - DMat3::IDENTITY;
    let worst = products
        .to_cols_array()
        .into_iter()
        .fold(0.0, |w: f64, v| w.max(v.abs()));
    let last_row = matrix.row(3).to_array() == [0.0, 0.0, 0.0, 1.0];
    if worst > ROUNDINGS * UNIT || !last_row || turn.determinant() < 0.0 {
        faults.add(
            &format!("{place}: world_to_eye"),
            "a turn and a move",
            "another matrix",
        );
    }
    let position = DVec3::from(view.position.map(f64::from));
    let at = matrix.transform_point3(position).abs().max_element();
    let allowed = ROUNDINGS * UNIT * (1.0 + position.abs().max_element());
    if at > allowed {
        let expected = "what world_to_eye takes to zero";
        let found = format!("a point {at} m from it");
        faults.add(&format!("{place}: position"), expected, &found);
    }
}
