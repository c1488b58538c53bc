use super::*;
use crate::textrace::SampleLevel;
use crate::texture::{ColorSpace, LodRange, TexelFormat};
use proptest::prelude::*;

fn texture(size: [u32; 2], levels: u32) -> Texture {
    Texture {
        name: String::new(),
        size,
        levels,
        layers: 1,
        format: TexelFormat::Bc1,
        color_space: ColorSpace::Linear,
        part: None,
    }
}

/// A quad whose lanes are `step` texels of a 256x256 texture apart, with the first at `at`.
fn record(at: [f64; 2], step: f64) -> QuadRecord {
    let fixed = |texels: f64| (texels * f64::from(SUBTEXELS)).round() as i32;
    QuadRecord {
        mask: 15,
        uv: at.map(fixed),
        dx: [fixed(step), 0],
        dy: [0, fixed(step)],
        ..QuadRecord::default()
    }
}

const SAMPLE: Sample = Sample {
    texture: 0,
    sampler: 0,
    layer: 3,
    offset: [0, 0],
    level: SampleLevel::DERIVED,
};

fn all(
    record: &QuadRecord,
    sample: &Sample,
    sampler: &Sampler,
    options: &SamplingOptions,
) -> Vec<Footprint> {
    let mut found = Vec::new();
    let texture = texture([256; 2], 9);
    let add = |f| found.push(f);
    footprints(
        record, None, [256; 2], sample, &texture, sampler, options, add,
    );
    found
}

#[test]
fn fast_log2_is_exact_at_powers_of_two_and_slightly_low_between() {
    for exponent in -20..20 {
        assert_eq!(fast_log2(2f32.powi(exponent)), exponent as f32);
    }
    for step in 0..1000 {
        let x = 1.0 + step as f32 / 1000.0;
        let error = x.log2() - fast_log2(x);
        assert!((-1e-6..0.0861).contains(&error), "{x}: {error}");
    }
}

#[test]
fn level_of_detail_counts_octaves_of_minification() {
    for octave in 0..6 {
        let quad = record([10.0; 2], f64::from(1 << octave));
        let lod = quad_lod(&quad, [256; 2], [256; 2], LodFormula::Llvmpipe);
        assert_eq!(lod, octave as f32);
        // A texture of the same group with half the size has half the derivatives.
        let lod = quad_lod(&quad, [256; 2], [128; 2], LodFormula::Llvmpipe);
        assert_eq!(lod, octave as f32 - 1.0);
    }
}

#[test]
fn trilinear_reads_two_levels_between_the_first_and_the_last() {
    let levels = |lod| {
        let selection = select_levels(lod, &Sampler::TRILINEAR_REPEAT, 9);
        (selection.first, selection.count)
    };
    assert_eq!(levels(-63.5), (0, 1));
    assert_eq!(levels(0.0), (0, 1));
    assert_eq!(levels(0.01), (0, 2));
    assert_eq!(levels(3.7), (3, 2));
    assert_eq!(levels(7.99), (7, 2));
    assert_eq!(levels(8.0), (8, 1));
    assert_eq!(levels(40.0), (8, 1));
}

#[test]
fn a_magnified_quad_takes_the_mag_filter() {
    let sampler = Sampler {
        mag: Filter::Nearest,
        ..Sampler::TRILINEAR_REPEAT
    };
    let found = all(
        &record([10.75; 2], 0.25),
        &SAMPLE,
        &sampler,
        &SamplingOptions::default(),
    );
    assert_eq!(found.len(), 4);
    assert_eq!((found[0].i, found[0].j), ([10, 10], [10, 10]));
    assert_eq!(found[0].texels().count(), 1);
}

#[test]
fn a_texel_centre_reads_the_texel_and_its_right_and_lower_neighbours() {
    let found = all(
        &record([10.5, 20.5], 1.0),
        &SAMPLE,
        &Sampler::TRILINEAR_REPEAT,
        &SamplingOptions::default(),
    );
    let first = found[0];
    assert_eq!((first.i, first.j, first.layer), ([10, 11], [20, 21], 3));
    let texels: Vec<_> = first.texels().collect();
    assert_eq!(texels, [[10, 20], [11, 20], [10, 21], [11, 21]]);
}

#[test]
fn lanes_with_their_own_levels_read_level_by_level() {
    let per_lane = SamplingOptions {
        lod: LodFormula::PerLane,
        ..SamplingOptions::default()
    };
    let exact = SamplingOptions {
        lod: LodFormula::Exact,
        ..SamplingOptions::default()
    };
    let read = |quad: &QuadRecord, options: &SamplingOptions| -> Vec<_> {
        let found = all(quad, &SAMPLE, &Sampler::TRILINEAR_REPEAT, options);
        found.iter().map(|f| (f.level, f.lane)).collect()
    };
    // An affine mapping has the same derivatives in every lane.
    let quad = record([10.5, 20.5], 2.5);
    assert_eq!(read(&quad, &per_lane), read(&quad, &exact));
    // Twice the step in the lower row and in the right column.
    let quad = QuadRecord {
        cross: [quad.dx[0], quad.dy[1]],
        ..quad
    };
    let expected = [
        (1, 0),
        (2, 0),
        (2, 1),
        (2, 2),
        (2, 3),
        (3, 1),
        (3, 2),
        (3, 3),
    ];
    assert_eq!(read(&quad, &per_lane), expected);
    let lane_lod = |lane| {
        let own = lane_record(&quad, lane);
        quad_lod(&own, [256; 2], [256; 2], LodFormula::PerLane)
    };
    assert_eq!(lane_lod(0), 2.5_f32.log2());
    // One row on and one column on: (5, 2.5) and (2.5, 5).
    let corner = lane_lod(3);
    assert!(
        (corner - 0.5 * (25.0_f32 + 6.25).log2()).abs() < 1e-6,
        "{corner}"
    );
}

#[test]
fn levels_come_before_lanes() {
    let quad = QuadRecord {
        mask: 0b1010,
        ..record([10.5, 20.5], 2.5)
    };
    let order = |options: &SamplingOptions| -> Vec<_> {
        let found = all(&quad, &SAMPLE, &Sampler::TRILINEAR_REPEAT, options);
        found.iter().map(|f| (f.level, f.lane)).collect()
    };
    let options = SamplingOptions::default();
    assert_eq!(order(&options), [(1, 1), (1, 3), (2, 1), (2, 3)]);
    let helpers = SamplingOptions {
        helper_lanes: true,
        lod_bias: 1.0,
        filter: FilterOverride::Bilinear,
        ..options
    };
    assert_eq!(order(&helpers), [(2, 0), (2, 1), (2, 2), (2, 3)]);
}

#[test]
fn offsets_move_by_texels_of_the_sampled_level() {
    let sample = Sample {
        offset: [-2, 1],
        ..SAMPLE
    };
    let quad = record([1.0, 255.0], 1.0);
    let found = all(
        &quad,
        &sample,
        &Sampler::SHADOW,
        &SamplingOptions::default(),
    );
    assert_eq!(
        (found[0].i, found[0].j),
        ([0, 0], [255, 255]),
        "clamped at both corners"
    );
    let repeat = Sampler {
        mip: MipFilter::None,
        ..Sampler::TRILINEAR_REPEAT
    };
    let found = all(&quad, &sample, &repeat, &SamplingOptions::default());
    assert_eq!(
        (found[0].i, found[0].j),
        ([254, 255], [255, 0]),
        "wrapped at both corners"
    );
}

#[test]
fn mirrored_coordinates_fold_at_every_edge() {
    let folded: Vec<u32> = (-5..9)
        .map(|t| wrap_texel(t, 4, Wrap::MirroredRepeat).unwrap())
        .collect();
    assert_eq!(folded, [3, 3, 2, 1, 0, 0, 1, 2, 3, 3, 2, 1, 0, 0]);
    let once: Vec<u32> = (-6..6)
        .map(|t| wrap_texel(t, 4, Wrap::MirrorClampToEdge).unwrap())
        .collect();
    assert_eq!(once, [3, 3, 3, 2, 1, 0, 0, 1, 2, 3, 3, 3]);
}

#[test]
fn texels_of_a_border_are_not_read() {
    let border = Sampler {
        wrap: [Wrap::ClampToBorder; 2],
        ..Sampler::SHADOW
    };
    // The lanes' left texels are -2, -1, -2, -1 in u; their upper ones 10, 10, 11, 11 in v.
    let quad = record([-1.5, 10.5], 1.0);
    let found = all(&quad, &SAMPLE, &border, &SamplingOptions::default());
    let read: Vec<_> = found.iter().map(|f| (f.lane, f.i, f.j)).collect();
    assert_eq!(read, [(1, [0, 0], [10, 11]), (3, [0, 0], [11, 12])]);
}

#[test]
fn bias_and_bounds_of_a_sampler_apply_before_its_levels() {
    let of = |bias_256ths, min_256ths, max_256ths, lod| {
        let sampler = Sampler {
            lod: LodRange {
                bias_256ths,
                min_256ths,
                max_256ths,
            },
            ..Sampler::TRILINEAR_REPEAT
        };
        let chosen = select_levels(lod, &sampler, 9);
        (chosen.first, chosen.count)
    };
    assert_eq!(of(0, i16::MIN, i16::MAX, 2.5), (2, 2));
    assert_eq!(of(384, i16::MIN, i16::MAX, 2.5), (4, 2));
    assert_eq!(of(0, 768, i16::MAX, -7.0), (3, 2));
    assert_eq!(of(2560, 0, 256, 2.5), (1, 2));
}

/// Operands of a quad's lanes: the same level, layers 0, 1, 2 and 3.
fn operands(lod: f32) -> QuadRecord {
    QuadRecord {
        mask: 15,
        uv: [(lod * SUBTEXELS as f32) as i32, 0],
        dx: [0, SUBTEXELS],
        dy: [0, 2 * SUBTEXELS],
        ..QuadRecord::default()
    }
}

#[test]
fn operands_choose_level_and_layer_of_each_lane() {
    let levels = |rule, lod_256ths, has_operands, scale: f64| {
        let sample = Sample {
            layer: 1,
            level: SampleLevel {
                rule,
                lod_256ths,
                operands: has_operands,
            },
            ..SAMPLE
        };
        let array = Texture {
            layers: 4,
            ..texture([256; 2], 9)
        };
        let (quad, options) = (record([64.5, 64.5], scale), SamplingOptions::default());
        let mut found = Vec::new();
        let add = |f: Footprint| found.push((f.level, f.lane, f.layer));
        let sampler = FilterOverride::Bilinear.apply(&Sampler::TRILINEAR_REPEAT);
        footprints(
            &quad,
            Some(&operands(2.25)),
            [256; 2],
            &sample,
            &array,
            &sampler,
            &options,
            add,
        );
        found
    };
    let on = |level| [(level, 0, 1), (level, 1, 2), (level, 2, 3), (level, 3, 3)];
    // Four texels per pixel: level 2 by the derivatives.
    assert_eq!(levels(LodRule::Derivatives, 0, true, 4.0), on(2));
    assert_eq!(levels(LodRule::Bias, 512, true, 4.0), on(6));
    assert_eq!(levels(LodRule::Explicit, 0, true, 4.0), on(2));
    assert_eq!(levels(LodRule::Explicit, 256, true, 4.0), on(3));
    let alone = |level| [0, 1, 2, 3].map(|lane| (level, lane, 1));
    assert_eq!(levels(LodRule::Explicit, 768, false, 4.0), alone(3));
    assert_eq!(levels(LodRule::Bias, 768, false, 4.0), alone(5));
}

proptest! {
    /// The integer formula against the floating-point definition, away from texel edges.
    #[test]
    fn texel_position_is_the_rounded_down_coordinate(
        coordinate in -40_000_000..40_000_000i32,
        size in 1..5000u32,
        extent in 1..5000u32,
    ) {
        let exact = f64::from(coordinate) * f64::from(size)
            / (f64::from(SUBTEXELS) * f64::from(extent));
        for (filter, half) in [(Filter::Linear, 0.5), (Filter::Nearest, 0.0)] {
            let position = exact - half;
            if (position - position.round()).abs() > 1e-6 {
                let texel = texel_before_wrap(coordinate, size, extent, filter);
                prop_assert_eq!(texel, position.floor() as i64);
            }
        }
    }

    #[test]
    fn coordinates_repeat_after_a_whole_texture(
        u in -1000.0..1000.0f64, v in -1000.0..1000.0f64, step in 0.01..100.0f64,
    ) {
        let quad = record([u, v], step);
        let mut later = quad;
        later.uv[0] += 256 * SUBTEXELS;
        let read = |quad| {
            all(quad, &SAMPLE, &Sampler::TRILINEAR_REPEAT, &SamplingOptions::default())
        };
        prop_assert_eq!(read(&quad), read(&later));
    }
}
