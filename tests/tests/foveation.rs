//! Savings and image errors of masking and foveating real scenes: fragments against the prediction, and
//! image error against the picture at full rate.

use formats::view::{FovTangents, Lens};
use image_error::{Mask, Picture, PictureError, Reference, pixels_per_degree};
use parallax_tests::{program, real_scene, run_ok, said};
use std::path::Path;

const SIZE_PX: [u32; 2] = [480, 540];

/// The left eye's picture of a capture.
struct Shot {
    picture: Picture,
    fragments: u64,
    quads: u64,
    /// Share of the pixels that are not masked.
    predicted: Option<f64>,
}

/// The number before a word of the summary.
fn before(summary: &str, word: &str) -> Option<f64> {
    let text = &summary[..summary.find(word)?];
    let number = text.trim_end().trim_end_matches('%').trim_end();
    let start = number.rfind([' ', '\n']).map_or(0, |at| at + 1);
    number[start..].parse().ok()
}

fn shoot(folder: &Path, scene: &str, options: &[&str]) -> Shot {
    let png = folder.join("picture.png");
    let mut command = program("tracegen");
    // The shots of a scene share prepared textures.
    command.env("PARALLAX_CACHE_DIR", folder.join("cache"));
    command.env_remove("PARALLAX_CACHE_SIZE");
    command.args([
        "raster",
        scene,
        "--size",
        "480x540",
        "--no-plain",
        "--views",
        "left",
        "-o",
    ]);
    command
        .arg(folder.join("a.textrace"))
        .arg("--image")
        .arg(&png);
    let output = run_ok(command.args(options));
    let summary = said(&output);
    let image = image::open(&png).expect("a picture").to_rgb8();
    assert_eq!([image.width(), image.height()], SIZE_PX);
    let number =
        |word: &str| before(&summary, word).unwrap_or_else(|| panic!("no {word}: {summary}"));
    Shot {
        picture: Picture {
            size_px: SIZE_PX,
            pixels: image.pixels().map(|pixel| pixel.0).collect(),
        },
        fragments: number("fragments (") as u64,
        quads: number("quads") as u64,
        predicted: before(&summary, "of the pixels are open").map(|percent| percent / 100.0),
    }
}

/// The display that `--size` sets.
fn fov() -> FovTangents {
    let horizontal = 50.0_f32.to_radians().tan();
    let vertical = horizontal * SIZE_PX[1] as f32 / SIZE_PX[0] as f32;
    FovTangents::new(horizontal, horizontal, vertical, vertical)
}

/// Measures fragments and picture errors with settings against the picture without: all settings, or the
/// most informative ones.
fn measure(scene: &str, all: bool) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let whole = shoot(folder.path(), scene, &[]);
    let (fov, lens) = (fov(), Lens::of(&fov()));
    let visible = Mask::of_lens(SIZE_PX, &fov, &lens);
    let degree_px = pixels_per_degree(SIZE_PX[0], &fov);
    let reference = Reference::new(whole.picture.clone(), visible, degree_px).expect("one size");
    let row = |name: &str, options: &[&str]| -> (PictureError, f64) {
        let shot = shoot(folder.path(), scene, options);
        let error = reference.error(&shot.picture).expect("one size");
        let share = shot.fragments as f64 / whole.fragments as f64;
        let predicted = shot.predicted.expect("a prediction");
        println!(
            "{scene} | {name} | {:.1} % | {:.1} % | {:.1} % | {:.4} | {:.3} | {:.1} | {:.4}",
            100.0 * predicted,
            100.0 * share,
            100.0 * shot.quads as f64 / whole.quads as f64,
            error.flip_mean,
            error.flip_p99,
            error.psnr_db,
            error.ssim
        );
        // Deep scenes and sky have unevenly distributed fragments.
        assert!(
            (share - predicted).abs() < 0.2,
            "{name}: {share} {predicted}"
        );
        (error, share)
    };
    println!(
        "scene | setting | predicted | fragments | quads | FLIP mean | FLIP p99 | PSNR dB | SSIM"
    );
    let (masked, _) = row("hidden-area mask", &["--hidden-area-mask"]);
    assert_eq!(masked, PictureError::NONE, "the lens shows no difference");
    let uniform = |name, edges| row(name, &["--foveate", "rings", "--rates", edges]);
    let mut rates = Vec::new();
    for (name, edges, is_default) in [
        ("1/2 everywhere", "0,180,180,180", false),
        ("1/4 everywhere", "0,0,180,180", true),
        ("1/8 everywhere", "0,0,0,180", false),
        ("1/16 everywhere", "0,0,0,0", true),
    ] {
        if all || is_default {
            rates.push(uniform(name, edges));
        }
    }
    let coarsest = rates[rates.len() - 1].0.flip_mean;
    for pair in rates.windows(2) {
        assert!(pair[0].0.flip_mean < pair[1].0.flip_mean, "{pair:?}");
        assert!(pair[0].0.psnr_db > pair[1].0.psnr_db, "{pair:?}");
        assert!(pair[0].1 > pair[1].1, "{pair:?}");
    }
    let (rings, _) = row("rings 15,25,35,45", &["--foveate", "rings"]);
    // Coarser only in the periphery, so the error is less than with the coarsest rate everywhere.
    assert!(0.0 < rings.flip_mean && rings.flip_mean < coarsest);
    if !all {
        return;
    }
    let (acuity, _) = row("rings acuity", &["--foveate", "rings", "--rates", "acuity"]);
    assert!(0.0 < acuity.flip_mean && acuity.flip_mean < rings.flip_mean);
    row(
        "rings 15,25,35,45 and mask",
        &["--foveate", "rings", "--hidden-area-mask"],
    );
    row("multi-resolution", &["--foveate", "multi-resolution"]);
    row("radial density", &["--foveate", "radial-density"]);
}

#[test]
fn coarser_rates_shade_fewer_fragments_and_have_larger_errors_on_a_built_in_scene() {
    measure("chess", true);
}

#[test]
fn coarser_rates_shade_fewer_fragments_and_have_larger_errors_on_crytek_sponza_and_the_black_forest()
 {
    // With `FOVEATION=all`, every setting is measured there, too.
    let all = std::env::var_os("FOVEATION").is_some();
    for scene in [
        "crytek-sponza/sponza.gltf",
        "stk-black-forest/stk-black-forest.gltf",
    ] {
        if let Some(scene) = real_scene(scene) {
            measure(scene.to_str().expect("a path in UTF-8"), all);
        }
    }
}

#[test]
fn the_middle_viewport_has_the_baselines_pixels_on_real_scenes() {
    let scenes = [
        "crytek-sponza/sponza.gltf",
        "stk-black-forest/stk-black-forest.gltf",
    ];
    for scene in scenes {
        let Some(scene) = real_scene(scene) else {
            return;
        };
        let folder = tempfile::tempdir().expect("a temporary folder");
        let [plain, foveated] = [&[][..], &["--foveate", "multi-resolution"]].map(|options| {
            let image = folder.path().join("picture.png");
            let mut command = program("tracegen");
            command.args(["raster", "--size", "480x540", "-o"]);
            command.arg(folder.path().join("t.textrace")).arg(&scene);
            run_ok(command.args(options).arg("--image").arg(&image));
            image::open(&image).expect("a picture").to_rgb8()
        });
        // The middle viewport has 40 % of width and height; its edges are rounded to tiles.
        let of_eye = |x: u32| (x % 480).abs_diff(240) < 80;
        let mut compared = 0;
        for (x, y, pixel) in plain.enumerate_pixels() {
            if of_eye(x) && y.abs_diff(270) < 90 {
                assert_eq!(pixel, foveated.get_pixel(x, y), "{x} {y}");
                compared += 1;
            }
        }
        assert!(compared > 50_000);
        assert!(plain != foveated);
    }
}
