use super::*;
use formats::random::Random;
use glam::camera::rh::{proj::directx::perspective, view::look_at_mat4};
use std::collections::BTreeSet;

const SIZE_PX: [u32; 2] = [100, 70];

/// A view that maps pixels from the top left to clip space.
fn pixels() -> BinnedView {
    let [width, height] = SIZE_PX.map(|size| size as f32);
    BinnedView {
        clip_from_world: Mat4::from_cols_array(&[
            2.0 / width,
            0.0,
            0.0,
            0.0, //
            0.0,
            -2.0 / height,
            0.0,
            0.0, //
            0.0,
            0.0,
            1.0,
            0.0, //
            -1.0,
            1.0,
            0.5,
            1.0,
        ]),
        size_px: SIZE_PX,
    }
}

fn binned(
    view: &BinnedView,
    triangles: &[[Vec3; 3]],
    double_sided: bool,
    mirrored: bool,
) -> Vec<(u32, u32)> {
    let positions = triangles.concat();
    let indices: Vec<u32> = (0..positions.len() as u32).collect();
    let draw = BinnedDraw {
        positions: &positions,
        indices: &indices,
        world_from_object: Affine3A::IDENTITY,
        double_sided,
        mirrored,
        first_primitive: 10,
    };
    let mut out = Vec::new();
    bin(view, &draw, &mut out);
    out
}

fn on_screen(points: [[f32; 2]; 3]) -> [Vec3; 3] {
    points.map(|[x, y]| Vec3::new(x, y, 0.0))
}

fn tiles_of(points: [[f32; 2]; 3]) -> Vec<u32> {
    binned(&pixels(), &[on_screen(points)], true, false)
        .iter()
        .map(|(tile, _)| *tile)
        .collect()
}

#[test]
fn a_triangle_enters_only_the_tiles_that_it_covers() {
    assert_eq!(tiles_of([[1.0, 1.0], [5.0, 1.0], [1.0, 5.0]]), [0]);
    // The whole picture: 7 x 5 tiles.
    assert_eq!(
        tiles_of([[-500.0, -500.0], [900.0, -500.0], [-500.0, 900.0]]).len(),
        35
    );
    // A thin diagonal in 4 x 4 tiles: the tiles of the diagonal, and adjacent ones whose corner it passes.
    let thin = tiles_of([[0.0, 0.2], [63.0, 63.2], [63.0, 63.9]]);
    assert_eq!(thin, [0, 7, 8, 15, 16, 23, 24]);
    // Triangles in the margin of the picture, beyond it, and on both sides of a border.
    assert_eq!(tiles_of([[99.0, 60.0], [140.0, 60.0], [140.0, 69.0]]), [27]);
    assert!(tiles_of([[101.0, 60.0], [140.0, 60.0], [140.0, 69.0]]).is_empty());
    assert_eq!(tiles_of([[14.0, 2.0], [18.0, 2.0], [14.0, 5.0]]), [0, 1]);
}

#[test]
fn triangles_without_area_or_pixel_centre_enter_no_tile() {
    assert!(tiles_of([[1.0, 1.0], [5.0, 5.0], [9.0, 9.0]]).is_empty());
    assert!(tiles_of([[1.6, 1.6], [2.3, 1.6], [1.6, 2.3]]).is_empty());
    assert_eq!(tiles_of([[1.6, 1.6], [2.6, 1.6], [1.6, 2.6]]), [0]);
    assert!(tiles_of([[f32::NAN, 1.0], [5.0, 1.0], [1.0, 5.0]]).is_empty());
}

#[test]
fn back_faces_are_dropped_unless_the_draw_is_double_sided() {
    // Counterclockwise on the screen, where y points down.
    let front = on_screen([[1.0, 1.0], [1.0, 9.0], [9.0, 1.0]]);
    let back = [front[0], front[2], front[1]];
    let both = [front, back];
    assert_eq!(binned(&pixels(), &both, false, false), [(0, 10)]);
    assert_eq!(binned(&pixels(), &both, false, true), [(0, 11)]);
    assert_eq!(binned(&pixels(), &both, true, false), [(0, 10), (0, 11)]);
}

/// Tests random triangles in front of, across and behind the near plane. Each pixel centre whose ray meets a
/// triangle must be in one of its tiles, and few tiles may have no such pixel.
#[test]
fn every_pixel_of_a_triangle_is_in_its_tiles() {
    let view = BinnedView {
        clip_from_world: perspective(1.2, 100.0 / 70.0, 50.0, 0.5)
            * look_at_mat4(Vec3::new(1.0, 2.0, 3.0), Vec3::ZERO, Vec3::Y),
        size_px: SIZE_PX,
    };
    let inverse =
        DMat4::from_cols_array(&view.clip_from_world.to_cols_array().map(f64::from)).inverse();
    let mut source = Random(1);
    let mut random = || source.unit_f32() * 8.0 - 4.0;
    let (mut crossing, mut listed, mut covered) = (0, 0, 0);
    for _ in 0..400 {
        let triangle = [(); 3].map(|()| Vec3::new(random(), random(), random()));
        let depths = triangle.map(|p| view.clip_from_world.project_point3(p).z);
        crossing += usize::from(depths.iter().any(|z| *z < 0.0) && depths.iter().any(|z| *z > 0.0));
        let found = binned(&view, &[triangle], true, false);
        let found: BTreeSet<u32> = found.into_iter().map(|(tile, _)| tile).collect();
        let mut seen = BTreeSet::new();
        for y in 0..SIZE_PX[1] {
            for x in 0..SIZE_PX[0] {
                let ndc = |axis: usize, px: u32| {
                    (f64::from(px) + 0.5) / f64::from(SIZE_PX[axis]) * 2.0 - 1.0
                };
                let near = inverse.project_point3(glam::DVec3::new(ndc(0, x), -ndc(1, y), 0.0));
                let far = inverse.project_point3(glam::DVec3::new(ndc(0, x), -ndc(1, y), 1.0));
                if crosses(near, far, triangle.map(|p| p.as_dvec3())) {
                    seen.insert(y / 16 * 7 + x / 16);
                }
            }
        }
        assert!(found.is_superset(&seen), "{triangle:?}: {found:?} {seen:?}");
        listed += found.len();
        covered += seen.len();
    }
    assert!(crossing > 20 && covered > 2000, "{crossing} {covered}");
    assert!(listed < covered + covered / 10, "{listed} {covered}");
}

/// Whether the line from `a` to `b` meets a triangle (Moeller and Trumbore).
fn crosses(a: glam::DVec3, b: glam::DVec3, [p, q, r]: [glam::DVec3; 3]) -> bool {
    let (along, u, v) = (b - a, q - p, r - p);
    let normal = along.cross(v);
    let scale = 1.0 / u.dot(normal);
    let from = a - p;
    let s = scale * from.dot(normal);
    let turned = from.cross(u);
    let t = scale * along.dot(turned);
    let at = scale * v.dot(turned);
    s >= 0.0 && t >= 0.0 && s + t <= 1.0 && (0.0..=1.0).contains(&at)
}
