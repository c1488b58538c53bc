use super::*;
use crate::texture::ColorSpace;
use proptest::prelude::*;
use std::collections::HashSet;

fn texture(size: [u32; 2], levels: u32, layers: u32, format: TexelFormat) -> Texture {
    Texture {
        name: "t".to_owned(),
        size,
        levels,
        layers,
        format,
        color_space: ColorSpace::Srgb,
        part: None,
    }
}

fn config(block_order: BlockOrder) -> LayoutConfig {
    LayoutConfig {
        block_order,
        shadow_map_order: block_order,
        ..LayoutConfig::default()
    }
}

const ORDERS: [BlockOrder; 3] = [BlockOrder::Linear, BlockOrder::Morton, BlockOrder::Tiled];

#[test]
fn linear_bc1_puts_neighbouring_blocks_eight_bytes_apart() {
    let textures = [texture([16, 8], 1, 1, TexelFormat::Bc1)];
    let layout = Layout::new(&textures, &config(BlockOrder::Linear)).unwrap();
    let at = |x, y| layout.address(0, 0, 0, [x, y]).unwrap();
    assert_eq!(
        [at(0, 0), at(3, 3), at(4, 0), at(0, 4), at(15, 7)],
        [0, 0, 8, 32, 56]
    );
    assert_eq!(layout.end(), 64);
}

#[test]
fn morton_of_a_wide_level_interleaves_the_common_bits() {
    let placement = BlockPlacement::new(BlockOrder::Morton, [4, 2]);
    let row = |y| (0..4).map(|x| placement.index([x, y])).collect::<Vec<_>>();
    assert_eq!(row(0), [0, 1, 4, 5]);
    assert_eq!(row(1), [2, 3, 6, 7]);
}

#[test]
fn tiles_of_uncompressed_texels_are_four_lines_of_sixteen_bytes() {
    let textures = [texture([8, 8], 1, 1, TexelFormat::R32f)];
    let layout = Layout::new(&textures, &config(BlockOrder::Tiled)).unwrap();
    let at = |x, y| layout.address(0, 0, 0, [x, y]).unwrap();
    assert_eq!([at(1, 0), at(0, 1), at(4, 0), at(0, 4)], [4, 16, 64, 128]);
}

/// L1 sets of the Z2 paper's machine: 8 KiB, four ways, 16-byte lines.
const L1_SETS: u64 = 128;

#[test]
fn a_column_of_a_shadow_map_uses_many_sets_unless_the_map_is_linear() {
    let textures = [texture([2048, 2048], 1, 4, TexelFormat::R32f)];
    let sets = |config: &LayoutConfig| {
        let layout = Layout::new(&textures, config).unwrap();
        let set = |y| layout.address(0, 1, 0, [77, y]).unwrap() / 16 % L1_SETS;
        (0..64).map(set).collect::<HashSet<u64>>().len()
    };
    // Two rows share a line of 2x2 texels. The bits of y below the seventh address bit select the set.
    assert_eq!(sets(&LayoutConfig::default()), 8);
    let linear = LayoutConfig {
        shadow_map_order: BlockOrder::Linear,
        ..LayoutConfig::default()
    };
    assert_eq!(sets(&linear), 1);
    assert_eq!(sets(&config(BlockOrder::Tiled)), 4);
}

#[test]
fn each_kind_of_texture_has_its_own_order() {
    let textures = [
        texture([16, 16], 1, 1, TexelFormat::Rgba8),
        texture([16, 16], 1, 1, TexelFormat::R32f),
    ];
    let below = |config: &LayoutConfig| {
        let layout = Layout::new(&textures, config).unwrap();
        let at = |texture, y| layout.address(texture, 0, 0, [0, y]).unwrap();
        [0, 1].map(|texture| at(texture, 1) - at(texture, 0))
    };
    assert_eq!(below(&LayoutConfig::default()), [64, 8]);
    let other = LayoutConfig {
        block_order: BlockOrder::Tiled,
        shadow_map_order: BlockOrder::Linear,
        ..LayoutConfig::default()
    };
    assert_eq!(below(&other), [16, 64]);
}

#[test]
fn bases_are_aligned_and_in_the_configured_order() {
    let textures = [
        texture([4, 4], 1, 1, TexelFormat::Bc1),
        texture([64, 64], 1, 1, TexelFormat::Bc1),
    ];
    let bases = |config: &LayoutConfig| {
        let layout = Layout::new(&textures, config).unwrap();
        layout.textures().iter().map(|t| t.base).collect::<Vec<_>>()
    };
    assert_eq!(bases(&LayoutConfig::default()), [0, 64]);
    let pages = LayoutConfig {
        base_align_bytes: PAGE_ALIGNMENT_BYTES,
        ..LayoutConfig::default()
    };
    assert_eq!(bases(&pages), [0, 65536]);
    let largest = LayoutConfig {
        texture_order: TextureOrder::LargestFirst,
        ..LayoutConfig::default()
    };
    assert_eq!(bases(&largest), [2048, 0]);
}

#[test]
fn a_format_override_leaves_shadow_maps_alone() {
    let textures = [
        texture([8, 8], 1, 1, TexelFormat::Bc1),
        texture([8, 8], 1, 4, TexelFormat::R32f),
    ];
    let config = LayoutConfig {
        texel_format: Some(TexelFormat::Astc8x8),
        ..LayoutConfig::default()
    };
    let layout = Layout::new(&textures, &config).unwrap();
    let formats: Vec<_> = layout.textures().iter().map(|t| t.format).collect();
    assert_eq!(formats, [TexelFormat::Astc8x8, TexelFormat::R32f]);
    assert_eq!(layout.end(), 64 + 4 * 256);
}

#[test]
fn a_part_lies_in_the_memory_of_its_texture() {
    let whole = texture([64, 32], 7, 4, TexelFormat::Rgba8);
    let part = Texture {
        size: [32, 16],
        levels: 3,
        layers: 2,
        part: Some(Part {
            of: 1,
            level: 1,
            layer: 2,
        }),
        ..whole.clone()
    };
    let other = texture([8, 8], 1, 1, TexelFormat::Rgba8);
    let textures = [part.clone(), whole, other];
    for order in [TextureOrder::Table, TextureOrder::LargestFirst] {
        let config = LayoutConfig {
            texture_order: order,
            ..LayoutConfig::default()
        };
        let layout = Layout::new(&textures, &config).unwrap();
        for (layer, level, at) in [(0, 0, [31, 15]), (1, 2, [3, 1])] {
            let address = layout.address(0, layer, level, at);
            assert!(address.is_some());
            assert_eq!(address, layout.address(1, layer + 2, level + 1, at));
            let found = layout.block_at(address.unwrap()).map(|found| found.texture);
            assert_eq!(found, Some(1));
        }
        assert_eq!(
            layout.end(),
            Layout::new(&textures[1..], &config).unwrap().end()
        );
    }
    let alone = Layout::new(&[part], &LayoutConfig::default());
    assert!(
        alone
            .as_ref()
            .is_err_and(|broken| broken.expected == "a part of another texture"),
        "{alone:?}"
    );
}

#[test]
fn an_alignment_that_is_not_a_power_of_two_is_refused() {
    let config = LayoutConfig {
        base_align_bytes: 48,
        ..LayoutConfig::default()
    };
    let text = Layout::new(&[], &config).unwrap_err().to_string();
    assert_eq!(
        text,
        "base alignment: expected a power of two of bytes, found 48"
    );
}

#[test]
fn textures_beyond_the_address_space_are_refused() {
    let huge = texture([1 << 16, 1 << 16], 1, 1 << 16, TexelFormat::R32f);
    let textures = vec![huge; 1 << 14];
    assert!(Layout::new(&textures, &LayoutConfig::default()).is_err());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]
    /// Every block of every level and layer of every texture has its own bytes.
    #[test]
    fn no_two_blocks_share_an_address(
        width in 1..40u32, height in 1..40u32, layers in 1..3u32, order in 0..3usize,
        format in prop::sample::select(vec![
            TexelFormat::Bc1, TexelFormat::Bc7, TexelFormat::Astc5x5, TexelFormat::Rgba8,
        ]),
    ) {
        let levels = width.max(height).ilog2() + 1;
        let textures = [
            texture([width, height], levels, layers, format),
            texture([height, width], levels, layers, TexelFormat::R32f),
        ];
        let layout = Layout::new(&textures, &config(ORDERS[order])).unwrap();
        let mut seen = HashSet::new();
        for (index, texture) in textures.iter().enumerate() {
            let block = layout.textures()[index].block;
            for layer in 0..layers {
                for level in 0..levels {
                    let [w, h] = texture.level_size(level);
                    for y in (0..h).step_by(block.texels[1] as usize) {
                        for x in (0..w).step_by(block.texels[0] as usize) {
                            let at = layout.address(index as u32, layer, level, [x, y]).unwrap();
                            prop_assert!(at + u64::from(block.bytes) <= layout.end());
                            prop_assert_eq!(at % u64::from(block.bytes), 0);
                            prop_assert!(seen.insert(at));
                        }
                    }
                }
            }
        }
    }
}

proptest! {
    /// Every address of a block maps back to the block, for any order of blocks and textures.
    #[test]
    fn blocks_are_found_by_their_addresses(
        shapes in prop::collection::vec((1_u32..70, 1_u32..70, 1_u32..4, 0_usize..3), 1..4),
        order in 0_usize..3,
        largest_first in any::<bool>(),
    ) {
        let formats = [TexelFormat::Bc1, TexelFormat::Astc6x6, TexelFormat::R32f];
        let textures: Vec<Texture> = shapes.iter().map(|&(width, height, layers, format)| {
            let levels = width.max(height).ilog2() + 1;
            texture([width, height], levels, layers, formats[format])
        }).collect();
        let config = LayoutConfig {
            texture_order: if largest_first { TextureOrder::LargestFirst } else { TextureOrder::Table },
            ..config(ORDERS[order])
        };
        let layout = Layout::new(&textures, &config).unwrap();
        for (index, of) in (0..).zip(&textures) {
            let edge = of.format.block().texels;
            for (layer, level) in (0..of.layers).flat_map(|layer| (0..of.levels).map(move |level| (layer, level))) {
                let size = of.level_size(level);
                for (y, x) in (0..size[1].div_ceil(edge[1])).flat_map(|y| (0..size[0].div_ceil(edge[0])).map(move |x| (y, x))) {
                    let address = layout.address(index, layer, level, [x * edge[0], y * edge[1]]).unwrap();
                    let last = address + u64::from(of.format.block().bytes) - 1;
                    let expected = Some(BlockAt { texture: index, layer, level, block: [x, y] });
                    prop_assert_eq!(layout.block_at(address), expected);
                    prop_assert_eq!(layout.block_at(last), expected);
                }
            }
        }
        prop_assert_eq!(layout.block_at(layout.end()), None);
    }
}
