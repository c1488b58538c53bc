//! Scale of the scene.

use super::super::probe::Capture;
use super::super::shapes::Shape;
use super::super::{Bounds, Points, Sweep};

pub(super) const SWEEP: Sweep = Sweep {
    name: "scale",
    about: "A sphere of 10^-6 to 10^6 m, seen from as many radii with eyes as many radii apart, against the one of 1 m.",
    bounds: Bounds {
        fragments_pct: 0.1,
        uv_texels: 0.01,
    },
    warning: None,
    run,
};

fn run(points: &mut Points<'_>) -> anyhow::Result<()> {
    let mut of_a_metre = None;
    for scale in [1.0, 1e-6, 1e-4, 1e-2, 1e2, 1e4, 1e6] {
        let sphere = Shape::sphere().placed(scale, [0.0; 3]);
        let scene = points.probe.write("a.obj", sphere.obj(None))?;
        let flags = format!(
            "--size 128x128 --hfov 60 --eye {},{},{} --target 0,0,0 --ipd {}",
            0.5 * scale,
            0.25 * scale,
            3.25 * scale,
            64.0 * scale
        );
        let capture = Capture::new(scene, &flags);
        let label = format!("{scale:e} m");
        match &of_a_metre {
            None => {
                points.add_against_reference(label, &capture)?;
                of_a_metre = Some(points.probe.views()?);
            }
            Some(expected) => points.add(label, &capture, |probe| probe.against(expected))?,
        }
    }
    Ok(())
}
