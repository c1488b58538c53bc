use super::*;
use crate::config::{AnisotropyModel, BlockOrder, FilterOverride, LayoutConfig, LodFormula};
use crate::stream::testing::tables;
use formats::footprint::{Footprint, record_footprints};
use formats::layout::Layout;
use formats::textrace::{LodRule, NO_GROUP, Sample, SampleLevel, UvGroup};
use formats::texture::{LodRange, MipFilter, TexelFormat, Wrap};
use proptest::prelude::*;

/// Texture, level and lines of a footprint.
type Read = (u32, u8, Vec<u32>);

/// Reads of the fast generator.
fn fast(tables: &Tables, config: &RunConfig, records: &[QuadRecord]) -> Vec<Read> {
    let footprints = Footprints::new(tables, config).unwrap();
    let mut reads = Vec::new();
    footprints.for_quad(
        0,
        records,
        &mut footprints.scratch(true),
        |sample, bundle| {
            let mut firsts = bundle.runs().map(|(first, _)| first).peekable();
            for index in 0..usize::from(bundle.count) {
                let lines: Vec<u32> = bundle
                    .lines_of(index)
                    .iter()
                    .map(|l| sample.base_line + l)
                    .collect();
                let same = index > 0 && reads.last().is_some_and(|(_, _, last)| *last == lines);
                assert_eq!(firsts.next_if_eq(&index).is_none(), same);
                reads.push((sample.texture, bundle.level, lines));
            }
        },
    );
    reads
}

/// Reads of the reference, texel by texel through the layout.
fn reference(tables: &Tables, config: &RunConfig, records: &[QuadRecord]) -> Vec<Read> {
    let layout = Layout::new(&tables.textures, &config.layout).unwrap();
    let mut reads = Vec::new();
    let mut read = |sample: &Sample, footprint: Footprint| {
        let mut lines = Vec::new();
        for texel in footprint.texels() {
            let at = layout
                .address(
                    sample.texture,
                    footprint.layer.into(),
                    footprint.level.into(),
                    texel,
                )
                .unwrap();
            let line = (at / u64::from(config.line_bytes)) as u32;
            if !lines.contains(&line) {
                lines.push(line);
            }
        }
        reads.push((sample.texture, footprint.level, lines));
    };
    for (record, operands) in with_operands(records) {
        record_footprints(tables, 0, record, operands, &config.sampling, &mut read);
    }
    reads
}

fn wrap() -> impl Strategy<Value = Wrap> {
    prop::sample::select(vec![
        Wrap::Repeat,
        Wrap::Repeat,
        Wrap::MirroredRepeat,
        Wrap::ClampToEdge,
        Wrap::ClampToBorder,
        Wrap::MirrorClampToEdge,
    ])
}

fn lod_range() -> impl Strategy<Value = LodRange> {
    let some = (-600_i16..600, -300_i16..600, 0_i16..2000).prop_map(|(bias, min, max)| LodRange {
        bias_256ths: bias,
        min_256ths: min,
        max_256ths: max,
    });
    prop_oneof![Just(LodRange::WHOLE), some]
}

fn level() -> impl Strategy<Value = SampleLevel> {
    let rules = vec![LodRule::Derivatives, LodRule::Bias, LodRule::Explicit];
    let some = (prop::sample::select(rules), -900_i16..2500, any::<bool>()).prop_map(
        |(rule, lod_256ths, operands)| SampleLevel {
            rule,
            lod_256ths: if rule == LodRule::Derivatives {
                0
            } else {
                lod_256ths
            },
            operands,
        },
    );
    prop_oneof![Just(SampleLevel::DERIVED), Just(SampleLevel::DERIVED), some]
}

fn filter() -> impl Strategy<Value = Filter> {
    prop::sample::select(vec![Filter::Nearest, Filter::Linear])
}

fn sampler() -> impl Strategy<Value = Sampler> {
    let mips = vec![
        MipFilter::None,
        MipFilter::Nearest,
        MipFilter::Linear,
        MipFilter::Linear,
    ];
    (
        wrap(),
        wrap(),
        filter(),
        filter(),
        prop::sample::select(mips),
        lod_range(),
        prop::sample::select(vec![256_u16, 256, 512, 700, 4096]),
    )
        .prop_map(
            |(u, v, mag, min, mip, lod, max_anisotropy_256ths)| Sampler {
                wrap: [u, v],
                mag,
                min,
                mip,
                lod,
                max_anisotropy_256ths,
            },
        )
}

fn config() -> impl Strategy<Value = RunConfig> {
    use FilterOverride::{AsRecorded, Bilinear, Nearest, Trilinear};
    use TexelFormat::{Astc5x5, Astc6x6, Bc1, Bc7, R32f, Rgba8};
    let block_order = || {
        prop::sample::select(vec![
            BlockOrder::Linear,
            BlockOrder::Morton,
            BlockOrder::Tiled,
        ])
    };
    let layout = (
        prop::sample::select(vec![
            None,
            Some(Bc1),
            Some(Bc7),
            Some(Astc5x5),
            Some(Astc6x6),
            Some(Rgba8),
            Some(R32f),
        ]),
        block_order(),
        block_order(),
        prop::sample::select(vec![16_u64, 64, 65536]),
    )
        .prop_map(
            |(texel_format, block_order, shadow_map_order, base_align_bytes)| LayoutConfig {
                texel_format,
                block_order,
                shadow_map_order,
                base_align_bytes,
                ..LayoutConfig::default()
            },
        );
    let sampling = (
        prop::sample::select(vec![AsRecorded, AsRecorded, Bilinear, Trilinear, Nearest]),
        prop::sample::select(vec![0.0_f32, 0.0, -1.5, 0.75]),
        prop::sample::select(vec![
            LodFormula::Llvmpipe,
            LodFormula::Softpipe,
            LodFormula::Exact,
            LodFormula::PerLane,
        ]),
        any::<bool>(),
        prop::sample::select(vec![None, None, Some(1), Some(2), Some(5), Some(16)]),
        prop::sample::select(vec![
            AnisotropyModel::Probes,
            AnisotropyModel::RoundedProbes,
            AnisotropyModel::Ellipse,
        ]),
    )
        .prop_map(
            |(filter, lod_bias, lod, helper_lanes, max_anisotropy, anisotropy)| SamplingConfig {
                filter,
                lod_bias,
                lod,
                helper_lanes,
                max_anisotropy,
                anisotropy,
            },
        );
    (layout, sampling, prop::sample::select(vec![16_u32, 32, 64])).prop_map(
        |(layout, sampling, line_bytes)| RunConfig {
            layout,
            sampling,
            line_bytes,
            ..RunConfig::default()
        },
    )
}

fn record() -> impl Strategy<Value = QuadRecord> {
    let near = || prop::array::uniform2(-6_000_000_i32..6_000_000);
    let slope = || prop::array::uniform2(prop_oneof![-9_000_i32..9_000, -900_000_i32..900_000]);
    let cross = prop::array::uniform2(-500_i32..500);
    (1_u8..16, near(), slope(), slope(), cross).prop_map(|(mask, uv, dx, dy, cross)| QuadRecord {
        mask,
        uv,
        dx,
        dy,
        cross,
        ..QuadRecord::default()
    })
}

/// A quad's record of group 1, after its operands.
fn quad() -> impl Strategy<Value = [QuadRecord; 2]> {
    let levels = prop::array::uniform2(-3_000_i32..20_000);
    let slope = || prop::array::uniform2(-4_000_i32..4_000);
    (record(), levels, slope(), slope()).prop_map(|(record, uv, dx, dy)| {
        let operands = QuadRecord {
            uv,
            dx,
            dy,
            cross: [0; 2],
            ..record
        };
        [operands, QuadRecord { group: 1, ..record }]
    })
}

/// One draw with a group of three textures, powers of two and not, with layers and offsets. Group 0 is its operands.
fn scene() -> impl Strategy<Value = Tables> {
    let size =
        || prop::array::uniform2(prop::sample::select(vec![1_u32, 5, 16, 64, 100, 256, 300]));
    let offset = prop::array::uniform2(-3_i8..4);
    (
        [size(), size(), size()],
        prop::collection::vec((0_u32..3, 0_u16..2, 0_u16..2, offset, level()), 1..6),
        sampler(),
    )
        .prop_map(|(sizes, samples, sampler)| {
            let mut tables = tables(&sizes);
            tables.textures.iter_mut().for_each(|t| t.layers = 2);
            tables.textures[2].format = TexelFormat::R32f;
            tables.textures[2].levels = 1;
            // The same filter for square pixels, so that samples differ by their samplers alone.
            tables.samplers = vec![
                sampler,
                Sampler {
                    max_anisotropy_256ths: 1024,
                    ..sampler
                },
            ];
            let extent = [0, 1].map(|a| sizes.iter().map(|s| s[a]).max().unwrap());
            let samples = samples
                .into_iter()
                .map(|(texture, sampler, layer, offset, level)| Sample {
                    texture,
                    sampler,
                    layer,
                    offset,
                    level,
                })
                .collect();
            let operands = UvGroup {
                extent: [1, 1],
                samples: Vec::new(),
            };
            tables.draws[0].groups = vec![operands, UvGroup { extent, samples }];
            tables
        })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn the_fast_generator_equals_the_reference(
        tables in scene(),
        config in config(),
        quads in prop::collection::vec(quad(), 4),
    ) {
        for quad in &quads {
            prop_assert_eq!(fast(&tables, &config, quad), reference(&tables, &config, quad));
        }
    }
}

#[test]
fn coordinates_at_the_ends_of_their_range_equal_the_reference() {
    let tables = tables(&[[256, 256], [100, 100]]);
    for uv in [i32::MIN, i32::MIN + 1, -1, 0, i32::MAX - 1, i32::MAX] {
        let record = QuadRecord {
            mask: 15,
            uv: [uv, !uv],
            dx: [2048, 0],
            dy: [0, 2048],
            ..QuadRecord::default()
        };
        let config = RunConfig::default();
        assert_eq!(
            fast(&tables, &config, &[record]),
            reference(&tables, &config, &[record])
        );
    }
}

#[test]
fn a_quad_without_a_group_reads_nothing() {
    let record = QuadRecord {
        mask: 15,
        group: NO_GROUP,
        ..QuadRecord::default()
    };
    assert!(fast(&tables(&[[64, 64]]), &RunConfig::default(), &[record]).is_empty());
}

#[test]
fn a_sample_of_a_missing_texture_is_refused() {
    let mut tables = tables(&[[64, 64]]);
    tables.draws[0].groups[0].samples[0].texture = 9;
    let error = Footprints::new(&tables, &RunConfig::default()).unwrap_err();
    assert_eq!(
        error.to_string(),
        "trace tables: a sample names texture 9, which does not exist"
    );
}
