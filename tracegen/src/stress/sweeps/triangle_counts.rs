//! Many triangles.

use super::super::probe::Capture;
use super::super::shapes::Shape;
use super::super::{Bounds, Points, Sweep};

pub(super) const SWEEP: Sweep = Sweep {
    name: "triangle-count",
    about: "A square of up to 2 million triangles, most of them smaller than a pixel, against the reference.",
    bounds: Bounds {
        fragments_pct: 0.2,
        uv_texels: 0.05,
    },
    run,
};

fn run(points: &mut Points<'_>) -> anyhow::Result<()> {
    for cells in [1, 100, 1000] {
        let scene = points
            .probe
            .write("a.obj", Shape::square(cells).obj(Some("checker")))?;
        let flags = "--size 128x128 --hfov 60 --eye 0.2,0.3,1.5 --target 0,0,0";
        points.add_against_reference(
            format!("{} triangles", 2 * cells * cells),
            &Capture::new(scene, flags),
        )?;
    }
    Ok(())
}
