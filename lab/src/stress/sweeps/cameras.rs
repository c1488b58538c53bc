//! Cameras, eyes and pictures.

use super::super::shapes::Shape;
use super::super::{Against, Case};
use super::{AMID_CLUTTER, Cases};
use serde_json::json;

fn clutter() -> Shape {
    Shape::clutter(300, 10.0)
}

pub(super) fn planes(_: bool) -> Cases {
    let planes = [
        (0.1, 10.0),
        (0.1, 1e3),
        (0.1, 1e5),
        (0.1, 1e7),
        (0.1, 1e9),
        (1e-3, 1e9),
        (9.0, 9.001),
    ];
    Box::new(planes.into_iter().map(|(near, far)| {
        let camera =
            json!({"node": {"camera": 0}, "perspective": {"yfov": 1, "znear": near, "zfar": far}});
        Case {
            file: "a.gltf",
            ..Case::new(
                format!("{near} to {far:e} m"),
                clutter().gltf(&json!({}), &camera),
                "--size 128x128",
            )
        }
    }))
}

pub(super) fn fields(_: bool) -> Cases {
    let degrees = [
        "0.01", "1", "10", "60", "100", "150", "170", "178", "179", "179.9", "180",
    ];
    Box::new(degrees.into_iter().map(|degrees| {
        let flags = format!("{AMID_CLUTTER} --hfov {degrees}");
        Case::new(
            format!("{degrees} degrees"),
            clutter().obj(Some("checker")),
            flags,
        )
    }))
}

pub(super) fn eyes(_: bool) -> Cases {
    let eyes = [
        "ipd 0",
        "ipd 0.001",
        "ipd 64",
        "ipd 1000",
        "ipd 10000",
        "ipd 2e9",
        "cant=-45",
        "cant 10",
        "cant 45",
        "cant 60",
        "fov-tangents 5,0.1,1,1",
        "fov-tangents 3,-0.5,1,1",
        "fov-tangents 0.2,0.3,4,0.1",
        "fov-tangents 99,99,99,99",
        "fov-tangents 1,-1,1,1",
    ];
    Box::new(eyes.into_iter().map(|eyes| {
        let flags = format!("{AMID_CLUTTER} --{eyes}");
        Case::new(eyes, clutter().obj(Some("checker")), flags)
    }))
}

pub(super) fn grazing(_: bool) -> Cases {
    Box::new(["10", "1", "0.1", "0.01"].into_iter().map(|height| {
        let floor = Shape::square(20).map(
            |[x, y, _]| [1000.0 * x, 0.0, -1000.0 * y],
            |[u, v]| [1000.0 * u - 500.0, 1000.0 * v - 500.0],
        );
        Case::new(
            format!("{height} m above"),
            floor.obj(Some("checker")),
            format!("--size 128x128 --hfov 60 --eye 0,{height},0 --target 0,{height},-1"),
        )
    }))
}

pub(super) fn viewports(_: bool) -> Cases {
    let sizes = [
        "1x1",
        "2x3",
        "17x13",
        "15x16",
        "255x257",
        "1000x8",
        "1x8192",
        "8192x8192",
        "8193x1",
    ];
    Box::new(sizes.into_iter().map(|size| {
        // The reference visits every pixel, so few triangles are enough in the largest picture.
        let (file, count) = match size {
            "8192x8192" => ("b.obj", 4),
            _ => ("a.obj", 300),
        };
        let clutter = Shape::clutter(count, 10.0).obj(Some("checker"));
        let flags = format!("--size {size} --fov-tangents 1,1,1,1 --eye 0,0,0 --target 1,0.2,-1");
        Case {
            file,
            ..Case::new(size, clutter, flags)
        }
    }))
}

pub(super) fn mirrored(_: bool) -> Cases {
    let views = [
        ("symmetric eyes", "checker", "--hfov 90"),
        ("canted eyes", "checker", "--hfov 90 --cant 10"),
        ("asymmetric eyes", "checker", "--fov-tangents 2,0.5,1,1.5"),
        ("eyes a metre apart", "checker", "--hfov 90 --ipd 1000"),
        ("masked", "masked", "--hfov 90"),
        ("blended", "blended", "--hfov 90"),
    ];
    Box::new(views.into_iter().map(|(label, material, flags)| {
        let mirrored = clutter().map(|[x, y, z]| [-x, y, z], |uv| uv);
        let flags = format!("--size 128x128 --eye 0,0,0 --target 0,0.2,-1 {flags}");
        Case {
            file: "b.obj",
            against: Against::MirrorImageOf(clutter().obj(Some(material)), 128),
            ..Case::new(label, mirrored.obj(Some(material)), flags)
        }
    }))
}
