//! Sizes of textures.

use super::super::probe::Capture;
use super::super::shapes::{Shape, checker};
use super::super::{Bounds, Points, Sweep};

pub(super) const SWEEP: Sweep = Sweep {
    name: "texture-size",
    about: "A square with textures of 1 x 1 to 16384 x 16384, powers of two or not, against the reference.",
    bounds: Bounds {
        fragments_pct: 0.05,
        uv_texels: 0.02,
    },
    warning: None,
    run,
};

fn run(points: &mut Points<'_>) -> anyhow::Result<()> {
    let scene = points
        .probe
        .write("a.obj", Shape::square(4).obj(Some("checker")))?;
    for size in [
        [1, 1],
        [3, 5],
        [1, 4096],
        [1000, 600],
        [2048, 2048],
        [16384, 1],
        [16384, 16384],
        [16385, 4],
    ] {
        points.probe.write("stress.png", checker(size)?)?;
        let flags = "--size 128x128 --hfov 60 --eye 0.2,0.3,1.5 --target 0,0,0";
        points.add_against_reference(
            format!("{} x {}", size[0], size[1]),
            &Capture::new(scene.clone(), flags),
        )?;
    }
    Ok(())
}
