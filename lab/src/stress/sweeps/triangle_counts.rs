//! Numbers of triangles.

use super::super::probe::Capture;
use super::super::shapes::Shape;
use super::super::{Bounds, Points, Sweep};

pub(super) const SWEEP: Sweep = Sweep {
    name: "triangle-count",
    about: "A square of up to 2 million triangles (10 million with --full), most of them smaller than a pixel, against the reference.",
    bounds: Bounds {
        fragments_pct: 0.2,
        uv_texels: 0.05,
    },
    warning: None,
    run,
};

fn run(points: &mut Points<'_>) -> anyhow::Result<()> {
    // The last one takes minutes.
    let counts: &[usize] = if points.full {
        &[1, 100, 1000, 2240]
    } else {
        &[1, 100, 1000]
    };
    for &cells in counts {
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
