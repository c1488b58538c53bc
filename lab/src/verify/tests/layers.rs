//! Frames of several layers: masks, rings, viewports, left-out quads, and their composed pictures.

use super::*;
use formats::view::TILE_SIZE_PX;
use scene::TextureSlot;
use techniques::distance::DistanceCull;
use techniques::gaze::Gaze;
use techniques::hidden_mesh::HiddenMesh;
use techniques::settings::{Foveation, FoveationKind, Rates};

const KINDS: [FoveationKind; 3] = [
    FoveationKind::Rings,
    FoveationKind::MultiResolution,
    FoveationKind::RadialDensity,
];

fn foveated(kind: FoveationKind, edges_deg: [f32; 4]) -> Settings {
    Settings {
        foveation: Some(Foveation {
            kind,
            gaze: Gaze::default(),
            rates: Rates { edges_deg },
        }),
        ..Settings::default()
    }
}

fn masked() -> Settings {
    Settings {
        hidden_area_mask: true,
        ..Settings::default()
    }
}

fn capture_with(settings: &Settings, scene: &Scene, size_px: [u32; 2]) -> Captured {
    let planner = planner(settings, size_px, BOTH);
    let captured = capture_as(&planner, scene, 0, BUDGET, true).unwrap_or_else(|e| panic!("{e}"));
    assert!(captured.pictures_match);
    captured
}

/// Draws of every kind all over the picture, emitting the checker's pattern.
fn glowing_crowd() -> Scene {
    let meshes = (0..3).map(|m| triangles(120, 91 + m as u32, m)).collect();
    let modes = [AlphaMode::Opaque, AlphaMode::Mask(0.5), AlphaMode::Blend];
    let glowing = |mode| {
        let mut material = textured(mode, true);
        material.emissive = Vec3::new(0.5, 0.4, 0.3);
        material.textures[TextureSlot::Emissive] = material.textures[TextureSlot::BaseColor];
        material
    };
    let materials = modes.map(glowing).into();
    scene(meshes, materials, vec![checker()])
}

/// A wall across the whole view at 5 m, with one material left of `x` and another one right of it.
fn wall(x: f32, materials: [Material; 2]) -> Scene {
    let half = |left: f32, right: f32, material| Mesh {
        positions: [[left, -20.0], [right, -20.0], [right, 20.0], [left, 20.0]]
            .map(|[x, y]| Vec3::new(x, y, -5.0))
            .into(),
        normals: vec![Vec3::Z; 4],
        indices: vec![0, 1, 2, 0, 2, 3],
        material,
        ..Mesh::default()
    };
    let meshes = vec![half(-20.0, x, 0), half(x, 20.0, 1)];
    scene(meshes, materials.into(), Vec::new())
}

fn glowing(light: f32) -> Material {
    Material {
        base_color: Vec4::new(0.0, 0.0, 0.0, 1.0),
        emissive: Vec3::splat(light),
        roughness: 1.0,
        ..Material::default()
    }
}

fn pixel(picture: &[u8], [x, y]: [u32; 2]) -> [u8; 4] {
    let at = 4 * (y * SIZE_PX[0] + x) as usize;
    std::array::from_fn(|channel| picture[at + channel])
}

fn pixels() -> impl Iterator<Item = [u32; 2]> {
    (0..SIZE_PX[1]).flat_map(|y| (0..SIZE_PX[0]).map(move |x| [x, y]))
}

#[test]
fn a_masked_picture_has_every_pixel_of_the_lens_and_no_tile_outside_it() {
    let scene = glowing_crowd();
    let (whole, masked) = (
        capture(&scene, SIZE_PX, 0, BUDGET),
        capture_with(&masked(), &scene, SIZE_PX),
    );
    let fov = display(SIZE_PX).fov[0];
    let lens = Lens::of(&fov);
    let shown = |at: [u32; 2]| lens.pixel_visible(&fov, SIZE_PX, at);
    let columns = SIZE_PX[0].div_ceil(TILE_SIZE_PX);
    for eye in 0..2 {
        let mut outside = 0;
        let seen = |at: &[u32; 2]| shown(*at) && pixel(&whole.pictures[eye], *at)[0] > 40;
        let bright = pixels().filter(seen).count();
        assert!(
            bright > 2000,
            "the pictures must have something to lose: {bright}"
        );
        for at in pixels() {
            let [a, b] = [&whole, &masked].map(|c| pixel(&c.pictures[eye], at));
            assert!(a == b || !shown(at), "{at:?}: {a:?} {b:?}");
            outside += u32::from(b == [0, 0, 0, 255]);
        }
        assert!(outside > 1000, "{outside}");
        let (mut empty, mut same) = (0, 0);
        for (tile, (a, b)) in (0..).zip(whole.tiles[eye].iter().zip(&masked.tiles[eye])) {
            let corner = [tile % columns, tile / columns].map(|t| t * TILE_SIZE_PX);
            let inside = |[x, y]: &[u32; 2]| *x < SIZE_PX[0] && *y < SIZE_PX[1];
            let of_tile =
                (0..16).flat_map(|y| (0..16).map(move |x| [corner[0] + x, corner[1] + y]));
            // The margin is one pixel, because the mask keeps pixels with a visible corner.
            let around = (0..18).flat_map(|y| {
                (0..18).map(move |x| [(corner[0] + x).max(1) - 1, (corner[1] + y).max(1) - 1])
            });
            if of_tile.filter(inside).all(shown) {
                assert_eq!(a, b, "tile {tile}");
                same += 1;
            } else if !around.filter(inside).any(shown) {
                assert!(b.records.is_empty(), "tile {tile}");
                empty += u32::from(!a.records.is_empty());
            }
        }
        assert!(empty > 0 && same > 20, "{empty} {same}");
    }
    let share = masked.predicted.shaded_share.unwrap();
    println!(
        "{} of {} fragments, {} of {} quads; {share} of the pixels",
        masked.counts.fragments, whole.counts.fragments, masked.counts.quads, whole.counts.quads
    );
    assert!(masked.counts.fragments < whole.counts.fragments);
}

#[test]
fn a_surface_over_the_whole_view_has_a_fragment_for_each_pixel_that_may_be_shaded() {
    let scene = wall(0.3, [glowing(0.2), glowing(0.5)]);
    let pictures_px = 2.0 * (SIZE_PX[0] * SIZE_PX[1]) as f32;
    let halves = [
        [[0.0, 0.0], [0.5, 0.0], [0.5, 1.0]],
        [[0.0, 0.0], [0.5, 1.0], [0.0, 1.0]],
    ];
    let half_hidden = Settings {
        hidden_area_mesh: Some(HiddenMesh {
            left: halves.into(),
            right: Vec::new(),
        }),
        ..Settings::default()
    };
    let mut all = vec![masked(), half_hidden];
    for kind in KINDS.into_iter().chain([FoveationKind::LensMatched]) {
        all.push(foveated(kind, [10.0, 20.0, 30.0, 40.0]));
        all.push(Settings {
            hidden_area_mask: true,
            ..foveated(kind, [10.0, 20.0, 30.0, 40.0])
        });
    }
    for settings in all {
        let captured = capture_with(&settings, &scene, SIZE_PX);
        let predicted = captured.predicted.shaded_share.unwrap() * pictures_px;
        assert_eq!(
            captured.counts.fragments,
            predicted.round() as u64,
            "{settings:?}"
        );
        assert!(captured.counts.fragments < pictures_px as u64);
    }
}

#[test]
fn tiles_at_full_rate_have_the_baselines_pixels() {
    let scene = glowing_crowd();
    let whole = capture(&scene, SIZE_PX, 0, BUDGET);
    for kind in KINDS {
        let foveated = capture_with(&foveated(kind, [20.0, 30.0, 40.0, 45.0]), &scene, SIZE_PX);
        // The tiles in the middle, 5 degrees to each side.
        let middle = |[x, y]: [u32; 2]| x.abs_diff(100) <= 8 && y.abs_diff(68) <= 4;
        for (a, b) in whole.pictures.iter().zip(&foveated.pictures) {
            for at in pixels().filter(|at| middle(*at)) {
                assert_eq!(pixel(a, at), pixel(b, at), "{kind:?} {at:?}");
            }
            let changed = pixels().filter(|at| pixel(a, *at) != pixel(b, *at)).count();
            assert!(changed > 2000, "{kind:?}: {changed}");
        }
        assert!(foveated.counts.fragments < whole.counts.fragments);
    }
}

/// Linear light of an sRGB value (IEC 61966-2-1).
fn linear(value: u8) -> f64 {
    let v = f64::from(value) / 255.0;
    if v <= 0.04045 {
        v / 12.92
    } else {
        ((v + 0.055) / 1.055).powf(2.4)
    }
}

#[test]
fn an_edge_between_coarse_pixels_is_interpolated_in_linear_light_and_in_its_place() {
    let scene = wall(0.3, [glowing(0.9), glowing(0.0)]);
    let whole = capture(&scene, SIZE_PX, 0, BUDGET);
    // Everything at 1/16: pixels of 4x4.
    let coarse = capture_with(&foveated(FoveationKind::Rings, [0.0; 4]), &scene, SIZE_PX);
    for eye in 0..2 {
        let row = |captured: &Captured| -> Vec<u8> {
            (0..SIZE_PX[0])
                .map(|x| pixel(&captured.pictures[eye], [x, 70])[1])
                .collect()
        };
        let (sharp, smooth) = (row(&whole), row(&coarse));
        let bright = |row: &[u8]| row.iter().take_while(|v| linear(**v) > 0.3).count();
        let edge = bright(&sharp);
        // Coarse pixels whose centre is bright.
        let first_dark = (edge + 1) / 4 * 4;
        let (light, dark) = (linear(smooth[edge - 12]), linear(smooth[edge + 12]));
        assert!(light > 0.5 && dark < 0.05, "{light} {dark}");
        for (x, weight) in (first_dark - 2..).zip([0.125, 0.375, 0.625, 0.875]) {
            let expected = light + weight * (dark - light);
            let found = linear(smooth[x]);
            assert!(
                (found - expected).abs() < 0.01,
                "eye {eye}, {x}: {found} {expected}"
            );
        }
        for (x, value) in smooth.iter().enumerate() {
            let far = x + 2 < first_dark || x >= first_dark + 2;
            assert!(
                !far || value.abs_diff(sharp[x]) <= 2,
                "eye {eye}, {x}: {value}"
            );
        }
    }
}

#[test]
fn left_out_quads_are_filled_so_that_a_slope_stays_a_slope() {
    // Lit only by the distance to the eye, so the light is smooth everywhere.
    let scene = wall(0.3, [Material::default(), Material::default()]);
    let whole = capture(&scene, SIZE_PX, 0, BUDGET);
    for kind in KINDS {
        let foveated = capture_with(&foveated(kind, [0.0; 4]), &scene, SIZE_PX);
        for (a, b) in whole.pictures.iter().zip(&foveated.pictures) {
            let values: Vec<u8> = a.clone();
            let (least, most) = (values.iter().min(), values.iter().max());
            for (x, y) in a.iter().zip(b) {
                assert!(
                    x.abs_diff(*y) <= 2,
                    "{kind:?}: {x} {y} ({least:?} to {most:?})"
                );
            }
        }
    }
}

#[test]
fn layers_captured_in_parts_give_the_same_trace() {
    let scene = glowing_crowd();
    for settings in [
        masked(),
        foveated(FoveationKind::Rings, [10.0, 20.0, 30.0, 40.0]),
    ] {
        let planner = planner(&settings, SIZE_PX, BOTH);
        let whole = capture_as(&planner, &scene, 0, BUDGET, false).unwrap();
        let parts = capture_as(&planner, &scene, 0, 44 * 900, false).unwrap();
        let regions = [&whole, &parts].map(|captured| captured.work.regions);
        assert!(regions[0] < regions[1], "{regions:?}");
        assert!(parts.trace == whole.trace);
        assert!(parts.pictures == whole.pictures);
    }
}

#[test]
fn a_lens_matched_picture_is_the_baselines_but_for_its_resolution() {
    // Light that changes slowly, so that interpolation from a coarser grid is nearly exact.
    let scene = wall(20.0, [glowing(0.4), glowing(0.4)]);
    let whole = capture(&scene, SIZE_PX, 0, BUDGET);
    let matched = capture_with(
        &foveated(FoveationKind::LensMatched, [15.0, 25.0, 35.0, 45.0]),
        &scene,
        SIZE_PX,
    );
    for (a, b) in whole.pictures.iter().zip(&matched.pictures) {
        for at in pixels() {
            let (a, b) = (pixel(a, at), pixel(b, at));
            assert!(
                a.iter().zip(b).all(|(a, b)| a.abs_diff(b) <= 1),
                "{at:?}: {a:?} {b:?}"
            );
        }
    }
    // The edge stays at its place within one coarse pixel.
    let edge = wall(0.3, [glowing(0.9), glowing(0.0)]);
    let (whole, matched) = (
        capture(&edge, SIZE_PX, 0, BUDGET),
        capture_with(
            &foveated(FoveationKind::LensMatched, [15.0, 25.0, 35.0, 45.0]),
            &edge,
            SIZE_PX,
        ),
    );
    for (a, b) in whole.pictures.iter().zip(&matched.pictures) {
        for y in 0..SIZE_PX[1] {
            let edge = |picture: &[u8]| (0..SIZE_PX[0]).find(|x| pixel(picture, [*x, y])[0] < 128);
            let (a, b) = (edge(a).unwrap(), edge(b).unwrap());
            assert!(a.abs_diff(b) <= 2, "row {y}: {a} {b}");
        }
    }
}

#[test]
fn what_is_beyond_the_cull_distance_is_not_there() {
    let near = wall(0.3, [glowing(0.9), glowing(0.2)]);
    let mut both = near.clone();
    both.meshes[0]
        .positions
        .iter_mut()
        .for_each(|at| at.z = -20.0);
    let mut only = both.clone();
    // Only the nearer half.
    only.instances.remove(0);
    let culled = |limit| Settings {
        distance_cull: Some(limit),
        ..Settings::default()
    };
    let all = capture(&both, SIZE_PX, 0, BUDGET);
    let expected = capture(&only, SIZE_PX, 0, BUDGET);
    let far = capture_with(&culled(DistanceCull::Metres(10.0)), &both, SIZE_PX);
    assert_eq!(far.pictures, expected.pictures);
    assert_eq!(far.counts.fragments, expected.counts.fragments);
    assert!(far.counts.fragments < all.counts.fragments);
    // Both halves are larger than a pixel, and neither is larger than the scene.
    let kept = capture_with(&culled(DistanceCull::Pixels(1.0)), &both, SIZE_PX);
    assert_eq!(kept.pictures, all.pictures);
}
