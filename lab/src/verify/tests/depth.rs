//! Near and far planes of any ratio, and reversed depth.

use super::*;
use crate::verify::faults::Faults;
use crate::verify::reference::render_tile;
use crate::verify::views::Views;

/// Random triangles through a camera with these planes.
fn room([near, far]: [f32; 2]) -> Scene {
    let material = textured(AlphaMode::Opaque, true);
    let mut scene = scene(vec![triangles(300, 5, 0)], vec![material], vec![checker()]);
    (scene.cameras[0].near, scene.cameras[0].far) = (near, far);
    scene
}

fn faults(scene: &Scene, views: FrameViews) -> Vec<String> {
    let mut faults = Faults::default();
    let (hmd, frames) = (display(SIZE_PX), [views]);
    assert_eq!(scene.cameras.len(), 1);
    Views {
        hmd: &hmd,
        frames: &frames,
    }
    .hold(&mut faults);
    faults.0
}

#[test]
fn captures_agree_whatever_the_ratio_of_far_to_near() {
    for planes in [
        [0.1, 50.0],
        [1e-3, 3e4],
        [1e-3, 1e6],
        [1e-4, 1e9],
        [1e-6, 20.0],
        [2e-2, 1e20],
    ] {
        let scene = room(planes);
        assert_eq!(
            faults(&scene, views(&scene, SIZE_PX)),
            [""; 0],
            "{planes:?}"
        );
        let captured = capture(&scene, SIZE_PX, 0, BUDGET);
        for pass in 0..2 {
            let agreement = agreement(&scene, &captured, pass, &passes);
            assert_eq!(
                agreement.of_class(Class::Unexplained),
                0,
                "{planes:?}: {agreement:?}"
            );
            assert!(agreement.both > 5_000, "{planes:?}: {agreement:?}");
            // Depths that single precision tells apart decide as in the reference.
            let ties = agreement.of_class(Class::DepthTie);
            assert!(
                planes[0] < 1e-3 || ties < agreement.both / 100,
                "{planes:?}: {agreement:?}"
            );
        }
    }
}

#[test]
fn reversed_depth_and_a_far_plane_at_infinity_give_the_same_fragments() {
    let scene = room([0.1, 1e4]);
    let draws = DrawList::new(&scene, 0).unwrap();
    let usual = views(&scene, SIZE_PX);
    // Depth 1 at 0.1 m, and 0 infinitely far or at 1e4 m.
    let [near, far] = [0.1_f32, 1e4];
    let part = near / (far - near);
    for depth in [[-1.0, -near], [0.0, near], [part, part * far]] {
        let mut changed = usual.clone();
        for eye in &mut changed.eyes {
            [eye.eye_to_clip[2][2], eye.eye_to_clip[3][2]] = depth;
        }
        assert_eq!(faults(&scene, changed.clone()), [""; 0], "{depth:?}");
        let fragments = |views: &FrameViews| -> BTreeSet<([u32; 2], u32)> {
            let geometry = Geometry::new(&scene, &draws, &views.eyes[0], SIZE_PX, |_| true);
            let tiles = 0..(geometry.tiles[0] * geometry.tiles[1]) as usize;
            let of_tile = |tile| render_tile(&geometry, tile, &passes, Fragments::DepthTested);
            let number = |f: &super::super::reference::Fragment| {
                (f.pixel, geometry.primitive(geometry.piece(f.piece)))
            };
            tiles.flat_map(of_tile).map(|f| number(&f)).collect()
        };
        let [expected, found] = [&usual, &changed].map(fragments);
        let others = expected.symmetric_difference(&found).count();
        assert!(
            others < expected.len() / 1000,
            "{depth:?}: {others} of {}",
            expected.len()
        );
    }
}

#[test]
fn planes_behind_the_eye_or_unlike_between_the_eyes_are_faults() {
    let scene = room([0.1, 50.0]);
    let usual = views(&scene, SIZE_PX);
    for depth in [[-1.0, 0.1], [-0.5, -0.1], [0.2, -0.1], [-2.0, 0.0]] {
        let mut changed = usual.clone();
        for eye in &mut changed.eyes {
            [eye.eye_to_clip[2][2], eye.eye_to_clip[3][2]] = depth;
        }
        let found = faults(&scene, changed);
        assert!(
            found.iter().any(|f| f.contains("ahead of the eye")),
            "{depth:?}: {found:?}"
        );
    }
    let mut changed = usual;
    changed.eyes[1].eye_to_clip[3][2] *= 1.5;
    let found = faults(&scene, changed);
    assert!(found[0].contains("near and far plane"), "{found:?}");
}
