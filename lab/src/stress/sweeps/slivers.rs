//! Triangles much thinner than a pixel.

use super::super::probe::Capture;
use super::super::shapes::Shape;
use super::super::{Bounds, Points, Sweep};

pub(super) const SWEEP: Sweep = Sweep {
    name: "slivers",
    about: "Rows of triangles of 0.3, 0.03 and 0.003 pixels high, against the reference. All of their fragments lie at edges, where a vertex that rounds to the next \
            of 1/256 of a pixel decides, and moves coordinates that run through a whole texture within the height; those thinner than that are drawn or not as their rounding falls.",
    bounds: Bounds {
        fragments_pct: 10.0,
        uv_texels: 0.1,
    },
    warning: Some("thinner than 1/256 pixel"),
    run,
};

fn run(points: &mut Points<'_>) -> anyhow::Result<()> {
    for rows in [100, 1000, 10_000] {
        let mut slivers = Shape::default();
        for row in 0..rows {
            let y = 2.0 * f64::from(row) / f64::from(rows) - 1.0;
            let thin = 0.6 / f64::from(rows);
            let first = slivers.positions.len();
            (slivers.positions).extend([[-1.0, y, 0.0], [1.0, y, 0.0], [1.0, y + thin, 0.0]]);
            slivers.uvs.extend([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]);
            slivers.triangles.push([first, first + 1, first + 2]);
        }
        let scene = points.probe.write("a.obj", slivers.obj(Some("checker")))?;
        let flags = "--size 128x128 --hfov 60 --eye 0.2,0.3,1.5 --target 0.01,0.02,0";
        points.add_against_reference(format!("{rows} of them"), &Capture::new(scene, flags))?;
    }
    Ok(())
}
