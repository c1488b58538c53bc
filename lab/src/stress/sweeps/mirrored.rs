//! A property: a mirrored scene results in mirrored pictures of the eyes.

use super::super::probe::{Capture, Views};
use super::super::shapes::Shape;
use super::super::{Bounds, Points, Sweep};

pub(super) const SWEEP: Sweep = Sweep {
    name: "mirrored",
    about: "Clutter mirrored left to right, seen by mirrored eyes: the left one's fragments against those of the right one of the scene as it was, mirrored. Vertices in the middle between two steps of the rasteriser's grid round the other way.",
    bounds: Bounds {
        fragments_pct: 0.2,
        uv_texels: 0.05,
    },
    warning: None,
    run,
};

const SIZE_PX: u32 = 128;

/// Eyes exchanged, columns mirrored.
fn mirrored([left, right]: Views) -> Views {
    [right, left].map(|view| {
        let fragments = view.into_iter();
        let mirrored = fragments.map(|(([x, y], primitive), lane)| {
            let pixel = [SIZE_PX - 1 - x, y];
            ((pixel, primitive), lane)
        });
        mirrored.collect()
    })
}

fn run(points: &mut Points<'_>) -> anyhow::Result<()> {
    for (label, material, flags) in [
        ("symmetric eyes", "checker", "--hfov 90"),
        ("canted eyes", "checker", "--hfov 90 --cant 10"),
        ("asymmetric eyes", "checker", "--fov-tangents 2,0.5,1,1.5"),
        ("eyes a metre apart", "checker", "--hfov 90 --ipd 1000"),
        ("masked", "masked", "--hfov 90"),
        ("blended", "blended", "--hfov 90"),
    ] {
        let clutter = Shape::clutter(300, 10.0);
        let flags = format!("--size {SIZE_PX}x{SIZE_PX} --eye 0,0,0 --target 0,0.2,-1 {flags}");
        let scene = (points.probe).write("a.obj", clutter.obj(Some(material)))?;
        points.probe.capture(&Capture::new(scene, &flags))?;
        let expected = mirrored(points.probe.views()?);
        let other = clutter.map(|[x, y, z]| [-x, y, z], |uv| uv);
        let scene = points.probe.write("b.obj", other.obj(Some(material)))?;
        let capture = Capture::new(scene, &flags);
        points.add(label, &capture, |probe| probe.against(&expected))?;
    }
    Ok(())
}
