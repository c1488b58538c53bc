//! Pictures with a far field: no holes, exact near pixels, and shifts as predicted.

use super::*;
use glam::{DMat4, DVec2, Mat4};
use scene::paths::{HeadPath, Moments};
use scene::{LoadOptions, load_file};
use techniques::far_field::Stereo;
use techniques::settings::{FarField, Split, Variant};
use techniques::{Start, start::Composition};

const VARIANTS: [Variant; 3] = [Variant::Plain, Variant::DepthShift, Variant::AlternateEye];

fn far(split: Split, variant: Variant) -> Settings {
    Settings {
        far_field: Some(FarField { split, variant }),
        ..Settings::default()
    }
}

/// A corridor around the camera, closed at its end, with opaque, masked and blended objects.
pub(super) fn corridor() -> Scene {
    let quad = |corners: [[f32; 3]; 4], material| {
        let positions: Vec<Vec3> = corners.map(Vec3::from_array).into();
        let normal = (positions[1] - positions[0])
            .cross(positions[2] - positions[0])
            .normalize();
        Mesh {
            normals: vec![normal; 4],
            tangents: vec![Vec4::new(1.0, 0.0, 0.0, 1.0); 4],
            uv0: [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]]
                .map(Vec2::from_array)
                .into(),
            uv1: Vec::new(),
            colors: Vec::new(),
            indices: vec![0, 1, 2, 0, 2, 3],
            name: String::new(),
            material,
            positions,
        }
    };
    let (near, end) = (3.0, -30.0);
    let wall = |x: f32| {
        quad(
            [
                [x, -2.0, near],
                [x, -2.0, end],
                [x, 2.0, end],
                [x, 2.0, near],
            ],
            0,
        )
    };
    let level = |y: f32| {
        quad(
            [
                [-1.5, y, near],
                [1.5, y, near],
                [1.5, y, end],
                [-1.5, y, end],
            ],
            0,
        )
    };
    let across = |x: f32, z: f32, material| {
        quad(
            [
                [x, -1.0, z],
                [x + 1.2, -1.0, z],
                [x + 1.2, 1.0, z],
                [x, 1.0, z],
            ],
            material,
        )
    };
    let closed = quad(
        [
            [-1.5, -2.0, end],
            [1.5, -2.0, end],
            [1.5, 2.0, end],
            [-1.5, 2.0, end],
        ],
        0,
    );
    let meshes = vec![
        wall(-1.5),
        wall(1.5),
        level(-2.0),
        level(2.0),
        closed,
        across(-1.0, -2.0, 0),
        across(0.2, -6.0, 1),
        across(-0.6, -4.0, 2),
    ];
    let modes = [AlphaMode::Opaque, AlphaMode::Mask(0.5), AlphaMode::Blend];
    let materials = modes.map(|mode| textured(mode, true)).into();
    scene(meshes, materials, vec![checker()])
}

/// A rendered frame.
pub(super) struct RenderedFrame {
    pub(super) pictures: Vec<Vec<u8>>,
    /// Depths of each layer.
    pub(super) depths: Vec<Vec<f32>>,
    plan: techniques::FramePlan,
}

pub(super) fn draw(
    backend: &mut Lavapipe,
    scene: &Scene,
    draws: &DrawList,
    planner: &Planner,
    views: &FrameViews,
) -> RenderedFrame {
    let job = job(scene, draws, planner);
    let frame = job.frame(views).unwrap();
    job.light(backend, &frame).unwrap();
    let (pictures, _) = job.plain_frame(backend, &frame).unwrap();
    let layers = 0..frame.plan.layers.len();
    RenderedFrame {
        pictures,
        depths: layers.map(|layer| backend.depths(layer).unwrap()).collect(),
        plan: frame.plan,
    }
}

fn composition(frame: &RenderedFrame, eye: usize) -> &Composition {
    match &frame.plan.layers[3 + eye].start {
        Start::Composed(composition) => composition,
        other => panic!("layer {} starts with {other:?}", 3 + eye),
    }
}

#[test]
fn a_corridor_has_no_hole_at_the_split_and_is_exact_before_it() {
    let scene = corridor();
    let draws = DrawList::new(&scene, 2).unwrap();
    let mut backend = driver(&scene, &draws, SIZE_PX);
    let mut views = views(&scene, SIZE_PX);
    let without = baseline(SIZE_PX, BOTH);
    let whole = draw(&mut backend, &scene, &draws, &without, &views);
    let splits = [
        Split::Metres(2.2),
        Split::Metres(3.0),
        Split::Metres(9.0),
        Split::Pixels(1.0),
    ];
    for (number, split) in (0..).zip(splits) {
        for variant in VARIANTS {
            views.frame = number;
            let planner = planner(&far(split, variant), SIZE_PX, BOTH);
            let frame = draw(&mut backend, &scene, &draws, &planner, &views);
            let variant_name = format!("{split:?} {variant:?}");
            assert_eq!(frame.plan.layers.len(), 5, "{variant_name}");
            let (mut near, mut beyond) = (0, 0);
            for eye in 0..2 {
                let end = composition(&frame, eye).end;
                for (pixel, depth) in frame.depths[3 + eye].iter().enumerate() {
                    // The corridor is closed, so the sky is only visible through holes.
                    assert!(
                        *depth > 0.0,
                        "{variant_name}: a hole in pixel {pixel} of eye {eye}"
                    );
                    let is_near = frame.depths[eye][pixel] > end;
                    near += u32::from(is_near);
                    beyond += u32::from(!is_near);
                    // A blended draw may cover either.
                    let at = 4 * pixel..4 * pixel + 4;
                    let same = frame.pictures[eye][at.clone()] == whole.pictures[eye][at];
                    assert!(
                        same || !is_near,
                        "{variant_name}: pixel {pixel} of eye {eye} is near and differs"
                    );
                }
            }
            assert!(
                near > 1000 && beyond > 100,
                "{variant_name}: {near} near, {beyond} beyond"
            );
        }
    }
}

#[test]
fn eyes_in_one_place_see_through_a_far_field_what_they_see_without() {
    let scene = corridor();
    let draws = DrawList::new(&scene, 0).unwrap();
    let mut backend = driver(&scene, &draws, SIZE_PX);
    let mut views = views(&scene, SIZE_PX);
    views.eyes[1] = views.eyes[0];
    let without = baseline(SIZE_PX, BOTH);
    let whole = draw(&mut backend, &scene, &draws, &without, &views);
    for variant in VARIANTS {
        let planner = planner(&far(Split::Metres(3.0), variant), SIZE_PX, BOTH);
        let frame = draw(&mut backend, &scene, &draws, &planner, &views);
        for eye in 0..2 {
            let pairs = frame.pictures[eye]
                .chunks_exact(4)
                .zip(whole.pictures[eye].chunks_exact(4));
            // Another projection rounds differently, so edges of triangles and of texels may move slightly.
            let off = pairs
                .filter(|(a, b)| (0..3).any(|c| a[c].abs_diff(b[c]) > 8))
                .count();
            let all = (SIZE_PX[0] * SIZE_PX[1]) as usize;
            assert!(off < all / 100, "{variant:?}: {off} of {all} pixels differ");
        }
    }
}

#[test]
fn a_far_field_is_captured_as_it_is_drawn_and_records_far_pixels_once() {
    let scene = corridor();
    let settings = far(Split::Metres(3.0), Variant::Plain);
    let planner = planner(&settings, SIZE_PX, BOTH);
    let captured = capture_as(&planner, &scene, 0, BUDGET, true).unwrap();
    assert!(captured.pictures_match);
    let eyes: Vec<_> = captured.tables.passes.iter().map(|pass| pass.eye).collect();
    assert_eq!(
        eyes,
        [
            Some(Eye::Left),
            Some(Eye::Right),
            None,
            Some(Eye::Left),
            Some(Eye::Right)
        ]
    );
    let stereo = capture(&scene, SIZE_PX, 0, BUDGET);
    let fragments = [&captured, &stereo].map(|c| c.counts.fragments);
    assert!(fragments[0] < fragments[1] * 95 / 100, "{fragments:?}");
    // In regions as well.
    let small = capture_as(&planner, &scene, 0, 1 << 17, true).unwrap();
    assert!(small.pictures_match && small.work.regions > captured.work.regions);
    assert_eq!(small.trace, captured.trace);
}

/// Distances between drawn and true positions of far points, in pixels of the eyes, ascending.
fn shifts(frame: &RenderedFrame, views: &FrameViews, size_px: [u32; 2]) -> Vec<f32> {
    let clip = |view: &formats::view::EyeView| -> DMat4 {
        let [projection, pose] = [view.eye_to_clip, view.world_to_eye];
        Mat4::from_cols_array_2d(&projection).as_dmat4()
            * Mat4::from_cols_array_2d(&pose).as_dmat4()
    };
    let layer = &frame.plan.layers[2];
    let [width, height] = layer.size_px;
    let far_size = DVec2::new(width.into(), height.into());
    let world_from_far = clip(&layer.view).inverse();
    let eye_size = DVec2::new(size_px[0].into(), size_px[1].into());
    let mut shifts = Vec::new();
    for eye in 0..2 {
        let composition = composition(frame, eye);
        let eye_from_world = clip(&views.eyes[eye]);
        for (pixel, depth) in (0..).zip(&frame.depths[eye]) {
            if *depth > composition.end {
                continue;
            }
            let px = DVec2::new((pixel % size_px[0]).into(), (pixel / size_px[0]).into()) + 0.5;
            let place = composition.farther_from_px.as_dmat3() * px.extend(1.0);
            let place = place.truncate() / place.z;
            let [x, y] = [place.x as usize, place.y as usize];
            let depth = frame.depths[2][y * width as usize + x];
            if depth <= 0.0 {
                continue;
            }
            let ndc = place / far_size * DVec2::new(2.0, -2.0) + DVec2::new(-1.0, 1.0);
            let point = world_from_far.project_point3(ndc.extend(depth.into()));
            let seen = eye_from_world.project_point3(point).truncate();
            let true_px = (seen * DVec2::new(0.5, -0.5) + 0.5) * eye_size;
            shifts.push(true_px.distance(px) as f32);
        }
    }
    shifts.sort_by(f32::total_cmp);
    shifts
}

/// Shifts over frames of the walk through a real scene: the median, the 99th percentile and the largest.
fn check_real_scene(file: &str, camera: &str, size_px: [u32; 2], frames: &[u32]) {
    let Some(path) = real_scene(file) else {
        return;
    };
    let scene = load_file(&path, &LoadOptions::ALL).unwrap().scene;
    let camera = cameras::find(&scene, Some(camera)).unwrap();
    let last = frames.iter().max().map_or(0, |last| last + 1);
    let heads = HeadPath::Head.poses(camera, &Moments::first(last)).unwrap();
    let draws = DrawList::new(&scene, 0).unwrap();
    // Only depth matters here, so no texels are prepared.
    let set = TextureSet::prepare(&scene, |_| None, None).unwrap();
    let mut backend = Lavapipe::new(
        device::open(None).unwrap(),
        &scene,
        &draws,
        &set,
        size_px,
        BUDGET,
    )
    .unwrap();
    let mut measured = 0;
    for variant in VARIANTS {
        let planner = planner(&far(Split::Pixels(1.0), variant), size_px, BOTH);
        for &frame in frames {
            let head = &heads[frame as usize..][..1];
            let views = cameras::frame_views(camera, planner.hmd(), frame, head).remove(0);
            let drawn = draw(&mut backend, &scene, &draws, &planner, &views);
            let shifts = shifts(&drawn, &views, size_px);
            if shifts.is_empty() {
                println!("{file} {variant:?} frame {frame}: nothing lies beyond the split");
                continue;
            }
            measured += 1;
            let at = |share: f64| shifts[(share * (shifts.len() - 1) as f64) as usize];
            let predicted = Stereo::new(&views.eyes, size_px, variant, frame)
                .worst_shift_px(drawn.plan.predicted.split_m.unwrap());
            println!(
                "{file} {variant:?} frame {frame}: split {:.2} m, predicted {predicted:.3} px; measured {:.3} median, {:.3} at 99 %, {:.3} at most, over {} far pixels",
                drawn.plan.predicted.split_m.unwrap(),
                at(0.5),
                at(0.99),
                at(1.0),
                shifts.len()
            );
            assert!(at(0.99) < 1.1, "{file} {variant:?}: {} px", at(0.99));
        }
    }
    assert!(measured > 0, "{file}: nothing far was seen");
}

const SPONZA: (&str, &str) = ("crytek-sponza/sponza.gltf", "cam_atrium_eye");
const FOREST: (&str, &str) = ("stk-black-forest/stk-black-forest.gltf", "cam_brook");

#[test]
fn a_split_for_one_pixel_moves_99_percent_of_sponza_by_less_than_1_1() {
    check_real_scene(SPONZA.0, SPONZA.1, [240, 270], &[0, 31]);
}

#[test]
#[ignore = "figures at the display's size; prints them"]
fn shifts_of_sponza_and_the_forest_at_full_size() {
    for (file, camera) in [SPONZA, FOREST] {
        check_real_scene(file, camera, [960, 1080], &[0, 31, 62, 93]);
    }
}
