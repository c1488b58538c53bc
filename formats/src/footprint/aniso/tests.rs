use super::super::{Footprint, footprints};
use super::*;
use crate::textrace::{LodRule, Sample, SampleLevel};
use crate::texture::{ColorSpace, Filter, MipFilter, TexelFormat, Texture};
use proptest::prelude::*;
use std::collections::BTreeSet;

const SIZE: u32 = 1024;

fn texture() -> Texture {
    Texture {
        name: String::new(),
        size: [SIZE; 2],
        levels: 11,
        layers: 4,
        format: TexelFormat::Rgba8,
        color_space: ColorSpace::Linear,
        part: None,
    }
}

fn fixed(texels: f64) -> i32 {
    (texels * f64::from(SUBTEXELS)).round() as i32
}

/// A quad with one covered lane and derivatives in texels.
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
        max_anisotropy: Some(max_anisotropy),
        anisotropy,
        lod: LodFormula::Exact,
        ..SamplingOptions::default()
    }
}

fn all(record: &QuadRecord, options: &SamplingOptions) -> Vec<Footprint> {
    read(
        record,
        None,
        SampleLevel::DERIVED,
        &Sampler::TRILINEAR_REPEAT,
        options,
    )
}

/// Footprints in a texture of four layers.
fn read(
    record: &QuadRecord,
    operands: Option<&QuadRecord>,
    level: SampleLevel,
    sampler: &Sampler,
    options: &SamplingOptions,
) -> Vec<Footprint> {
    let sample = Sample {
        level,
        ..Sample::default()
    };
    let mut found = Vec::new();
    let extent = [SIZE; 2];
    let texture = texture();
    let add = |f| found.push(f);
    footprints(
        record, operands, extent, &sample, &texture, sampler, options, add,
    );
    found
}

/// A trilinear sampler with this largest anisotropy.
fn anisotropic(most: f32) -> Sampler {
    Sampler {
        max_anisotropy_256ths: (256.0 * most) as u16,
        ..Sampler::TRILINEAR_REPEAT
    }
}

#[test]
fn four_to_one_is_four_probes_on_the_level_of_the_shorter_axis() {
    // 16 texels along x, 4 along y: N = 4, level log2(16 / 4) = 2, without level 3.
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
fn the_recorded_anisotropy_counts_unless_the_replay_has_its_own() {
    let quad = record([512.0, 512.0], [0.0, 64.0], [2.0, 0.0]);
    let recorded = SamplingOptions {
        max_anisotropy: None,
        ..options(1, AnisotropyModel::Probes)
    };
    let derived = SampleLevel::DERIVED;
    for most in [1, 2, 5, 16] {
        let chosen = options(most, AnisotropyModel::Probes);
        let found = read(&quad, None, derived, &anisotropic(most as f32), &recorded);
        assert_eq!(found, all(&quad, &chosen), "{most}");
        let overridden = read(&quad, None, derived, &anisotropic(3.0), &chosen);
        assert_eq!(overridden, found, "{most}");
    }
    // 2.5 of 32: three probes on log2(64 / 2.5) = 4.7.
    let found = read(&quad, None, derived, &anisotropic(2.5), &recorded);
    assert_eq!((found.len(), found[0].level), (6, 4));
}

#[test]
fn a_recorded_anisotropy_counts_with_any_filter_but_a_replays_only_where_levels_are_blended() {
    let quad = record([512.0, 512.0], [8.0, 0.0], [0.0, 1.0]);
    let chosen = options(16, AnisotropyModel::Probes);
    for (min, mip) in [
        (Filter::Nearest, MipFilter::Linear),
        (Filter::Linear, MipFilter::None),
    ] {
        let sampler = |most| Sampler {
            min,
            mip,
            ..anisotropic(most)
        };
        let count = |sampler: Sampler, options: &SamplingOptions| {
            let found = read(&quad, None, SampleLevel::DERIVED, &sampler, options);
            (found.len(), found[0].level)
        };
        assert_eq!(count(sampler(16.0), &SamplingOptions::default()), (8, 0));
        let plain = count(sampler(1.0), &SamplingOptions::default());
        assert_eq!(count(sampler(1.0), &chosen), plain);
        assert!(plain.0 < 8, "{plain:?}");
    }
}

#[test]
fn layers_and_biases_of_lanes_are_filtered_anisotropically_and_explicit_levels_are_not() {
    let quad = record([512.0, 512.0], [16.0, 0.0], [0.0, 4.0]);
    // A bias of 1 and layer 3.
    let operands = QuadRecord {
        uv: [1.0, 3.0].map(fixed),
        ..record([1.0, 3.0], [0.0; 2], [0.0; 2])
    };
    let by = |rule| {
        let level = SampleLevel {
            rule,
            lod_256ths: 0,
            operands: true,
        };
        let options = SamplingOptions::default();
        let found = read(&quad, Some(&operands), level, &anisotropic(16.0), &options);
        assert!(found.iter().all(|f| f.layer == 3), "{found:?}");
        (found.len(), found[0].level)
    };
    // Four probes on level log2(16 / 4) = 2, on which the level of detail is exact.
    assert_eq!(by(LodRule::Derivatives), (8, 2));
    assert_eq!(by(LodRule::Bias), (8, 3));
    assert_eq!(by(LodRule::Explicit), (2, 1));
}

#[test]
fn pixels_that_are_square_or_no_longer_than_a_texel_are_filtered_isotropically() {
    for (dx, dy) in [
        ([8.0, 0.0], [0.0, 8.0]),
        ([0.9, 0.0], [0.0, 0.01]),
        ([0.0, 0.0], [0.0, 0.0]),
    ] {
        let quad = record([300.25, 17.5], dx, dy);
        for model in [AnisotropyModel::Probes, AnisotropyModel::Ellipse] {
            // A circular ellipse covers more texels than a bilinear footprint.
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

/// What a quad reads of a texture with all its levels.
fn reach(quad: &QuadRecord, options: &SamplingOptions) -> Reach {
    let sampler = Sampler::TRILINEAR_REPEAT;
    Reach::of(quad, [SIZE; 2], [SIZE; 2], 11, &sampler, options)
}

#[test]
fn only_the_rounded_ratio_drops_a_level_for_a_pixel_that_is_slightly_longer_than_wide() {
    let quad = record([512.0, 512.0], [8.08, 0.0], [0.0, 8.0]);
    for (model, lod) in [
        (AnisotropyModel::Probes, 3.0),
        (AnisotropyModel::RoundedProbes, 4.04_f32.log2()),
    ] {
        match reach(&quad, &options(16, model)) {
            Reach::Probes(probes) => {
                assert_eq!(probes.count, 2);
                assert!((probes.lod - lod).abs() < 1e-3, "{model:?} {}", probes.lod);
            }
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn small_changes_of_the_ratio_change_the_level_little() {
    // Widths of 4 texels, lengths from 4.01 on; the rounded ratio jumps at each integer.
    let lod = |model, length: f64| {
        let quad = record([512.0, 512.0], [0.0, length], [4.0, 0.0]);
        match reach(&quad, &options(4, model)) {
            Reach::Probes(probes) => probes.lod,
            other => panic!("{length}: {other:?}"),
        }
    };
    let largest_step = |model| {
        let lods: Vec<f32> = (1..800)
            .map(|i| lod(model, 4.0 + f64::from(i) / 50.0))
            .collect();
        let steps = lods.windows(2).map(|pair| (pair[1] - pair[0]).abs());
        steps.fold(0.0, f32::max)
    };
    assert!(largest_step(AnisotropyModel::Probes) < 0.01);
    assert!(largest_step(AnisotropyModel::RoundedProbes) > 0.5);
}

#[test]
fn with_a_level_per_lane_each_lane_reads_the_same_as_alone() {
    // From 2:1 in the first lane to 10:1 in the last one.
    let quad = QuadRecord {
        mask: 15,
        cross: [24.0, -1.0].map(fixed),
        ..record([512.0, 300.0], [16.0, 1.0], [2.0, 8.0])
    };
    for model in [
        AnisotropyModel::Probes,
        AnisotropyModel::RoundedProbes,
        AnisotropyModel::Ellipse,
    ] {
        let exact = options(16, model);
        let per_lane = SamplingOptions {
            lod: LodFormula::PerLane,
            ..exact
        };
        let mut found = all(&quad, &per_lane);
        assert!(found.windows(2).all(|pair| pair[0].level <= pair[1].level));
        let levels: BTreeSet<u8> = found.iter().map(|f| f.level).collect();
        assert!(levels.len() > 1, "{model:?} {levels:?}");
        let alone = (0..4).flat_map(|lane| {
            let add =
                |d: [i32; 2], add: bool| [0, 1].map(|a| d[a] + i32::from(add) * quad.cross[a]);
            let own = QuadRecord {
                mask: 1,
                uv: quad.lane_uv(lane),
                dx: add(quad.dx, lane > 1),
                dy: add(quad.dy, lane % 2 == 1),
                cross: [0; 2],
                ..quad
            };
            let lane = lane as u8;
            all(&own, &exact)
                .into_iter()
                .map(move |f| Footprint { lane, ..f })
        });
        let mut alone: Vec<Footprint> = alone.collect();
        let key = |f: &Footprint| (f.lane, f.level, f.i, f.j);
        alone.sort_by_key(key);
        found.sort_by_key(key);
        assert_eq!(found, alone, "{model:?}");
    }
}

/// Number of probes, their level and their positions in floating point, from the text of the Vulkan
/// specification; with `rounded`, the level from the example of `EXT_texture_filter_anisotropic`.
fn by_specification(
    dx: [f64; 2],
    dy: [f64; 2],
    most: u32,
    rounded: bool,
) -> (u32, f64, Vec<[f64; 2]>) {
    let (px, py) = (dx[0].hypot(dx[1]), dy[0].hypot(dy[1]));
    let (p_max, p_min) = (px.max(py), px.min(py));
    let ratio = (p_max / p_min).min(f64::from(most));
    let n = ratio.ceil();
    let axis = if px >= py { dx } else { dy };
    let places = (1..=n as u32).map(|i| axis.map(|d| d * (f64::from(i) / (n + 1.0) - 0.5)));
    let narrowed = p_max / if rounded { n } else { ratio };
    (n as u32, narrowed.log2(), places.collect())
}

proptest! {
    #[test]
    fn probes_are_at_the_specified_positions(
        d in prop::array::uniform4(-300.0_f64..300.0),
        most in 2_u32..=16,
        rounded in any::<bool>(),
    ) {
        let (dx, dy) = ([d[0], d[1]], [d[2], d[3]]);
        let (count, lod, places) = by_specification(dx, dy, most, rounded);
        let (px, py) = (dx[0].hypot(dx[1]), dy[0].hypot(dy[1]));
        let ratio = px.max(py) / px.min(py);
        // Near an integer, the result depends on rounding.
        prop_assume!(px.max(py) > 1.1 && (ratio - ratio.round()).abs() > 1e-2);
        let quad = record([100.0, 900.0], dx, dy);
        let model = match rounded {
            true => AnisotropyModel::RoundedProbes,
            false => AnisotropyModel::Probes,
        };
        let options = options(most, model);
        match reach(&quad, &options) {
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
    fn blocks_hold_every_texel_of_the_ellipse_and_each_holds_at_least_one(
        d in prop::array::uniform4(-40.0_f64..40.0),
        at in prop::array::uniform2(300.0_f64..700.0),
    ) {
        let quad = record(at, [d[0], d[1]], [d[2], d[3]]);
        let options = options(8, AnisotropyModel::Ellipse);
        let Reach::Ellipse(ellipse) = reach(&quad, &options) else {
            return Ok(());
        };
        let size = SIZE >> ellipse.level;
        let blocks: Vec<[i64; 2]> = ellipse.blocks(quad.uv, [size; 2], [SIZE; 2]).collect();
        // Distance of a texel's centre from the inverse of the pixel's matrix, one texel wider.
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
                // On the boundary, the result depends on rounding.
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
fn a_bias_cannot_make_an_ellipse_unbounded() {
    let quad = record([512.0; 2], [900.0, 0.0], [0.0, 900.0]);
    let mut sharp = options(16, AnisotropyModel::Ellipse);
    sharp.lod_bias = -16.0;
    let found = all(&quad, &sharp);
    assert_eq!(found[0].level, 5, "900 texels are 28 on level 5");
    assert!(found.len() < 1000, "{}", found.len());
}
