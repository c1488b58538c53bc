//! Maps directions to the pictures of two eyes. Distant points lie in the same direction for both.

use super::View;
use formats::view::EyeView;

type Vector = [f64; 3];

fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn unit(a: Vector) -> Option<Vector> {
    let length = dot(a, a).sqrt();
    (length > 1e-6).then(|| a.map(|x| x / length))
}

/// Directions at nearly a right angle to straight ahead, or further, are clamped to this tangent.
const MOST_TANGENT: f64 = 8.0;

/// One eye: its axes in the world, and its projection.
#[derive(Clone, Copy, Debug)]
struct Eye {
    axes: [Vector; 3],
    /// Scale and shift from tangents to the picture, whose coordinates range from -1 to 1.
    scale: [f64; 2],
    shift: [f64; 2],
    /// Half of the picture's size in tiles.
    half_tiles: [f64; 2],
}

impl Eye {
    fn new(view: &EyeView, of: View, tile_px: u32) -> Option<Self> {
        let (world, clip) = (&view.world_to_eye, &view.eye_to_clip);
        let axis = |row: usize| unit([0, 1, 2].map(|column: usize| f64::from(world[column][row])));
        let scale = [0, 1].map(|axis: usize| f64::from(clip[axis][axis]));
        if scale.iter().any(|scale| !(1e-3..1e6).contains(scale)) {
            return None;
        }
        Some(Self {
            axes: [axis(0)?, axis(1)?, axis(2)?],
            scale,
            shift: [0, 1].map(|axis: usize| f64::from(clip[2][axis])),
            half_tiles: of.size_px.map(|px| f64::from(px) / f64::from(2 * tile_px)),
        })
    }

    /// The direction of a position in the picture, which is given in tiles from its top left.
    fn direction(&self, [x, y]: [f64; 2]) -> Vector {
        let at = [x / self.half_tiles[0] - 1.0, 1.0 - y / self.half_tiles[1]];
        let [right, up] = [0, 1].map(|axis| (at[axis] + self.shift[axis]) / self.scale[axis]);
        let [x, y, z] = self.axes;
        [0, 1, 2].map(|i| right * x[i] + up * y[i] - z[i])
    }

    /// The position of a direction in tiles from the top left; none behind the eye.
    fn tile(&self, direction: Vector) -> Option<[f64; 2]> {
        let [right, up, back] = self.axes.map(|axis| dot(axis, direction));
        let ahead = -back;
        if ahead <= 0.0 {
            return None;
        }
        let at = [right / ahead, up / ahead];
        let at = [0, 1].map(|axis| at[axis] * self.scale[axis] - self.shift[axis]);
        Some([
            (at[0] + 1.0) * self.half_tiles[0],
            (1.0 - at[1]) * self.half_tiles[1],
        ])
    }
}

/// Both eyes, and the head between them.
#[derive(Clone, Copy, Debug)]
pub struct Directions {
    eyes: [Eye; 2],
    /// Right, up and back.
    head: [Vector; 3],
}

impl Directions {
    /// None if the matrices do not describe eyes.
    pub fn new(views: &[EyeView; 2], of: [View; 2], tile_px: u32) -> Option<Self> {
        let eyes = [
            Eye::new(&views[0], of[0], tile_px)?,
            Eye::new(&views[1], of[1], tile_px)?,
        ];
        let mean = |axis: usize| {
            let [a, b] = eyes.map(|eye: Eye| eye.axes[axis]);
            unit([0, 1, 2].map(|i: usize| a[i] + b[i]))
        };
        Some(Self {
            eyes,
            head: [mean(0)?, mean(1)?, mean(2)?],
        })
    }

    /// Columns and rows by which straight ahead lies further left and further up in the right eye's picture
    /// than in the left eye's.
    pub fn offset(&self) -> [i32; 2] {
        let ahead = self.head[2].map(|x| -x);
        let [left, right] = self.eyes.map(|eye| eye.tile(ahead));
        match (left, right) {
            (Some(left), Some(right)) => [0, 1].map(|axis| {
                let tiles = (left[axis] - right[axis]).round();
                // Limited to the size of the largest picture.
                tiles.clamp(-4096.0, 4096.0) as i32
            }),
            _ => [0, 0],
        }
    }

    /// The position of the centre of one eye's tile in the picture of the other eye, in tiles.
    pub(super) fn in_other_eye(&self, eye: usize, tile: [u32; 2]) -> Option<[f64; 2]> {
        self.eyes[1 - eye].tile(self.middle(eye, tile))
    }

    /// The cell in the picture of the head, whose cells are as large as the left eye's tiles. Columns count to
    /// the right and rows downwards from straight ahead.
    pub(super) fn in_head(&self, eye: usize, tile: [u32; 2]) -> [i32; 2] {
        let direction = self.middle(eye, tile);
        let [right, up, back] = self.head.map(|axis| dot(axis, direction));
        let tangent = |x: f64| {
            let ahead = -back;
            if ahead * MOST_TANGENT > x.abs() {
                x / ahead
            } else {
                MOST_TANGENT.copysign(x)
            }
        };
        let left = &self.eyes[0];
        let cells = |axis: usize, tangent: f64| {
            (tangent * left.scale[axis] * left.half_tiles[axis]).floor() as i32
        };
        [cells(0, tangent(right)), cells(1, -tangent(up))]
    }

    fn middle(&self, eye: usize, tile: [u32; 2]) -> Vector {
        self.eyes[eye].direction(tile.map(|n| f64::from(n) + 0.5))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stream::testing::turned_eye as eye;

    const GRID: View = View::grid(0, [60, 68]);

    fn directions(left: EyeView, right: EyeView) -> Directions {
        Directions::new(&[left, right], [GRID; 2], 16).unwrap()
    }

    const AHEAD: [f32; 2] = [0.0, 1.0];

    #[test]
    fn symmetric_eyes_show_infinity_at_the_same_place() {
        let symmetric = || eye(AHEAD, [1.0; 4]);
        let directions = directions(symmetric(), symmetric());
        assert_eq!(directions.offset(), [0, 0]);
        let [x, y] = directions.in_other_eye(0, [7, 50]).unwrap();
        assert!((x - 7.5).abs() < 1e-4 && (y - 50.5).abs() < 1e-4, "{x} {y}");
        assert_eq!(directions.in_head(0, [7, 50]), [7 - 30, 50 - 34]);
        assert_eq!(directions.in_head(1, [7, 50]), [7 - 30, 50 - 34]);
    }

    #[test]
    fn wider_outer_angles_shift_infinity() {
        // Straight ahead lies at 2/3 of the left picture and 1/3 of the right one, at half the height in the
        // left one.
        let left = eye(AHEAD, [2.0, 1.0, 1.0, 1.0]);
        let right = eye(AHEAD, [1.0, 2.0, 1.0, 3.0]);
        assert_eq!(directions(left, right).offset(), [20, 17]);
    }

    #[test]
    fn canted_eyes_see_the_same_direction_at_places_that_follow_from_the_angle() {
        // The left eye is turned to the left by the angle of a 3-4-5 triangle. The right eye looks straight
        // ahead.
        let left = eye([0.6, 0.8], [1.0; 4]);
        let directions = directions(left, eye(AHEAD, [1.0; 4]));
        // The axis of the left eye lies at the tangent -3/4 in the right eye.
        let [x, y] = directions.eyes[1]
            .tile(directions.eyes[0].direction([30.0, 34.0]))
            .unwrap();
        assert!(
            (x - 30.0 * 0.25).abs() < 1e-4 && (y - 34.0).abs() < 1e-4,
            "{x} {y}"
        );
    }

    #[test]
    fn matrices_that_are_not_eyes_are_rejected() {
        let flat = EyeView {
            world_to_eye: [[0.0; 4]; 4],
            ..EyeView::default()
        };
        assert!(Directions::new(&[flat, eye(AHEAD, [1.0; 4])], [GRID; 2], 16).is_none());
    }
}
