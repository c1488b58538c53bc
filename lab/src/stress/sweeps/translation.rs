//! Distance of the scene from the origin.

use super::super::probe::Capture;
use super::super::shapes::Shape;
use super::super::{Bounds, Points, Sweep};
use serde_json::json;

pub(super) const SWEEP: Sweep = Sweep {
    name: "translation",
    about: "A unit sphere at 0 to 10^7 m on each axis, by its node (glTF) and by its vertices (OBJ), against the same at 0.",
    bounds: Bounds {
        fragments_pct: 0.0,
        uv_texels: 0.0,
    },
    warning: None,
    run,
};

fn run(points: &mut Points<'_>) -> anyhow::Result<()> {
    for by_node in [true, false] {
        let mut at_zero = None;
        for far in [0.0, 1e3, 1e4, 1e5, 1e6, 1e7] {
            let at = [far, -far, 2.0 * far];
            let (name, text) = if by_node {
                let camera = json!({"node": {"camera": 0}, "perspective": {"yfov": 1, "znear": 0.02, "zfar": 20}});
                (
                    "a.gltf",
                    Shape::sphere().gltf(&json!({"translation": at}), &camera),
                )
            } else {
                ("a.obj", Shape::sphere().placed(1.0, at).obj(None))
            };
            let scene = points.probe.write(name, text)?;
            let [x, y, z] = at;
            let flags = format!(
                "--size 128x128 --hfov 60 --eye {},{},{} --target {x},{y},{z}",
                x + 0.5,
                y + 0.25,
                z + 3.25
            );
            let label = format!(
                "{far:e} m by its {}",
                if by_node { "node" } else { "vertices" }
            );
            let capture = Capture::new(scene, &flags);
            match &at_zero {
                None => {
                    points.add_against_reference(label, &capture)?;
                    at_zero = Some(points.probe.views()?);
                }
                Some(expected) => points.add(label, &capture, |probe| probe.against(expected))?,
            }
        }
    }
    Ok(())
}
