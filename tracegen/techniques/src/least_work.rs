//! Chooses the split of the far field for which a frame costs least.
//!
//! The costs follow from a model, not from a measurement of the frame. All draws and all triangles cost the
//! same. Those nearer than the split count twice (once per eye), those beyond it once, and those on both
//! sides three times. A pixel is shaded about once, because depth is tested early. The share of pixels that
//! belongs to the far field is the share of the area of the objects' boxes beyond the split; the area of a
//! box counts as spread evenly over its range of depths. Each pixel of the far field's pictures has a small
//! additional cost. Between the depths at which a box starts or ends, the cost is linear in the split. The
//! best split is therefore one of these depths, or the nearest allowed split.

use formats::view::EyeView;
use glam::{Vec2, Vec3};

/// Properties of a visible draw that the model uses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Object {
    /// Nearest distance ahead of the eyes.
    pub near_m: f32,
    /// Farthest distance ahead of the eyes.
    pub far_m: f32,
    /// Triangles.
    pub triangles: u32,
    /// Area of its bounds in an eye's picture.
    pub area_px: f32,
}

impl Object {
    /// A draw with these world-space bounds, seen by two eyes with pictures of `size_px`; `None` if neither
    /// eye sees it.
    pub fn of_bounds(
        [low, high]: [Vec3; 2],
        triangles: u32,
        eyes: &[EyeView; 2],
        size_px: [u32; 2],
    ) -> Option<Self> {
        let mut object: Option<Self> = None;
        for eye in eyes {
            let clip = eye.clip_from_world();
            let (mut near_m, mut far_m) = (f32::INFINITY, f32::NEG_INFINITY);
            let (mut first, mut last) = (Vec2::INFINITY, Vec2::NEG_INFINITY);
            for corner in 0..8 {
                let pick = |axis: usize| if corner >> axis & 1 == 0 { low } else { high }[axis];
                let at = clip * Vec3::new(pick(0), pick(1), pick(2)).extend(1.0);
                (near_m, far_m) = (near_m.min(at.w), far_m.max(at.w));
                // Next to or behind the eye, it may extend to any edge.
                let ndc = if at.w > 1e-3 {
                    at.truncate().truncate() / at.w
                } else {
                    Vec2::INFINITY
                };
                first = first.min(if at.w > 1e-3 { ndc } else { -ndc });
                last = last.max(ndc);
            }
            let seen = last.min(Vec2::ONE) - first.max(-Vec2::ONE);
            if far_m > 0.0 && seen.min_element() > 0.0 {
                let area_px = seen.x * seen.y / 4.0 * size_px[0] as f32 * size_px[1] as f32;
                let known = object.unwrap_or(Self {
                    near_m,
                    far_m,
                    triangles,
                    area_px,
                });
                object = Some(Self {
                    near_m: known.near_m.min(near_m).max(0.0),
                    far_m: known.far_m.max(far_m),
                    area_px: known.area_px.max(area_px),
                    ..known
                });
            }
        }
        object
    }
}

/// Costs per item, in the same unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Costs {
    /// Cost of a draw.
    pub draw: f64,
    /// Cost of a triangle.
    pub triangle: f64,
    /// Cost of a shaded pixel.
    pub shaded_px: f64,
    /// Cost of a pixel that is masked in the far field or composed into an eye's picture.
    pub composed_px: f64,
}

impl Costs {
    /// Nanoseconds, assumed for a software driver. Only their ratios matter. The numbers are round and not
    /// fitted to measurements.
    pub const LAVAPIPE: Self = Self {
        draw: 6000.0,
        triangle: 90.0,
        shaded_px: 100.0,
        composed_px: 12.0,
    };
}

/// Number of pixels of an eye's picture and of the far field's picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pixels {
    /// Pixels of one eye's picture.
    pub eye: f64,
    /// Pixels of the far field's picture.
    pub far: f64,
}

/// The split, at least `nearest_m`, with the least cost for a frame of `objects`; `None` if a frame without a
/// far field costs least.
pub fn least_work(
    objects: &[Object],
    pixels: Pixels,
    costs: &Costs,
    nearest_m: f32,
) -> Option<f32> {
    let mut frame = WorkSums::new(objects);
    // Depth at which a box starts or ends, whether it starts, and the box.
    let mut events: Vec<(f32, bool, &Object)> = objects
        .iter()
        .flat_map(|object| {
            [
                (object.near_m, true, object),
                (end_m(object), false, object),
            ]
        })
        .collect();
    // At equal depth, ends come before starts.
    events.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut least: Option<(f64, f32)> = None;
    let mut consider = |frame: &WorkSums, split_m: f32| {
        let cost = frame.cost(split_m, pixels, costs);
        if least.is_none_or(|(known, _)| cost < known) {
            least = Some((cost, split_m));
        }
    };
    let mut begun = false;
    for (depth_m, begins, object) in events {
        if depth_m > nearest_m && !begun {
            begun = true;
            consider(&frame, nearest_m);
        }
        if begins {
            // An object that starts at the split is beyond it.
            if begun {
                consider(&frame, depth_m);
            }
            frame.begin(object);
        } else {
            frame.end(object);
            if begun {
                consider(&frame, depth_m);
            }
        }
    }
    least
        .filter(|(cost, _)| *cost < frame.cost_without_far_field(pixels, costs))
        .map(|(_, split_m)| split_m)
}

/// Sums of the model while the split moves away from the eyes.
struct WorkSums {
    /// Number of all draws and triangles.
    all: [f64; 2],
    /// Number of those that start before the split.
    near: [f64; 2],
    /// Number of those that end beyond it.
    far: [f64; 2],
    /// Total area of all boxes.
    area: f64,
    /// Area beyond the split: `beyond[0] + split * beyond[1]`.
    beyond: [f64; 2],
}

impl WorkSums {
    fn new(objects: &[Object]) -> Self {
        let triangles = objects.iter().map(|o| f64::from(o.triangles)).sum();
        let all = [objects.len() as f64, triangles];
        let area = objects.iter().map(|o| f64::from(o.area_px)).sum();
        Self {
            all,
            near: [0.0; 2],
            far: all,
            area,
            beyond: [area, 0.0],
        }
    }

    /// Moves the split past the start of a box.
    fn begin(&mut self, object: &Object) {
        self.near[0] += 1.0;
        self.near[1] += f64::from(object.triangles);
        let (whole, part) = areas(object);
        self.beyond[0] += part[0] - whole;
        self.beyond[1] += part[1];
    }

    /// Moves the split past the end of a box.
    fn end(&mut self, object: &Object) {
        self.far[0] -= 1.0;
        self.far[1] -= f64::from(object.triangles);
        let (_, part) = areas(object);
        self.beyond[0] -= part[0];
        self.beyond[1] -= part[1];
    }

    fn cost(&self, split_m: f32, pixels: Pixels, costs: &Costs) -> f64 {
        let beyond = self.beyond[0] + f64::from(split_m) * self.beyond[1];
        let far_share = if self.area > 0.0 {
            (beyond / self.area).clamp(0.0, 1.0)
        } else {
            0.0
        };
        let submitted =
            |[draws, triangles]: [f64; 2]| draws * costs.draw + triangles * costs.triangle;
        2.0 * submitted(self.near)
            + submitted(self.far)
            + (2.0 - far_share) * pixels.eye * costs.shaded_px
            + (pixels.far + 2.0 * pixels.eye) * costs.composed_px
    }

    fn cost_without_far_field(&self, pixels: Pixels, costs: &Costs) -> f64 {
        2.0 * (self.all[0] * costs.draw
            + self.all[1] * costs.triangle
            + pixels.eye * costs.shaded_px)
    }
}

/// Depth of the end of a box. For a flat box, it is slightly behind the start.
fn end_m(object: &Object) -> f32 {
    object.far_m.max(object.near_m.next_up())
}

/// The area of a box, and the coefficients of its area beyond a split inside it.
fn areas(object: &Object) -> (f64, [f64; 2]) {
    let area = f64::from(object.area_px);
    let [near_m, far_m] = [object.near_m, end_m(object)].map(f64::from);
    let depth = far_m - near_m;
    (area, [area * far_m / depth, -area / depth])
}

#[cfg(test)]
mod tests {
    use super::*;
    use formats::random::units;

    const PIXELS: Pixels = Pixels {
        eye: 10_000.0,
        far: 11_000.0,
    };

    fn object(near_m: f32, far_m: f32) -> Object {
        Object {
            near_m,
            far_m,
            triangles: 500,
            area_px: 900.0,
        }
    }

    /// The model's cost, computed directly from its description.
    fn cost(objects: &[Object], split_m: f32, costs: &Costs) -> f64 {
        let submitted = |o: &Object| costs.draw + f64::from(o.triangles) * costs.triangle;
        let near: f64 = objects
            .iter()
            .filter(|o| o.near_m < split_m)
            .map(submitted)
            .sum();
        let far: f64 = objects
            .iter()
            .filter(|o| o.far_m > split_m || o.near_m >= split_m)
            .map(submitted)
            .sum();
        let area: f64 = objects.iter().map(|o| f64::from(o.area_px)).sum();
        let beyond = |o: &Object| {
            let share = if o.near_m >= split_m {
                1.0
            } else if o.far_m <= split_m {
                0.0
            } else {
                f64::from(o.far_m - split_m) / f64::from(o.far_m - o.near_m)
            };
            share * f64::from(o.area_px)
        };
        let share = objects.iter().map(beyond).sum::<f64>() / area;
        let shaded = 2.0 * PIXELS.eye * (1.0 - share) + PIXELS.eye * share;
        2.0 * near
            + far
            + shaded * costs.shaded_px
            + (PIXELS.far + 2.0 * PIXELS.eye) * costs.composed_px
    }

    #[test]
    fn no_allowed_split_on_a_fine_grid_costs_less() {
        let mut random = units(7);
        let (mut with, mut without) = (0, 0);
        for _ in 0..300 {
            let count = 1 + (random() * 30.0) as usize;
            let objects: Vec<Object> = (0..count)
                .map(|_| {
                    let near_m = 0.5 + 20.0 * random();
                    Object {
                        near_m,
                        far_m: near_m + if random() < 0.2 { 0.0 } else { 15.0 * random() },
                        triangles: (random() * 3000.0) as u32,
                        area_px: 1.0 + random() * 5000.0,
                    }
                })
                .collect();
            let costs = Costs {
                composed_px: f64::from(random()) * 60.0,
                ..Costs::LAVAPIPE
            };
            let nearest_m = 1.0 + 4.0 * random();
            let plain: f64 = objects
                .iter()
                .map(|o| costs.draw + f64::from(o.triangles) * costs.triangle)
                .sum();
            let plain = 2.0 * (plain + PIXELS.eye * costs.shaded_px);
            let grid = (0..2000).map(|i| nearest_m + 0.02 * i as f32);
            let best = grid
                .map(|split| cost(&objects, split, &costs))
                .fold(plain, f64::min);
            match least_work(&objects, PIXELS, &costs, nearest_m) {
                Some(split_m) => {
                    with += 1;
                    assert!(split_m >= nearest_m);
                    let found = cost(&objects, split_m, &costs);
                    assert!(
                        found < plain && found <= best * (1.0 + 1e-6),
                        "{found} {best} {plain}"
                    );
                }
                None => {
                    without += 1;
                    assert!(best >= plain * (1.0 - 1e-6), "{best} {plain}");
                }
            }
        }
        assert!(
            with > 10 && without > 10,
            "{with} with and {without} without a far field"
        );
    }

    #[test]
    fn an_object_has_the_range_and_the_area_of_its_box() {
        let projection = glam::camera::rh::proj::directx::perspective(
            std::f32::consts::FRAC_PI_2,
            1.0,
            0.1,
            100.0,
        );
        let eye = EyeView {
            eye_to_clip: projection.to_cols_array_2d(),
            ..EyeView::default()
        };
        let of = |low: Vec3, high: Vec3| Object::of_bounds([low, high], 7, &[eye; 2], [100, 200]);
        let seen = of(Vec3::new(-1.0, -1.0, -8.0), Vec3::new(1.0, 1.0, -4.0)).unwrap();
        assert!((seen.near_m - 4.0).abs() < 1e-5 && (seen.far_m - 8.0).abs() < 1e-5);
        // 2 m of 8 m at 4 m, on both axes.
        assert!(
            (seen.area_px - 100.0 * 200.0 / 16.0).abs() < 1.0,
            "{seen:?}"
        );
        assert_eq!(seen.triangles, 7);
        assert_eq!(of(Vec3::splat(2.0), Vec3::splat(3.0)), None);
        assert_eq!(
            of(Vec3::new(20.0, 0.0, -5.0), Vec3::new(21.0, 1.0, -4.0)),
            None
        );
        let around = of(Vec3::splat(-5.0), Vec3::splat(5.0)).unwrap();
        assert_eq!((around.near_m, around.area_px), (0.0, 20_000.0));
    }

    #[test]
    fn near_content_has_no_far_field_and_far_content_has_the_nearest_split() {
        let of = |objects: &[Object]| least_work(objects, PIXELS, &Costs::LAVAPIPE, 3.0);
        assert_eq!(of(&[object(1.0, 2.5)]), None);
        assert_eq!(of(&[]), None);
        assert_eq!(of(&vec![object(5.0, 9.0); 100]), Some(3.0));
        // The best split is behind an object that spans the nearest split, if most of the work is beyond it.
        let mut mixed = vec![object(10.0, 20.0); 40];
        mixed.push(Object {
            triangles: 100_000,
            ..object(2.0, 4.0)
        });
        assert_eq!(of(&mixed), Some(4.0));
    }
}
