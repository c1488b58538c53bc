//! Sizes and coordinates of textures, and transparency.

use super::super::Case;
use super::super::shapes::Shape;
use super::{BEFORE_SQUARE, Cases};

/// Texture coordinates far from 0, negative, mirrored and clamped.
pub(super) fn uv_offsets(_: bool) -> Cases {
    let offsets = [
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
    ];
    Box::new(offsets.into_iter().map(|(offset, turn, material)| {
        let square = Shape::square(4).map(|p| p, |[u, v]| [offset + turn * u, offset + v]);
        let mirrored = if turn < 0.0 { "mirrored, " } else { "" };
        Case {
            texture_px: [1024, 1024],
            ..Case::new(
                format!("{offset:e}, {mirrored}{material}"),
                square.obj(Some(material)),
                BEFORE_SQUARE,
            )
        }
    }))
}

pub(super) fn sizes(_: bool) -> Cases {
    let sizes = [
        [1, 1],
        [3, 5],
        [1, 4096],
        [1000, 600],
        [2048, 2048],
        [16384, 1],
        [16384, 16384],
        [16385, 4],
    ];
    Box::new(sizes.into_iter().map(|texture_px| {
        let [width, height] = texture_px;
        Case {
            texture_px,
            ..Case::new(
                format!("{width} x {height}"),
                Shape::square(4).obj(Some("checker")),
                BEFORE_SQUARE,
            )
        }
    }))
}

pub(super) fn transparency(_: bool) -> Cases {
    let clutter = [(100, 10.0), (300, 1000.0)];
    let scenes = ["masked", "blended"].map(|material| clutter.map(|(n, m)| (material, n, m)));
    let scenes = scenes.into_iter().flatten();
    Box::new(scenes.map(|(material, count, reach)| {
        let flags = format!(
            "--size 128x128 --hfov 90 --eye 0,0,0 --target 1,0.2,-1 --ipd {}",
            6.4 * reach
        );
        Case::new(
            format!("{count} triangles, {material}, within {reach} m"),
            Shape::clutter(count, reach).obj(Some(material)),
            flags,
        )
    }))
}
