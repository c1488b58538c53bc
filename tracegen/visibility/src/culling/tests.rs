use super::*;
use crate::rig::Eye;
use crate::testing::{SIZE_PX, between, camera, rig_of, within};
use formats::random::Random;
use formats::view::{FovTangents, Hmd, Lens};
use glam::Vec3;
use scene::hmd;

const OBJECTS: usize = 100_000;
const HMDS: usize = 1000;
const ROOM: [Vec3; 2] = [Vec3::new(-60.0, -20.0, -60.0), Vec3::new(60.0, 20.0, 60.0)];

fn objects(count: usize) -> Vec<[Vec3; 2]> {
    let mut random = Random(11);
    (0..count)
        .map(|_| {
            let low = within(&mut random, ROOM);
            let size = 0.05 + 3.0 * random.unit_f32().powi(8);
            let edges = Vec3::new(random.unit_f32(), random.unit_f32(), random.unit_f32());
            [low, low + edges * size]
        })
        .collect()
}

/// A display and its angle from the left edge of one eye to the right edge of the other, up to 170 degrees.
fn random_hmd(random: &mut Random) -> (Hmd, f32) {
    loop {
        let mut tangent = |low, high| between(random, low, high).to_radians().tan();
        let fov = [(); 2].map(|()| FovTangents {
            left: tangent(-5.0, 80.0),
            right: tangent(10.0, 80.0),
            up: tangent(-5.0, 70.0),
            down: tangent(10.0, 70.0),
        });
        let hmd = Hmd {
            eye_size_px: SIZE_PX,
            fov,
            ipd_m: between(random, 0.0, 0.2),
            cant_deg: between(random, -15.0, 30.0),
            ..Hmd::default()
        };
        let [l, r] = fov;
        let degrees = |tangent: f32| tangent.atan().to_degrees();
        let left = (degrees(l.left) + hmd.cant_deg).max(degrees(r.left) - hmd.cant_deg);
        let right = (degrees(r.right) + hmd.cant_deg).max(degrees(l.right) - hmd.cant_deg);
        if hmd::validate(&hmd).is_ok() && left + right <= 170.0 {
            return (hmd, left + right);
        }
    }
}

/// A head in the room with a random display and random lenses inside its pictures. The lenses stay within 85
/// degrees of the direction of a cone around both.
fn random_rig(random: &mut Random) -> (Rig, f32) {
    loop {
        let (hmd, combined_deg) = random_hmd(random);
        let eye = within(random, ROOM);
        let direction = within(
            random,
            [Vec3::new(-1.0, -0.7, -1.0), Vec3::new(1.0, 0.7, 1.0)],
        );
        if direction.length() < 0.1 {
            continue;
        }
        let (near, far) = (between(random, 0.01, 0.5), between(random, 10.0, 200.0));
        let lenses = hmd.fov.map(|fov| Lens {
            center: [
                between(random, -0.2, 0.2) + (fov.right - fov.left) / 2.0,
                between(random, -0.2, 0.2) + (fov.up - fov.down) / 2.0,
            ],
            radius: between(random, 0.1, 1.0) * Lens::of(&fov).radius,
        });
        let rig = rig_of(&camera(eye, direction, near, far), &hmd, lenses);
        let one_cone = Hierarchy::default().volumes(&rig, Culling::CONICAL_SUPERFRUSTUM, 0);
        if one_cone.is_ok() {
            return (rig, combined_deg);
        }
    }
}

/// What an eye sees, computed as a driver transforms points, and from the quotients for the tangents.
struct Watcher {
    clip_from_world: Mat4,
    eye_from_world: Mat4,
    lens: Lens,
}

impl Watcher {
    fn of(rig: &Rig) -> Vec<Self> {
        let watcher = |eye: &Eye| Self {
            clip_from_world: eye.clip_from_world(),
            eye_from_world: Mat4::from_cols_array_2d(&eye.view.world_to_eye),
            lens: eye.lens,
        };
        rig.eyes().iter().map(watcher).collect()
    }

    /// Whether a point is in the picture, and whether it is visible through the lens.
    fn sees(&self, point: Vec3) -> [bool; 2] {
        let c = self.clip_from_world * point.extend(1.0);
        if !(c.x.abs() <= c.w && c.y.abs() <= c.w && 0.0 <= c.z && c.z <= c.w) {
            return [false; 2];
        }
        let p = self.eye_from_world.transform_point3(point);
        [true, self.lens.contains([-p.x / p.z, -p.y / p.z])]
    }
}

struct Listed(Vec<bool>);

impl Listed {
    fn of(
        tree: &Hierarchy,
        rig: &Rig,
        culling: Culling,
        frame: u32,
        scratch: &mut Scratch,
    ) -> Self {
        let mut list = Vec::new();
        tree.cull(rig, culling, frame, scratch, &mut list).unwrap();
        assert!(list.is_sorted_by(|a, b| a < b));
        let mut listed = vec![false; tree.len()];
        for draw in list {
            listed[draw as usize] = true;
        }
        Self(listed)
    }
}

/// Number of points of each object, which the displays use in turn.
const POINTS: usize = 8;

/// Uses a random point of each of 100,000 objects with each of 1,000 displays. If an eye sees the point, the
/// object must be listed.
#[test]
fn lossless_techniques_keep_all_objects_with_a_visible_point() {
    let objects = objects(OBJECTS);
    let tree = Hierarchy::new(&objects);
    let mut random = Random(12);
    let points: Vec<[Vec3; POINTS]> = (objects.iter())
        .map(|bounds| [(); POINTS].map(|()| within(&mut random, *bounds)))
        .collect();
    let points = &points;
    let threads = std::thread::available_parallelism()
        .map_or(1, usize::from)
        .min(8);
    let check = |part: usize| {
        let (mut seen_points, mut widest) = ([0_u64; 2], 0.0_f32);
        let mut scratch = Scratch::default();
        for number in (part..HMDS).step_by(threads) {
            let mut random = Random(1000 + number as u64);
            let (rig, combined_deg) = random_rig(&mut random);
            widest = widest.max(combined_deg);
            let mut listed =
                |culling| Listed::of(&tree, &rig, culling, number as u32, &mut scratch).0;
            let watchers = Watcher::of(&rig);
            let whole = [Culling::PER_EYE, Culling::SUPERFRUSTUM].map(&mut listed);
            let lens = [Culling::CONICAL, Culling::CONICAL_SUPERFRUSTUM].map(&mut listed);
            for (object, points) in points.iter().enumerate() {
                let point = points[number % POINTS];
                let seen = watchers.iter().map(|eye| eye.sees(point));
                let [picture, through_lens] =
                    seen.fold([false; 2], |all, one| [all[0] | one[0], all[1] | one[1]]);
                for (seen, kept) in [(picture, &whole), (through_lens, &lens)] {
                    assert!(
                        !seen || kept.iter().all(|listed| listed[object]),
                        "display {number}, object {object}: {point}"
                    );
                }
                seen_points[0] += u64::from(picture);
                seen_points[1] += u64::from(through_lens);
            }
        }
        (seen_points, widest)
    };
    let found: Vec<_> = std::thread::scope(|scope| {
        let parts: Vec<_> = (0..threads)
            .map(|part| scope.spawn(move || check(part)))
            .collect();
        parts.into_iter().map(|part| part.join().unwrap()).collect()
    });
    let seen = |i: usize| found.iter().map(|(seen, _)| seen[i]).sum::<u64>();
    let widest = found.iter().map(|(_, widest)| *widest).fold(0.0, f32::max);
    eprintln!(
        "{} points in a picture, {} in a lens, up to {widest:.1} degrees",
        seen(0),
        seen(1)
    );
    assert!(seen(0) > 1_000_000 && seen(1) > 100_000 && widest > 168.0);
}

/// Tests points on the edges of the frusta and on the circles of the lenses, which are the most critical
/// ones.
#[test]
fn the_edges_of_the_visible_space_are_in_the_volumes_of_lossless_techniques() {
    let mut random = Random(77);
    // Volumes end at the bounds of the draws, which are therefore far beyond the points below.
    let tree = Hierarchy::new(&[ROOM.map(|corner| corner * 10.0)]);
    for number in 0..HMDS as u32 {
        let (rig, _) = random_rig(&mut random);
        let volumes = |culling| match tree.volumes(&rig, culling, number).unwrap() {
            Volumes::Any(volumes) => volumes,
            Volumes::Everything => unreachable!("the technique has volumes"),
        };
        let within = |culling, point: DVec3| volumes(culling).iter().any(|v| v.contains(point));
        for eye in rig.eyes() {
            let picture = Volume::new(eye.frustum(tree.extent()), None);
            let from_clip = eye.clip_from_world().as_dmat4().inverse();
            let [right, up, forward] = eye.axes().map(|axis| axis.gradient);
            for step in 0..8_u32 {
                let corner = |bit: u32| if step & bit == 0 { -1.0 } else { 1.0 };
                // At depth 0.1, the distance is ten times that of the near plane.
                let depth = if step & 4 == 0 { 1.0 } else { 0.1 };
                let point = from_clip.project_point3(DVec3::new(corner(1), corner(2), depth));
                assert!(within(Culling::PER_EYE, point), "{number}");
                assert!(within(Culling::SUPERFRUSTUM, point), "{number}");
                let (sin, cos) = (f64::from(step) * 0.785).sin_cos();
                let radius = f64::from(eye.lens.radius);
                let [x, y] = eye.lens.center.map(f64::from);
                let along = right * (x + radius * cos) + up * (y + radius * sin) + forward;
                let on_circle = eye.position() + along * 3.0;
                if picture.contains(on_circle) {
                    assert!(within(Culling::CONICAL, on_circle), "{number}");
                    assert!(within(Culling::CONICAL_SUPERFRUSTUM, on_circle), "{number}");
                }
            }
        }
    }
}

#[test]
fn one_volume_needs_about_half_the_tests_of_two() {
    let tree = Hierarchy::new(&objects(OBJECTS));
    let (mut scratch, mut list) = (Scratch::default(), Vec::new());
    for preset in hmd::PRESETS {
        let hmd = hmd::preset(preset).unwrap();
        let mut random = Random(21);
        let (mut totals, mut kept) = ([0; 3], [0; 3]);
        for _ in 0..20 {
            let direction = within(&mut random, [Vec3::NEG_ONE, Vec3::ONE]).with_y(0.1);
            let eye = within(&mut random, ROOM);
            let lenses = hmd.fov.map(|fov| Lens::of(&fov));
            let rig = rig_of(&camera(eye, direction, 0.1, 200.0), &hmd, lenses);
            let techniques = [
                Culling::PER_EYE,
                Culling::SUPERFRUSTUM,
                Culling::ROUND_ROBIN,
            ];
            for (number, technique) in techniques.into_iter().enumerate() {
                totals[number] += tree
                    .cull(&rig, technique, 0, &mut scratch, &mut list)
                    .unwrap();
                kept[number] += list.len();
            }
        }
        let [two, one, turn] = totals.map(|tests| tests as f64);
        eprintln!(
            "{preset}: superfrustum {:.4}, round robin {:.4} of {two} tests; {kept:?} draws kept",
            one / two,
            turn / two
        );
        // The superfrustum keeps few invisible draws.
        assert!(kept[1] >= kept[0] && kept[1] as f64 <= 1.02 * kept[0] as f64);
        assert!(one <= 0.55 * two, "{preset}: {one} of {two}");
        assert!(turn <= 0.51 * two, "{preset}: {turn} of {two}");
    }
}

#[test]
fn round_robin_finds_missed_draws_in_the_next_frame() {
    let objects = objects(20_000);
    let tree = Hierarchy::new(&objects);
    let mut random = Random(31);
    let mut missed = [0; 2];
    for _ in 0..20 {
        let (rig, _) = random_rig(&mut random);
        let (mut scratch, watchers) = (Scratch::default(), Watcher::of(&rig));
        for (lens, culling) in [(0, Culling::ROUND_ROBIN), (1, Culling::CONICAL_ROUND_ROBIN)] {
            let frames =
                [0, 1, 2].map(|frame| Listed::of(&tree, &rig, culling, frame, &mut scratch).0);
            for (object, bounds) in objects.iter().enumerate() {
                let point = within(&mut random, *bounds);
                if watchers.iter().any(|eye| eye.sees(point)[lens]) {
                    let listed = [0, 1, 2].map(|frame| frames[frame][object]);
                    assert!(
                        listed.windows(2).all(|pair| pair[0] || pair[1]),
                        "{listed:?}"
                    );
                    missed[lens] += listed.iter().filter(|listed| !**listed).count();
                }
            }
        }
    }
    assert!(
        missed[0] > 0 && missed[1] > 0,
        "eyes that see the same test nothing: {missed:?}"
    );
}

#[test]
fn no_culling_lists_everything_without_a_test() {
    let tree = Hierarchy::new(&objects(100));
    let (rig, _) = random_rig(&mut Random(1));
    let mut list = vec![7];
    let tests = tree.cull(&rig, Culling::NONE, 0, &mut Scratch::default(), &mut list);
    assert_eq!((tests, list), (Ok(0), (0..100).collect()));
}
