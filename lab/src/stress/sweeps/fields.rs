//! Fields of view.

use super::super::probe::Capture;
use super::super::shapes::Shape;
use super::super::{Bounds, Points, Sweep};

pub(super) const SWEEP: Sweep = Sweep {
    name: "field-of-view",
    about: "Clutter through 0.01 to 180 degrees, against the reference.",
    bounds: Bounds {
        fragments_pct: 0.2,
        uv_texels: 0.05,
    },
    warning: None,
    run,
};

fn run(points: &mut Points<'_>) -> anyhow::Result<()> {
    let scene = points
        .probe
        .write("a.obj", Shape::clutter(300, 10.0).obj(Some("checker")))?;
    for degrees in [
        "0.01", "1", "10", "60", "100", "150", "170", "178", "179", "179.9", "180",
    ] {
        let flags = format!("--size 128x128 --eye 0,0,0 --target 1,0.2,-1 --hfov {degrees}");
        points.add_against_reference(
            format!("{degrees} degrees"),
            &Capture::new(scene.clone(), &flags),
        )?;
    }
    Ok(())
}
