//! Shading reuse: what is reused, where, and that everything else stays exact.

use super::far_field::{RenderedFrame, corridor, draw};
use super::*;
use glam::{DMat4, DVec2, DVec3, Mat4};
use techniques::shading_reuse::ShadingReuse;

fn reuse(contrast: f32) -> Planner {
    let settings = Settings {
        shading_reuse: Some(ShadingReuse { contrast }),
        ..Settings::default()
    };
    planner(&settings, SIZE_PX, BOTH)
}

/// The corridor with light, so that its pictures have colours.
fn lit() -> Scene {
    let mut scene = corridor();
    scene.sky = Vec3::ONE;
    scene
}

#[test]
fn reuse_is_captured_as_it_is_drawn_and_shades_less() {
    let scene = lit();
    let planner = reuse(1.0);
    let captured = capture_as(&planner, &scene, 0, BUDGET, true).unwrap();
    assert!(captured.pictures_match);
    let stereo = capture(&scene, SIZE_PX, 0, BUDGET);
    let fragments = [&captured, &stereo].map(|c| c.counts.fragments);
    assert!(fragments[0] < fragments[1] * 70 / 100, "{fragments:?}");
    // The left eye's picture is layer 2, because a draw is blended.
    assert!(captured.pictures[0] == stereo.pictures[0]);
    // Without a plain picture before, and in regions.
    let alone = capture_as(&planner, &scene, 0, BUDGET, false).unwrap();
    assert_eq!(alone.trace, captured.trace);
    let small = capture_as(&planner, &scene, 0, 1 << 17, true).unwrap();
    assert!(small.pictures_match && small.work.regions > captured.work.regions);
    assert_eq!(small.trace, captured.trace);
}

/// Colour and depth of the left picture around a place, linear between four pixels; `None` at edges of surfaces.
fn left_at(left: &RenderedFrame, at: DVec2, distance: impl Fn(f64) -> f64) -> Option<(DVec3, f64)> {
    let low = (at - 0.5).floor();
    let [width, height] = SIZE_PX.map(i64::from);
    let (mut color, mut depth, mut distances) = (DVec3::ZERO, 0.0, Vec::new());
    for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
        let weight = |d: i64, t: f64| if d == 1 { t } else { 1.0 - t };
        let t = at - 0.5 - low;
        let weight = weight(dx, t.x) * weight(dy, t.y);
        if weight < 1.0 / 256.0 {
            continue;
        }
        let [x, y] = [low.x as i64 + dx, low.y as i64 + dy];
        if x < 0 || y < 0 || x >= width || y >= height {
            return None;
        }
        let pixel = (y * width + x) as usize;
        let texel = &left.pictures[0][4 * pixel..][..3];
        let linear = |code: u8| {
            f64::from(image_error::color::linear_from_srgb(
                f32::from(code) / 255.0,
            ))
        };
        color += weight * DVec3::new(linear(texel[0]), linear(texel[1]), linear(texel[2]));
        let of_texel = f64::from(left.depths[0][pixel]);
        depth += weight * of_texel;
        distances.push(distance(of_texel));
    }
    let (near, far) = distances
        .iter()
        .fold((f64::INFINITY, 0.0_f64), |(near, far), d| {
            (near.min(*d), far.max(*d))
        });
    (far.is_finite() && far < near * 1.02).then_some((color, distance(depth)))
}

/// Each right pixel's true surface, projected into the left picture in double precision, says whether the left eye shows
/// it and in which colour.
#[test]
fn what_is_reused_is_what_the_left_eye_shows_and_all_else_is_exact() {
    let scene = without_blended(lit());
    let draws = DrawList::new(&scene, 0).unwrap();
    let mut backend = driver(&scene, &draws, SIZE_PX);
    let views = views(&scene, SIZE_PX);
    let exact = draw(
        &mut backend,
        &scene,
        &draws,
        &baseline(SIZE_PX, BOTH),
        &views,
    );
    let made = draw(&mut backend, &scene, &draws, &reuse(1.0), &views);
    assert!(made.pictures[0] == exact.pictures[0]);
    let clip = |eye: usize| -> DMat4 {
        let view = &views.eyes[eye];
        let [projection, pose] = [view.eye_to_clip, view.world_to_eye];
        Mat4::from_cols_array_2d(&projection).as_dmat4()
            * Mat4::from_cols_array_2d(&pose).as_dmat4()
    };
    let left_from_right = clip(0) * clip(1).inverse();
    let [a, b] = [2, 3].map(|column: usize| f64::from(views.eyes[0].eye_to_clip[column][2]));
    let distance = |depth: f64| b / (depth + a);
    let size = DVec2::new(SIZE_PX[0].into(), SIZE_PX[1].into());
    let (mut reused, mut expected, mut wrong, mut off) = (0, 0, 0, 0);
    for pixel in 0..(SIZE_PX[0] * SIZE_PX[1]) as usize {
        let [found, truth] = [&made, &exact].map(|frame| f64::from(frame.depths[1][pixel]));
        let [color, drawn] = [&made, &exact].map(|frame| &frame.pictures[1][4 * pixel..][..3]);
        let is_reused = found != truth;
        if !is_reused {
            assert_eq!(color, drawn, "pixel {pixel}");
        }
        reused += usize::from(is_reused);
        let px = DVec2::new(
            (pixel as u32 % SIZE_PX[0]).into(),
            (pixel as u32 / SIZE_PX[0]).into(),
        ) + 0.5;
        let ndc = px / size * DVec2::new(2.0, -2.0) + DVec2::new(-1.0, 1.0);
        let seen = left_from_right.project_point3(ndc.extend(truth));
        let at = (seen.truncate() * DVec2::new(0.5, -0.5) + 0.5) * size;
        let shown = left_at(&exact, at, distance)
            .filter(|(_, shown)| truth > 0.0 && (shown / distance(seen.z) - 1.0).abs() < 1e-3);
        expected += usize::from(shown.is_some());
        match (is_reused, shown) {
            (true, Some((linear, _))) => {
                let code = |light: f64| image_error::color::srgb8_from_linear(light as f32);
                let expected = [linear.x, linear.y, linear.z].map(code);
                off += usize::from((0..3).any(|c| color[c].abs_diff(expected[c]) > 6));
                // One hundredth nearer than the surface.
                let nearer = distance(found) / distance(truth);
                assert!((nearer - 0.99).abs() < 2e-3, "pixel {pixel}: {nearer}");
            }
            (true, None) => wrong += 1,
            _ => {}
        }
    }
    // Pixels at the edge of a criterion may fall on either side of it.
    assert!(
        reused * 100 > expected * 97 && expected > 15_000,
        "{reused} of {expected}"
    );
    assert!(
        wrong * 200 < reused && off * 200 < reused,
        "{wrong} and {off} of {reused}"
    );
}

fn without_blended(mut scene: Scene) -> Scene {
    let blended = |material: usize| scene.materials[material].alpha == scene::AlphaMode::Blend;
    let keep: Vec<bool> = scene
        .meshes
        .iter()
        .map(|mesh| !blended(mesh.material))
        .collect();
    scene.instances.retain(|instance| keep[instance.mesh]);
    scene
}

#[test]
fn pixels_of_much_contrast_are_shaded() {
    let scene = lit();
    let fragments = |contrast| {
        let captured = capture_as(&reuse(contrast), &scene, 0, BUDGET, false).unwrap();
        captured.counts.fragments
    };
    let (none, some, all) = (fragments(0.0), fragments(0.02), fragments(1.0));
    assert!(all < some && some < none, "{all} {some} {none}");
}
