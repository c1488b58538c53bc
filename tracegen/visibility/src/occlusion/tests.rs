use super::*;
use crate::testing::within;
use formats::random::Random;
use glam::camera::rh::proj::directx::perspective;

const SIZE_PX: [u32; 2] = [67, 45];

#[test]
fn the_pyramid_is_never_nearer_than_any_pixel_of_the_rectangle() {
    let mut random = Random(3);
    let pixels = (SIZE_PX[0] * SIZE_PX[1]) as usize;
    let depth: Vec<f32> = (0..pixels).map(|_| random.unit_f32()).collect();
    let pyramid = Pyramid::new(SIZE_PX, depth.clone());
    for _ in 0..2000 {
        let mut ends = |axis: usize| {
            let mut at = || (random.unit_f32() * SIZE_PX[axis] as f32) as u32;
            let (a, b) = (at(), at());
            [a.min(b), a.max(b)]
        };
        let (columns, rows) = (ends(0), ends(1));
        let exact = (rows[0]..=rows[1])
            .flat_map(|y| (columns[0]..=columns[1]).map(move |x| (x, y)))
            .map(|(x, y)| depth[(y * SIZE_PX[0] + x) as usize])
            .fold(1.0, f32::min);
        let found = pyramid.farthest(columns, rows);
        assert!(found <= exact, "{columns:?} {rows:?}");
        // The result is exact for up to four texels per axis.
        if columns[1] - columns[0] < 4 && rows[1] - rows[0] < 4 {
            assert_eq!(found, exact);
        }
    }
}

/// Depth of a wall 10 m ahead in the left half of the picture.
fn wall(clip: Mat4) -> Pyramid {
    let at = clip.project_point3(Vec3::new(0.0, 0.0, -10.0)).z;
    let [width, height] = SIZE_PX;
    let row = || (0..width).map(|x| if x < width / 2 { at } else { 0.0 });
    Pyramid::new(SIZE_PX, (0..height).flat_map(|_| row()).collect())
}

#[test]
fn only_boxes_behind_the_wall_are_hidden() {
    let clip = perspective(1.2, 67.0 / 45.0, 100.0, 0.1);
    let wall = wall(clip);
    let hidden = |center: Vec3, half: f32| {
        let bounds = [center - Vec3::splat(half), center + Vec3::splat(half)];
        hidden(bounds, &clip.as_dmat4(), &wall)
    };
    assert!(hidden(Vec3::new(-8.0, 0.0, -20.0), 1.0));
    assert!(!hidden(Vec3::new(-2.0, 0.0, -5.0), 1.0), "before the wall");
    assert!(!hidden(Vec3::new(-4.0, 0.0, -10.0), 1.0), "in the wall");
    assert!(!hidden(Vec3::new(8.0, 0.0, -20.0), 1.0), "beside the wall");
    assert!(!hidden(Vec3::new(0.0, 0.0, -20.0), 1.0), "behind its edge");
    assert!(!hidden(Vec3::new(0.0, 0.0, 0.0), 1.0), "around the eye");
    assert!(!hidden(Vec3::new(-8.0, 0.0, -20.0), f32::NAN), "nowhere");
}

#[test]
fn a_box_with_a_point_in_front_of_the_depth_is_never_hidden() {
    let clip = perspective(1.2, 67.0 / 45.0, 100.0, 0.1);
    let wall = wall(clip);
    let mut random = Random(4);
    let room = [Vec3::new(-20.0, -12.0, -40.0), Vec3::new(20.0, 12.0, 2.0)];
    let (mut seen, mut lost) = (0, 0);
    for _ in 0..20_000 {
        let low = within(&mut random, room);
        let size = Vec3::new(random.unit_f32(), random.unit_f32(), random.unit_f32()) * 4.0;
        let bounds = [low, low + size];
        let point = within(&mut random, bounds);
        let p = clip * point.extend(1.0);
        let inside = p.x.abs() < p.w && p.y.abs() < p.w && 0.0 < p.z && p.z < p.w;
        let hides = hidden(bounds, &clip.as_dmat4(), &wall);
        lost += usize::from(hides);
        if inside {
            let column = ((p.x / p.w + 1.0) / 2.0 * SIZE_PX[0] as f32) as u32;
            let row = ((1.0 - p.y / p.w) / 2.0 * SIZE_PX[1] as f32) as u32;
            let depth = wall.farthest([column; 2], [row; 2]);
            if p.z / p.w >= depth {
                seen += 1;
                assert!(!hides, "{bounds:?}");
            }
        }
    }
    assert!(seen > 1000 && lost > 1000, "{seen} seen, {lost} hidden");
}

#[test]
fn the_first_frame_hides_nothing_and_its_visible_draws_come_first_in_the_second() {
    let clip = perspective(1.2, 67.0 / 45.0, 100.0, 0.1);
    let behind = [Vec3::new(-9.0, -1.0, -21.0), Vec3::new(-7.0, 1.0, -19.0)];
    let before = behind.map(|corner| corner + Vec3::Z * 12.0);
    let bounds = |draw: u32| if draw == 0 { behind } else { before };
    let empty = Pyramid::new(SIZE_PX, vec![0.0; (SIZE_PX[0] * SIZE_PX[1]) as usize]);
    let mut occlusion = Occlusion::default();
    assert!(occlusion.first(0, &[0, 1]).is_empty());
    let mut kept = vec![0, 1];
    assert_eq!(occlusion.second(0, &mut kept, bounds, clip, &empty), 2);
    assert_eq!(kept, [0, 1]);
    assert_eq!(occlusion.first(0, &[1, 2]), [1]);
    let _ = occlusion.second(0, &mut kept, bounds, clip, &wall(clip));
    assert_eq!(kept, [1]);
    assert_eq!(occlusion.first(0, &[0, 1]), [1]);
    assert!(occlusion.first(1, &[0, 1]).is_empty());
}
