use super::super::{Footprint, footprints};
use super::*;
use crate::textrace::Sample;
use crate::texture::{ColorSpace, TexelFormat, Texture};
use proptest::prelude::*;
use std::collections::BTreeSet;

const SIZE: u32 = 1024;

fn texture() -> Texture {
    Texture {
        name: String::new(),
        size: [SIZE; 2],
        levels: 11,
        layers: 1,
        format: TexelFormat::Rgba8,
        color_space: ColorSpace::Linear,
    }
}

fn fixed(texels: f64) -> i32 {
    (texels * f64::from(SUBTEXELS)).round() as i32
}

/// A quad of one lane with derivatives in texels.
fn record(at: [f64; 2], dx: [f64; 2], dy: [f64; 2]) -> QuadRecord {
    QuadRecord {
        mask: 1,
        uv: at.map(fixed),
        dx: dx.map(fixed),
        dy: dy.map(fixed),
        ..QuadRecord::default()
    }
}

fn options(max_anisotropy: u32, anisotropy: AnisotropyModel) -> SamplingOptions {
    SamplingOptions {
        max_anisotropy,
        anisotropy,
        lod: LodFormula::Exact,
        ..SamplingOptions::default()
    }
}

fn all(record: &QuadRecord, options: &SamplingOptions) -> Vec<Footprint> {
    let sample = Sample {
        texture: 0,
        sampler: 0,
        layer: 0,
        offset: [0; 2],
    };
    let mut found = Vec::new();
    let sampler = Sampler::TRILINEAR_REPEAT;
    footprints(
        record,
        [SIZE; 2],
        &sample,
        &texture(),
        &sampler,
        options,
        |f| found.push(f),
    );
    found
}

#[test]
fn four_to_one_is_four_probes_on_the_level_of_the_shorter_axis() {
    // 16 texels along x, 4 along y: N = 4, level log2(16 / 4) = 2, and level 3 with nothing of it.
    let quad = record([512.0, 512.0], [16.0, 0.0], [0.0, 4.0]);
    let found = all(&quad, &options(16, AnisotropyModel::Probes));
    let level = |level: u8| found.iter().filter(move |f| f.level == level);
    assert_eq!((level(2).count(), level(3).count(), found.len()), (4, 4, 8));
    // At i/5 - 1/2 of 16 texels: -4.8, -1.6, 1.6, 4.8 of level 0, a quarter of it on level 2.
    let columns: Vec<u32> = level(2).map(|f| f.i[0]).collect();
    assert_eq!(columns, [126, 127, 127, 128]);
    assert!(level(2).all(|f| f.j == [127, 128]));
}

#[test]
fn the_maximum_bounds_the_probes_and_coarsens_the_level() {
    let quad = record([512.0, 512.0], [0.0, 64.0], [2.0, 0.0]);
    for (most, count, level) in [(16, 16, 2), (4, 4, 4), (2, 2, 5), (1, 1, 6)] {
        let found = all(&quad, &options(most, AnisotropyModel::Probes));
        assert_eq!((found.len(), found[0].level), (2 * count, level), "{most}");
    }
}

#[test]
fn pixels_as_wide_as_long_or_no_longer_than_a_texel_are_filtered_as_ever() {
    for (dx, dy) in [
        ([8.0, 0.0], [0.0, 8.0]),
        ([0.9, 0.0], [0.0, 0.01]),
        ([0.0, 0.0], [0.0, 0.0]),
    ] {
        let quad = record([300.25, 17.5], dx, dy);
        for model in [AnisotropyModel::Probes, AnisotropyModel::Ellipse] {
            // A circle's ellipse is more than a bilinear footprint.
            if model == AnisotropyModel::Ellipse && dx[0] > 1.0 {
                continue;
            }
            assert_eq!(
                all(&quad, &options(16, model)),
                all(&quad, &options(1, model))
            );
        }
    }
}

/// The count of probes and their places as the extension's text has them, in floating point.
fn by_the_extension(dx: [f64; 2], dy: [f64; 2], most: u32) -> (u32, f64, Vec<[f64; 2]>) {
    let (px, py) = (dx[0].hypot(dx[1]), dy[0].hypot(dy[1]));
    let (p_max, p_min) = (px.max(py), px.min(py));
    let n = (p_max / p_min).ceil().min(f64::from(most));
    let axis = if px >= py { dx } else { dy };
    let places = (1..=n as u32).map(|i| axis.map(|d| d * (f64::from(i) / (n + 1.0) - 0.5)));
    (n as u32, (p_max / n).log2(), places.collect())
}

proptest! {
    #[test]
    fn probes_lie_where_the_extension_says(
        d in prop::array::uniform4(-300.0_f64..300.0),
        most in 2_u32..=16,
    ) {
        let (dx, dy) = ([d[0], d[1]], [d[2], d[3]]);
        let (count, lod, places) = by_the_extension(dx, dy, most);
        let (px, py) = (dx[0].hypot(dx[1]), dy[0].hypot(dy[1]));
        let ratio = px.max(py) / px.min(py);
        // Next to a whole number rounding decides.
        prop_assume!(px.max(py) > 1.1 && (ratio - ratio.round()).abs() > 1e-2);
        let quad = record([100.0, 900.0], dx, dy);
        let sampler = Sampler::TRILINEAR_REPEAT;
        let options = options(most, AnisotropyModel::Probes);
        match Reach::of(&quad, [SIZE; 2], [SIZE; 2], 11, &sampler, &options) {
            Reach::Isotropic => prop_assert_eq!(count, 1),
            Reach::Probes(probes) => {
                prop_assert_eq!(probes.count, count);
                prop_assert!((f64::from(probes.lod) - lod).abs() < 1e-2, "{} {lod}", probes.lod);
                for (probe, place) in (0..).zip(&places) {
                    let offset = probes.offset(probe).map(|o| f64::from(o) / f64::from(SUBTEXELS));
                    for axis in 0..2 {
                        prop_assert!((offset[axis] - place[axis]).abs() < 0.01, "{offset:?} {place:?}");
                    }
                }
            }
            Reach::Ellipse(_) => prop_assert!(false),
        }
    }

    #[test]
    fn blocks_hold_every_texel_of_the_ellipse_and_none_is_without_one(
        d in prop::array::uniform4(-40.0_f64..40.0),
        at in prop::array::uniform2(300.0_f64..700.0),
    ) {
        let quad = record(at, [d[0], d[1]], [d[2], d[3]]);
        let sampler = Sampler::TRILINEAR_REPEAT;
        let options = options(8, AnisotropyModel::Ellipse);
        let reach = Reach::of(&quad, [SIZE; 2], [SIZE; 2], 11, &sampler, &options);
        let Reach::Ellipse(ellipse) = reach else {
            return Ok(());
        };
        let size = SIZE >> ellipse.level;
        let blocks: Vec<[i64; 2]> = ellipse.blocks(quad.uv, [size; 2], [SIZE; 2]).collect();
        // The distance of a texel's centre by the inverse of the pixel's own matrix, a texel wider.
        let scale = f64::from(SUBTEXELS) * f64::from(1_u32 << ellipse.level);
        let [[ux, vx], [uy, vy]] = [quad.dx, quad.dy].map(|d| d.map(|d| f64::from(d) / scale));
        let (m, n, o) = (ux * ux + uy * uy + 1.0, ux * vx + uy * vy, vx * vx + vy * vy + 1.0);
        let det = m * o - n * n;
        let mut expected = BTreeSet::new();
        for y in 0..i64::from(size) {
            for x in 0..i64::from(size) {
                let [u, v] = [(x, quad.uv[0]), (y, quad.uv[1])]
                    .map(|(texel, c)| texel as f64 + 0.5 - f64::from(c) / scale);
                let distance = (o * u * u - 2.0 * n * u * v + m * v * v) / det;
                // On the rim rounding decides.
                prop_assume!((distance - 1.0).abs() > 1e-9);
                if distance < 1.0 {
                    expected.insert([y & !1, x & !1]);
                }
            }
        }
        let expected: Vec<[i64; 2]> = expected.into_iter().map(|[y, x]| [x, y]).collect();
        prop_assert_eq!(blocks, expected);
    }
}

#[test]
fn no_bias_makes_an_ellipse_without_end() {
    let quad = record([512.0; 2], [900.0, 0.0], [0.0, 900.0]);
    let mut sharp = options(16, AnisotropyModel::Ellipse);
    sharp.lod_bias = -16.0;
    let found = all(&quad, &sharp);
    assert_eq!(found[0].level, 5, "900 texels are 28 on level 5");
    assert!(found.len() < 1000, "{}", found.len());
}
