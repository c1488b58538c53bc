//! Eyes: their distance, rotation and asymmetry.

use super::super::probe::Capture;
use super::super::shapes::Shape;
use super::super::{Bounds, Points, Sweep};

pub(super) const SWEEP: Sweep = Sweep {
    name: "eyes",
    about: "Clutter through eyes up to 10 m apart, canted and strongly asymmetric ones, against the reference.",
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
    for flags in [
        "--ipd 0",
        "--ipd 0.001",
        "--ipd 64",
        "--ipd 1000",
        "--ipd 10000",
        "--ipd 2e9",
        "--cant=-45",
        "--cant 10",
        "--cant 45",
        "--cant 60",
        "--fov-tangents 5,0.1,1,1",
        "--fov-tangents 3,-0.5,1,1",
        "--fov-tangents 0.2,0.3,4,0.1",
        "--fov-tangents 99,99,99,99",
        "--fov-tangents 1,-1,1,1",
    ] {
        let capture = Capture::new(
            scene.clone(),
            &format!("--size 128x128 --eye 0,0,0 --target 1,0.2,-1 {flags}"),
        );
        points.add_against_reference(flags.trim_start_matches("--"), &capture)?;
    }
    Ok(())
}
