//! Special triangles: degenerate, huge, not finite, coincident.

use super::super::probe::Capture;
use super::super::shapes::Shape;
use super::super::{Bounds, Points, Sweep};

pub(super) const SWEEP: Sweep = Sweep {
    name: "triangles",
    about: "Degenerate and huge triangles, exact duplicates (the first one wins), one plane close before another, NaN and infinity, against the reference. No renderer distinguishes planes that are less than a few steps of 32-bit depth apart (z^2 / near / 2^24, here 10^-5 m), or duplicates with reversed winding.",
    bounds: Bounds {
        fragments_pct: 0.2,
        uv_texels: 0.05,
    },
    warning: Some("lie upon others"),
    run,
};

fn run(points: &mut Points<'_>) -> anyhow::Result<()> {
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
    for (label, shape) in [
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
    ] {
        let scene = points.probe.write("a.obj", shape.obj(Some("checker")))?;
        let flags = "--size 128x128 --hfov 60 --eye 0.2,0.3,1.5 --target 0,0,0";
        points.add_against_reference(label, &Capture::new(scene, flags))?;
    }
    Ok(())
}
