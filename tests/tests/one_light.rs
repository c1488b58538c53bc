//! Checks that both renderers light a scene in the same way: the same sun, sky, ground and exposure.

use parallax_tests::{program, run_ok};
use std::f32::consts::PI;
use std::fmt::Write;
use std::path::Path;

/// A smooth unit sphere around the origin, without material.
fn sphere() -> String {
    const COLUMNS: u32 = 64;
    const ROWS: u32 = 32;
    let mut obj = String::new();
    for row in 0..=ROWS {
        let (sine, cosine) = (PI * row as f32 / ROWS as f32).sin_cos();
        for column in 0..COLUMNS {
            let (z, x) = (2.0 * PI * column as f32 / COLUMNS as f32).sin_cos();
            let (x, z) = (sine * x, sine * z);
            writeln!(obj, "v {x} {cosine} {z}\nvn {x} {cosine} {z}").expect("a string grows");
        }
    }
    for row in 0..ROWS {
        for column in 0..COLUMNS {
            let next = (column + 1) % COLUMNS;
            let [a, b] = [column, next].map(|c| row * COLUMNS + c + 1);
            let (c, d) = (a + COLUMNS, b + COLUMNS);
            writeln!(obj, "f {a}//{a} {b}//{b} {d}//{d} {c}//{c}").expect("a string grows");
        }
    }
    obj
}

/// Linear luminance of each pixel of the left eye's picture.
fn luminance(path: &Path, size: u32) -> Vec<f64> {
    let picture = image::open(path).expect("a picture").into_rgb8();
    let mut values = Vec::new();
    for y in 0..size {
        for x in 0..size {
            let linear = picture.get_pixel(x, y).0.map(|byte| {
                let v = f64::from(byte) / 255.0;
                if v <= 0.04045 {
                    v / 12.92
                } else {
                    ((v + 0.055) / 1.055).powf(2.4)
                }
            });
            values.push(0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]);
        }
    }
    values
}

#[test]
fn a_single_sphere_in_a_file_without_lights_looks_the_same_in_raster_and_rays() {
    const SIZE: u32 = 128;
    let folder = tempfile::tempdir().expect("a temporary folder");
    let obj = folder.path().join("sphere.obj");
    std::fs::write(&obj, sphere()).expect("writable");
    // From the side, so that the lit and the unlit half are visible.
    let pictures = ["raster", "rays"].map(|command| {
        let image = folder.path().join(format!("{command}.png"));
        run_ok(
            program("tracegen")
                .arg(command)
                .arg(&obj)
                .args(["--size", "128x128", "--eye", "0,0,4", "--target", "0,0,0"])
                .args(["--hfov", "40", "-o"])
                .arg(folder.path().join(format!("{command}.trace")))
                .arg("--image")
                .arg(&image),
        );
        luminance(&image, SIZE)
    });

    // The sphere covers the middle. Above its equator it is lit; below, the sun does not reach it.
    let half = |picture: &[f64], rows: std::ops::Range<u32>| {
        let inside: Vec<f64> = rows
            .flat_map(|y| (44..84).map(move |x| (y * SIZE + x) as usize))
            .map(|at| picture[at])
            .collect();
        inside.iter().sum::<f64>() / inside.len() as f64
    };
    let ratios = pictures
        .each_ref()
        .map(|picture| half(picture, 34..60) / half(picture, 76..94));
    assert!(ratios[0] > 1.2, "a sun from above: {ratios:?}");
    let difference = (ratios[0] / ratios[1] - 1.0).abs();
    assert!(difference < 0.03, "lit to unlit half: {ratios:?}");

    // Pixel by pixel, including background and outline; some edges differ by a pixel.
    let [raster, rays] = &pictures;
    let apart = raster
        .iter()
        .zip(rays)
        .filter(|(a, b)| (*a - *b).abs() > 0.02)
        .count();
    let share = apart as f64 / raster.len() as f64;
    assert!(share < 0.02, "{apart} of {} pixels differ", raster.len());
}
