//! Image formats, compared with the texels from which the images were made.

use super::files::File;
use super::rows::{Row, Status};
use ddsfile::{AlphaMode, D3D10ResourceDimension, Dds, DxgiFormat, NewDxgiParams};
use formats::texture::TexelFormat;
use scene::Loaded;
use scene::blocks::{ImageData, level_bytes, level_size};
use std::io::Cursor;

const TEST: &str = "scene/tests/conformance/images.rs";
const SIZE: u32 = 16;
const UASTC: &[u8] = include_bytes!("../images/uastc.ktx2");
const UASTC_ZSTD: &[u8] = include_bytes!("../images/uastc-zstd.ktx2");
const ETC1S: &[u8] = include_bytes!("../images/etc1s.ktx2");
const ETC1S_ALPHA: &[u8] = include_bytes!("../images/etc1s-alpha.ktx2");

/// A row of an image in a file: its name, extension and bytes.
macro_rules! row {
    ($feature:literal, $how:literal, $extension:literal, $name:literal, $bytes:expr, $check:expr) => {
        Row {
            feature: $feature,
            status: Status::Drawn,
            how: $how,
            load: |folder| {
                File::quad()
                    .with_image(folder, $extension, $name, &$bytes)
                    .load(folder)
            },
            check: $check,
            test: TEST,
        }
    };
}

pub const ROWS: &[Row] = &[
    row!("image: PNG", "RGBA8", "", "a.png", pixels("png"), |l, f| {
        near(l, f, 0, false)
    }),
    row!(
        "image: JPEG",
        "RGBA8",
        "",
        "a.jpg",
        pixels("jpeg"),
        |l, f| near(l, f, 40, false)
    ),
    Row {
        feature: "image files in other letter case or with backslashes",
        status: Status::Drawn,
        how: "found, with a warning; buffers as well",
        load: |folder| {
            std::fs::create_dir(folder.join("maps")).unwrap();
            let mut file = File::quad().with_image(folder, "", "maps/Paint.png", &pixels("png"));
            file.json["images"][0]["uri"] = "MAPS\\paint.PNG".into();
            file.load(folder)
        },
        check: |l, f| {
            near(l, f, 0, false);
            assert_eq!(l.scene.images[0].name, "Paint.png", "{f}");
            assert!(l.warnings[0].contains("is taken from"), "{:?}", l.warnings);
        },
        test: TEST,
    },
    row!(
        "EXT_texture_webp",
        "RGBA8",
        "EXT_texture_webp",
        "a.webp",
        pixels("webp"),
        |l, f| {
            near(l, f, 0, false);
        }
    ),
    row!(
        "KHR_texture_basisu: UASTC",
        "blocks become BC7",
        "KHR_texture_basisu",
        "a.ktx2",
        UASTC,
        |l, f| {
            stored(l, f, TexelFormat::Bc7, 5);
            near(l, f, 8, true);
        }
    ),
    row!(
        "KHR_texture_basisu: UASTC, Zstandard",
        "blocks become BC7",
        "KHR_texture_basisu",
        "a.ktx2",
        UASTC_ZSTD,
        |l, f| {
            stored(l, f, TexelFormat::Bc7, 5);
            near(l, f, 8, false);
        }
    ),
    row!(
        "KHR_texture_basisu: ETC1S",
        "blocks become BC1",
        "KHR_texture_basisu",
        "a.ktx2",
        ETC1S,
        |l, f| {
            stored(l, f, TexelFormat::Bc1, 5);
            near(l, f, 48, false);
        }
    ),
    row!(
        "KHR_texture_basisu: ETC1S with alpha",
        "blocks become BC3",
        "KHR_texture_basisu",
        "a.ktx2",
        ETC1S_ALPHA,
        |l, f| {
            stored(l, f, TexelFormat::Bc3, 5);
            near(l, f, 48, true);
        }
    ),
    row!(
        "KTX2: BC1",
        "blocks and levels kept",
        "",
        "a.ktx2",
        ktx2(133, TexelFormat::Bc1),
        |l, f| kept(l, f, TexelFormat::Bc1)
    ),
    row!(
        "KTX2: BC3",
        "blocks and levels kept",
        "",
        "a.ktx2",
        ktx2(138, TexelFormat::Bc3),
        |l, f| kept(l, f, TexelFormat::Bc3)
    ),
    row!(
        "KTX2: BC7",
        "blocks and levels kept",
        "",
        "a.ktx2",
        ktx2(146, TexelFormat::Bc7),
        |l, f| kept(l, f, TexelFormat::Bc7)
    ),
    row!(
        "KTX2: ETC2 RGB8",
        "blocks and levels kept; drawn from RGBA8",
        "",
        "a.ktx2",
        ktx2(148, TexelFormat::Etc2),
        |l, f| kept(l, f, TexelFormat::Etc2)
    ),
    row!(
        "KTX2: ETC2 RGBA8",
        "blocks and levels kept; drawn from RGBA8",
        "",
        "a.ktx2",
        ktx2(152, TexelFormat::Etc2Rgba),
        |l, f| kept(l, f, TexelFormat::Etc2Rgba)
    ),
    row!(
        "KTX2: ASTC 4x4",
        "blocks and levels kept; drawn from RGBA8",
        "",
        "a.ktx2",
        ktx2(158, TexelFormat::Astc4x4),
        |l, f| kept(l, f, TexelFormat::Astc4x4)
    ),
    row!(
        "KTX2: ASTC 8x8",
        "blocks and levels kept; drawn from RGBA8",
        "",
        "a.ktx2",
        ktx2(172, TexelFormat::Astc8x8),
        |l, f| kept(l, f, TexelFormat::Astc8x8)
    ),
    Row {
        feature: "KTX2: other formats",
        status: Status::Refused,
        how: "R16G16B16A16_SFLOAT",
        load: |folder| {
            let bytes = ktx2(97, TexelFormat::Rgba16);
            File::quad()
                .with_image(folder, "", "a.ktx2", &bytes)
                .load(folder)
        },
        check: |_, _| {},
        test: TEST,
    },
    row!(
        "MSFT_texture_dds: BC1",
        "blocks and levels kept",
        "MSFT_texture_dds",
        "a.dds",
        dds(DxgiFormat::BC1_UNorm_sRGB, TexelFormat::Bc1),
        |l, f| kept(l, f, TexelFormat::Bc1)
    ),
    row!(
        "MSFT_texture_dds: BC2",
        "blocks and levels kept; drawn from RGBA8",
        "MSFT_texture_dds",
        "a.dds",
        dds(DxgiFormat::BC2_UNorm_sRGB, TexelFormat::Bc2),
        |l, f| kept(l, f, TexelFormat::Bc2)
    ),
    row!(
        "MSFT_texture_dds: BC3",
        "blocks and levels kept",
        "MSFT_texture_dds",
        "a.dds",
        dds(DxgiFormat::BC3_UNorm_sRGB, TexelFormat::Bc3),
        |l, f| kept(l, f, TexelFormat::Bc3)
    ),
    row!(
        "MSFT_texture_dds: BC4",
        "blocks and levels kept; drawn from RGBA8",
        "MSFT_texture_dds",
        "a.dds",
        dds(DxgiFormat::BC4_UNorm, TexelFormat::Bc4),
        |l, f| kept(l, f, TexelFormat::Bc4)
    ),
    row!(
        "MSFT_texture_dds: BC5",
        "blocks and levels kept; drawn from RGBA8",
        "MSFT_texture_dds",
        "a.dds",
        dds(DxgiFormat::BC5_UNorm, TexelFormat::Bc5),
        |l, f| kept(l, f, TexelFormat::Bc5)
    ),
    row!(
        "MSFT_texture_dds: BC6H",
        "blocks and levels kept; drawn from RGBA8, 0 to 1",
        "MSFT_texture_dds",
        "a.dds",
        dds(DxgiFormat::BC6H_UF16, TexelFormat::Bc6h),
        |l, f| kept(l, f, TexelFormat::Bc6h)
    ),
    row!(
        "MSFT_texture_dds: BC7",
        "blocks and levels kept; drawn from RGBA8",
        "MSFT_texture_dds",
        "a.dds",
        dds(DxgiFormat::BC7_UNorm_sRGB, TexelFormat::Bc7),
        |l, f| kept(l, f, TexelFormat::Bc7)
    ),
    Row {
        feature: "EXT_texture_avif",
        status: Status::Refused,
        how: "EXT_texture_avif",
        load: |folder| {
            File::quad()
                .with_image(folder, "EXT_texture_avif", "a.avif", b"")
                .load(folder)
        },
        check: |_, _| {},
        test: TEST,
    },
];

/// The source of all images: red along x, green along y. Alpha decreases along x if it is used.
fn texel(x: u32, y: u32, alpha: bool) -> [u8; 4] {
    let a = if alpha { 255 - x * 12 } else { 255 };
    [x as u8 * 16, y as u8 * 16, 64, a as u8]
}

fn pixels(format: &str) -> Vec<u8> {
    let format = image::ImageFormat::from_extension(format).unwrap();
    let image = image::RgbImage::from_fn(SIZE, SIZE, |x, y| {
        let [r, g, b, _] = texel(x, y, false);
        image::Rgb([r, g, b])
    });
    let mut bytes = Cursor::new(Vec::new());
    image.write_to(&mut bytes, format).unwrap();
    bytes.into_inner()
}

/// Level 0 of the only image equals the source image to `tolerance` per channel.
fn near(loaded: &Loaded, feature: &str, tolerance: u8, alpha: bool) {
    let image = &loaded.scene.images[0];
    assert_eq!(image.size, [SIZE; 2], "{feature}");
    let texels = image.source.open().unwrap().texels(&[0]).unwrap().remove(0);
    for y in 0..SIZE {
        for x in 0..SIZE {
            let found = &texels[((y * SIZE + x) * 4) as usize..][..4];
            let expected = texel(x, y, alpha);
            let off = found.iter().zip(expected).map(|(a, b)| a.abs_diff(b)).max();
            assert!(
                off <= Some(tolerance),
                "{feature}, {x} {y}: {found:?} {expected:?}"
            );
        }
    }
}

fn stored(loaded: &Loaded, feature: &str, format: TexelFormat, levels: usize) -> Vec<Vec<u8>> {
    let image = &loaded.scene.images[0];
    let data = image.source.open().unwrap().data(&[0]).unwrap().remove(0);
    let ImageData::Blocks(blocks) = data else {
        panic!("{feature}: no blocks")
    };
    assert_eq!(
        (blocks.format, blocks.levels.len()),
        (format, levels),
        "{feature}"
    );
    assert_eq!(
        image.stored.map(|s| (s.format, s.levels as usize)),
        Some((format, levels))
    );
    blocks.levels
}

/// Arbitrary bytes that no encoder produces, to check that blocks are kept unchanged.
fn level(format: TexelFormat, number: u32) -> Vec<u8> {
    let bytes = level_bytes(format, level_size([SIZE; 2], number));
    (0..bytes).map(|i| (i as u32 * 7 + number) as u8).collect()
}

fn kept(loaded: &Loaded, feature: &str, format: TexelFormat) {
    for (number, found) in (0..).zip(stored(loaded, feature, format, 3)) {
        assert_eq!(found, level(format, number), "{feature}, level {number}");
    }
    let decoded = loaded.scene.images[0]
        .source
        .open()
        .unwrap()
        .texels(&[0])
        .unwrap();
    assert_eq!(decoded[0].len(), (SIZE * SIZE * 4) as usize, "{feature}");
}

/// A KTX2 file of three levels, by the specification's layout.
fn ktx2(vk_format: u32, format: TexelFormat) -> Vec<u8> {
    const HEADER: u32 = 80;
    let levels: Vec<Vec<u8>> = (0..3).map(|number| level(format, number)).collect();
    let descriptor: Vec<u8> = {
        // A basic data format descriptor without samples.
        let words = [28_u32, 0, 24 << 16 | 2, 0, 0, 0, 0];
        words.iter().flat_map(|w| w.to_le_bytes()).collect()
    };
    let index_end = HEADER + 24 * levels.len() as u32;
    let data = (index_end + descriptor.len() as u32).next_multiple_of(16);
    let mut bytes = b"\xabKTX 20\xbb\r\n\x1a\n".to_vec();
    let mut word = |value: u32| bytes.extend(value.to_le_bytes());
    for value in [vk_format, 1, SIZE, SIZE, 0, 0, 1, levels.len() as u32, 0] {
        word(value);
    }
    for value in [index_end, descriptor.len() as u32, 0, 0, 0, 0, 0, 0] {
        word(value);
    }
    let mut at = u64::from(data);
    for level in &levels {
        for value in [at, level.len() as u64, level.len() as u64] {
            bytes.extend(value.to_le_bytes());
        }
        at += level.len() as u64;
    }
    bytes.extend(descriptor);
    bytes.resize(data as usize, 0);
    bytes.extend(levels.concat());
    bytes
}

fn dds(dxgi: DxgiFormat, format: TexelFormat) -> Vec<u8> {
    let params = NewDxgiParams {
        height: SIZE,
        width: SIZE,
        depth: None,
        format: dxgi,
        mipmap_levels: Some(3),
        array_layers: None,
        caps2: None,
        is_cubemap: false,
        resource_dimension: D3D10ResourceDimension::Texture2D,
        alpha_mode: AlphaMode::Straight,
    };
    let mut dds = Dds::new_dxgi(params).unwrap();
    let levels: Vec<Vec<u8>> = (0..3).map(|number| level(format, number)).collect();
    dds.data = levels.concat();
    let mut bytes = Vec::new();
    dds.write(&mut bytes).unwrap();
    bytes
}
