//! Positions, sizes, forms and numbers of triangles.

use super::super::shapes::Shape;
use super::super::{Against, Case};
use super::{BEFORE_SQUARE, Cases};
use serde_json::json;

/// The first point of a group is compared with the reference, the others with the first.
fn against(is_first: bool) -> Against {
    match is_first {
        true => Against::ReferenceAsFirst,
        false => Against::First,
    }
}

pub(super) fn translation(_: bool) -> Cases {
    let places = [0.0, 1e3, 1e4, 1e5, 1e6, 1e7];
    let places = [true, false].map(|by_node| places.map(|far| (by_node, far)));
    Box::new(places.into_iter().flatten().map(|(by_node, far)| {
        let [x, y, z] = [far, -far, 2.0 * far];
        let (file, text) = if by_node {
            let camera = json!({"node": {"camera": 0}, "perspective": {"yfov": 1, "znear": 0.02, "zfar": 20}});
            let node = json!({"translation": [x, y, z]});
            ("a.gltf", Shape::sphere().gltf(&node, &camera))
        } else {
            ("a.obj", Shape::sphere().placed(1.0, [x, y, z]).obj(None))
        };
        let by = if by_node { "node" } else { "vertices" };
        let flags = format!(
            "--size 128x128 --hfov 60 --eye {},{},{} --target {x},{y},{z}",
            x + 0.5,
            y + 0.25,
            z + 3.25
        );
        Case {
            file,
            against: against(far == 0.0),
            ..Case::new(format!("{far:e} m by its {by}"), text, flags)
        }
    }))
}

pub(super) fn scale(_: bool) -> Cases {
    Box::new(
        [1.0, 1e-6, 1e-4, 1e-2, 1e2, 1e4, 1e6]
            .into_iter()
            .map(|scale| {
                let flags = format!(
                    "--size 128x128 --hfov 60 --eye {},{},{} --target 0,0,0 --ipd {}",
                    0.5 * scale,
                    0.25 * scale,
                    3.25 * scale,
                    64.0 * scale
                );
                let sphere = Shape::sphere().placed(scale, [0.0; 3]);
                Case {
                    against: against(scale == 1.0),
                    ..Case::new(format!("{scale:e} m"), sphere.obj(None), flags)
                }
            }),
    )
}

pub(super) fn triangles(_: bool) -> Cases {
    let flat = |thin: f64| Shape::square(8).map(|[x, y, z]| [x, y * thin, z], |uv| uv);
    let huge =
        |reach: f64| Shape::square(1).map(|[x, y, _]| [x * reach, -1.0, -y * reach], |uv| uv);
    let twice = |lift: f64| {
        let mut shape = Shape::square(8);
        let second = Shape::square(8).placed(1.0, [0.0, 0.0, lift]);
        let first = shape.positions.len();
        shape.positions.extend(second.positions);
        shape.uvs.extend(second.uvs);
        let triangles = second.triangles.into_iter();
        shape
            .triangles
            .extend(triangles.map(|t| t.map(|v| v + first)));
        shape
    };
    let wound_back = || {
        let mut shape = twice(0.0);
        let half = shape.triangles.len() / 2;
        shape.triangles[half..]
            .iter_mut()
            .for_each(|t| t.swap(1, 2));
        shape
    };
    let with = |value: f64| {
        let mut shape = Shape::square(2);
        shape.positions[4][0] = value;
        shape
    };
    let shapes = [
        ("slivers that no pixel sees", flat(1e-6)),
        ("degenerate", flat(0.0)),
        ("1 km", huge(1e3)),
        ("1000 km", huge(1e6)),
        ("10^9 m", huge(1e9)),
        ("10^18 m", huge(1e18)),
        ("exact duplicates", twice(0.0)),
        ("duplicates wound the other way", wound_back()),
        ("a plane 10^-6 m before another", twice(1e-6)),
        ("a plane 10^-5 m before another", twice(1e-5)),
        ("a plane 10^-3 m before another", twice(1e-3)),
        ("a plane 10^-4 m before another", twice(1e-4)),
        ("NaN", with(f64::NAN)),
        ("infinity", with(f64::INFINITY)),
        ("10^30", with(1e30)),
    ];
    let case =
        |(label, shape): (&str, Shape)| Case::new(label, shape.obj(Some("checker")), BEFORE_SQUARE);
    Box::new(shapes.into_iter().map(case))
}

pub(super) fn slivers(_: bool) -> Cases {
    Box::new([100, 1000, 10_000].into_iter().map(|rows| {
        let mut slivers = Shape::default();
        for row in 0..rows {
            let y = 2.0 * f64::from(row) / f64::from(rows) - 1.0;
            let thin = 0.6 / f64::from(rows);
            let first = slivers.positions.len();
            (slivers.positions).extend([[-1.0, y, 0.0], [1.0, y, 0.0], [1.0, y + thin, 0.0]]);
            slivers.uvs.extend([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]);
            slivers.triangles.push([first, first + 1, first + 2]);
        }
        let flags = "--size 128x128 --hfov 60 --eye 0.2,0.3,1.5 --target 0.01,0.02,0";
        Case::new(
            format!("{rows} of them"),
            slivers.obj(Some("checker")),
            flags,
        )
    }))
}

pub(super) fn triangle_counts(full: bool) -> Cases {
    // The last one takes minutes.
    let cells = [1, 100, 1000, 2240]
        .into_iter()
        .take(if full { 4 } else { 3 });
    Box::new(cells.map(|cells| {
        Case::new(
            format!("{} triangles", 2 * cells * cells),
            Shape::square(cells).obj(Some("checker")),
            BEFORE_SQUARE,
        )
    }))
}
