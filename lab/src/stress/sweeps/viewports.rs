//! Sizes of pictures.

use super::super::probe::Capture;
use super::super::shapes::Shape;
use super::super::{Bounds, Points, Sweep};

pub(super) const SWEEP: Sweep = Sweep {
    name: "viewport",
    about: "Clutter in pictures of 1 x 1 to 8192 x 8192 pixels, multiples of a tile or not, against the reference. In a picture of one column every fragment lies at an edge.",
    bounds: Bounds {
        fragments_pct: 0.5,
        uv_texels: 0.05,
    },
    warning: None,
    run,
};

fn run(points: &mut Points<'_>) -> anyhow::Result<()> {
    let clutter = points
        .probe
        .write("a.obj", Shape::clutter(300, 10.0).obj(Some("checker")))?;
    // The reference visits every pixel, so one triangle is enough there.
    let few = points
        .probe
        .write("b.obj", Shape::clutter(4, 10.0).obj(Some("checker")))?;
    for size in [
        "1x1",
        "2x3",
        "17x13",
        "15x16",
        "255x257",
        "1000x8",
        "1x8192",
        "8192x8192",
        "8193x1",
    ] {
        let scene = if size == "8192x8192" { &few } else { &clutter };
        let flags = format!("--size {size} --fov-tangents 1,1,1,1 --eye 0,0,0 --target 1,0.2,-1");
        points.add_against_reference(size, &Capture::new(scene.clone(), &flags))?;
    }
    Ok(())
}
