//! Transparent draws.

use super::super::probe::Capture;
use super::super::shapes::Shape;
use super::super::{Bounds, Points, Sweep};

pub(super) const SWEEP: Sweep = Sweep {
    name: "transparency",
    about: "Clutter that is masked by a texture's alpha or blended, against the reference. At the border of a hole, alpha within rounding of the cutoff decides.",
    bounds: Bounds {
        fragments_pct: 0.2,
        uv_texels: 0.05,
    },
    warning: None,
    run,
};

fn run(points: &mut Points<'_>) -> anyhow::Result<()> {
    for material in ["masked", "blended"] {
        for (count, reach) in [(100, 10.0), (300, 1000.0)] {
            let scene = points
                .probe
                .write("a.obj", Shape::clutter(count, reach).obj(Some(material)))?;
            let flags = format!(
                "--size 128x128 --hfov 90 --eye 0,0,0 --target 1,0.2,-1 --ipd {}",
                6.4 * reach
            );
            points.add_against_reference(
                format!("{count} triangles, {material}, within {reach} m"),
                &Capture::new(scene, &flags),
            )?;
        }
    }
    Ok(())
}
