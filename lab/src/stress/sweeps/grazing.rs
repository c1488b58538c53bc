//! Surfaces seen almost edge-on.

use super::super::probe::Capture;
use super::super::shapes::Shape;
use super::super::{Bounds, Points, Sweep};

pub(super) const SWEEP: Sweep = Sweep {
    name: "grazing",
    about: "A floor of 2000 m with 1000 repeats of a texture, seen from 10 m down to a centimetre above it, against the reference.",
    bounds: Bounds {
        fragments_pct: 0.2,
        uv_texels: 0.25,
    },
    warning: None,
    run,
};

fn run(points: &mut Points<'_>) -> anyhow::Result<()> {
    let floor = Shape::square(20).map(
        |[x, y, _]| [1000.0 * x, 0.0, -1000.0 * y],
        |[u, v]| [1000.0 * u - 500.0, 1000.0 * v - 500.0],
    );
    let scene = points.probe.write("a.obj", floor.obj(Some("checker")))?;
    for height in ["10", "1", "0.1", "0.01"] {
        let flags = format!("--size 128x128 --hfov 60 --eye 0,{height},0 --target 0,{height},-1");
        points.add_against_reference(
            format!("{height} m above"),
            &Capture::new(scene.clone(), &flags),
        )?;
    }
    Ok(())
}
