//! Near and far plane.

use super::super::probe::Capture;
use super::super::shapes::Shape;
use super::super::{Bounds, Points, Sweep};
use serde_json::json;

pub(super) const SWEEP: Sweep = Sweep {
    name: "near-far",
    about: "Clutter through a camera whose planes are up to 10^12 apart, against the reference; its depth is rounded to 32 bits, too.",
    bounds: Bounds {
        fragments_pct: 0.2,
        uv_texels: 0.05,
    },
    warning: None,
    run,
};

fn run(points: &mut Points<'_>) -> anyhow::Result<()> {
    for (near, far) in [
        (0.1, 10.0),
        (0.1, 1e3),
        (0.1, 1e5),
        (0.1, 1e7),
        (0.1, 1e9),
        (1e-3, 1e9),
        (9.0, 9.001),
    ] {
        let camera =
            json!({"node": {"camera": 0}, "perspective": {"yfov": 1, "znear": near, "zfar": far}});
        let text = Shape::clutter(300, 10.0).gltf(&json!({}), &camera);
        let scene = points.probe.write("a.gltf", text)?;
        points.add_against_reference(
            format!("{near} to {far:e} m"),
            &Capture::new(scene, "--size 128x128"),
        )?;
    }
    Ok(())
}
