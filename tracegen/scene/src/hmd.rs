//! Head-mounted displays: presets, and frusta given by flags.

mod presets;

use formats::error::{Broken, UnknownName, ensure};
use formats::view::{FovTangents, Hmd, MAX_IPD_M};
use presets::{Fov, ROWS};

/// Default distance between the eyes, metres.
pub const DEFAULT_IPD_M: f32 = 0.064;

/// Largest eye image edge in pixels.
pub const MAX_EYE_SIZE_PX: u32 = 8192;

/// Preset names, the default first.
pub const PRESETS: [&str; ROWS.len()] = {
    let mut names = [""; ROWS.len()];
    let mut row = 0;
    while row < ROWS.len() {
        names[row] = ROWS[row].name;
        row += 1;
    }
    names
};

/// A preset by name.
///
/// # Errors
/// An unknown name; the error lists the presets.
pub fn preset(name: &str) -> Result<Hmd, UnknownName> {
    let Some(row) = ROWS.iter().find(|row| row.name == name) else {
        return Err(UnknownName {
            what: "unknown display",
            name: name.to_owned(),
            known: format!("one of {}", PRESETS.join(", ")),
        });
    };
    let both = |left: FovTangents| [left, mirrored(&left)];
    Ok(Hmd {
        name: name.to_owned(),
        source: row.source.to_owned(),
        eye_size_px: row.eye_size_px,
        fov: match &row.fov {
            Fov::SymmetricDeg(degrees) => both(symmetric(*degrees, row.eye_size_px)),
            Fov::LeftDeg(degrees) => {
                let [left, right, up, down] = degrees.map(|angle| angle.to_radians().tan());
                both(FovTangents::new(left, right, up, down))
            }
            Fov::Left(left) => both(*left),
            Fov::Both(eyes) => *eyes,
        },
        ipd_m: DEFAULT_IPD_M,
        cant_deg: row.cant_deg,
    })
}

/// The other eye's frustum of a mirror-symmetric display.
pub fn mirrored(fov: &FovTangents) -> FovTangents {
    FovTangents {
        left: fov.right,
        right: fov.left,
        ..*fov
    }
}

/// An on-axis frustum with square pixels: the vertical tangents follow from the aspect.
pub fn symmetric(hfov_deg: f32, size_px: [u32; 2]) -> FovTangents {
    // In f64 so that the tangents do not depend on the order of roundings.
    let horizontal = (f64::from(hfov_deg) / 2.0).to_radians().tan();
    let vertical = horizontal * f64::from(size_px[1]) / f64::from(size_px[0]);
    FovTangents::new(
        horizontal as f32,
        horizontal as f32,
        vertical as f32,
        vertical as f32,
    )
}

/// Checks every figure of a display.
///
/// # Errors
/// The first figure out of range.
pub fn validate(hmd: &Hmd) -> Result<(), Broken> {
    let [width, height] = hmd.eye_size_px;
    ensure(
        (1..=MAX_EYE_SIZE_PX).contains(&width) && (1..=MAX_EYE_SIZE_PX).contains(&height),
        "pixels per eye",
        format_args!("1x1 to {MAX_EYE_SIZE_PX}x{MAX_EYE_SIZE_PX}"),
        format_args!("{width}x{height}"),
    )?;
    for fov in &hmd.fov {
        let FovTangents {
            left,
            right,
            up,
            down,
        } = *fov;
        let shown = format!("{left},{right},{up},{down}");
        let all = [left, right, up, down];
        ensure(
            all.iter().all(|t| t.is_finite() && t.abs() <= 100.0),
            "field-of-view tangents",
            "left,right,up,down, each from -100 to 100",
            &shown,
        )?;
        ensure(
            left + right > 1e-4 && up + down > 1e-4,
            "field-of-view tangents",
            "left + right > 0 and up + down > 0",
            &shown,
        )?;
    }
    ensure(
        (0.0..=MAX_IPD_M).contains(&hmd.ipd_m),
        "distance between the eyes",
        "0 to 1000 mm, or more in a scene of another scale, up to 1000000 m",
        format_args!("{} mm", hmd.ipd_m * 1000.0),
    )?;
    ensure(
        (-45.0..=45.0).contains(&hmd.cant_deg),
        "cant",
        "-45 to 45 degrees",
        format_args!("{} degrees", hmd.cant_deg),
    )
}

/// Pixels between the images of a point straight ahead at depth `z_m` in parallel on-axis eyes:
/// `W / (2 tan(h/2)) * IPD / z`.
pub fn disparity_px(hmd: &Hmd, z_m: f32) -> f32 {
    let fov = &hmd.fov[0];
    hmd.eye_size_px[0] as f32 / (fov.left + fov.right) * hmd.ipd_m / z_m
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_preset_is_valid_and_names_its_source() {
        for name in PRESETS {
            let hmd = preset(name).unwrap();
            assert_eq!(validate(&hmd), Ok(()));
            assert!(!hmd.source.is_empty());
        }
        let error = preset("rift").unwrap_err().to_string();
        assert!(error.contains("'rift'") && error.contains("dk2"), "{error}");
    }

    /// The half-angles that the sources print beside the tangents, in the head's coordinates (after
    /// the cant) for the sides. They reveal a mistyped tangent. None where the source gives the
    /// angles of the lens's mesh instead.
    #[test]
    fn half_angles_of_presets_match_their_sources() {
        let published = [
            (
                "rift-s",
                [Some(44.00), Some(46.00), Some(45.00), Some(49.00)],
            ),
            ("index", [None, None, Some(54.73), Some(54.63)]),
            (
                "pimax-5k-plus",
                [Some(70.14), Some(43.39), Some(51.78), Some(51.78)],
            ),
            (
                "pimax-8k",
                [Some(70.14), Some(43.39), Some(52.56), Some(52.56)],
            ),
            ("quest3", [Some(54.00), Some(40.00), None, None]),
        ];
        for (name, published) in published {
            let hmd = preset(name).unwrap();
            let fov = hmd.fov[0];
            let degrees = |tangent: f32| tangent.atan().to_degrees();
            let found = [
                degrees(fov.left) + hmd.cant_deg,
                degrees(fov.right) - hmd.cant_deg,
                degrees(fov.up),
                degrees(fov.down),
            ];
            for (found, published) in found.into_iter().zip(published) {
                let off = published.map_or(0.0, |published: f32| found - published);
                assert!(off.abs() < 0.01, "{name}: {found} {published:?}");
            }
            let outer = degrees(hmd.fov[1].right) - degrees(fov.left);
            assert!(
                outer.abs() < 0.1,
                "{name}: the right eye is no mirror image"
            );
        }
    }

    #[test]
    fn the_default_has_square_pixels() {
        let hmd = preset("symmetric-100").unwrap();
        let fov = hmd.fov[0];
        assert!((fov.left - 1.191_753_6).abs() < 1e-6);
        let per_pixel = (fov.left + fov.right) / 960.0 - (fov.up + fov.down) / 1080.0;
        assert!(per_pixel.abs() < 1e-9);
    }

    #[test]
    fn figures_out_of_range_are_named() {
        let good = preset("symmetric-100").unwrap();
        let mut bad = [good.clone(), good.clone(), good.clone(), good.clone(), good];
        bad[0].eye_size_px = [0, 1080];
        bad[1].fov[1].left = f32::NAN;
        bad[2].fov[0].up = -bad[2].fov[0].down;
        bad[3].ipd_m = -0.01;
        bad[4].cant_deg = f32::INFINITY;
        for (hmd, part) in bad
            .iter()
            .zip(["0x1080", "NaN", "up + down", "-10 mm", "inf degrees"])
        {
            let error = validate(hmd).unwrap_err().to_string();
            assert!(error.contains(part), "{error}");
        }
    }
}
