//! Texture coordinates far from 0, negative, mirrored and clamped.

use super::super::probe::Capture;
use super::super::shapes::{Shape, checker};
use super::super::{Bounds, Points, Sweep};

pub(super) const SWEEP: Sweep = Sweep {
    name: "uv-offset",
    about: "A square with a texture of 1024 x 1024 and coordinates from -10^6 to 10^6, against the reference in double precision.",
    bounds: Bounds {
        fragments_pct: 0.05,
        uv_texels: 0.25,
    },
    warning: Some("texture coordinates of"),
    run,
};

fn run(points: &mut Points<'_>) -> anyhow::Result<()> {
    points.probe.write("stress.png", checker([1024, 1024])?)?;
    for (offset, turn, material) in [
        (0.0, 1.0, "checker"),
        (0.0, -1.0, "checker"),
        (100.0, 1.0, "checker"),
        (-100.0, 1.0, "checker"),
        (1e3, 1.0, "checker"),
        (1e4, 1.0, "checker"),
        (1e5, 1.0, "checker"),
        (1e6, 1.0, "checker"),
        (-1e6, -1.0, "checker"),
        (0.0, 1.0, "clamped"),
        (-3.0, 4.0, "clamped"),
        (1e6, 1.0, "clamped"),
    ] {
        let square = Shape::square(4).map(|p| p, |[u, v]| [offset + turn * u, offset + v]);
        let scene = points.probe.write("a.obj", square.obj(Some(material)))?;
        let flags = "--size 128x128 --hfov 60 --eye 0.2,0.3,1.5 --target 0,0,0";
        points.add_against_reference(
            format!(
                "{offset:e}, {}{material}",
                if turn < 0.0 { "mirrored, " } else { "" }
            ),
            &Capture::new(scene, flags),
        )?;
    }
    Ok(())
}
