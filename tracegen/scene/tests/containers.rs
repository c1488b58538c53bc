//! KTX2 and DDS images as other programs write them: levels to be made, views, uncompressed texels, and
//! legacy names of formats.

use formats::texture::TexelFormat;
use scene::{Image, LoadOptions, load_file};
use serde_json::json;
use std::io::Cursor;
use std::path::Path;

/// The only image of a scene, or the error.
fn image(folder: &Path, bytes: &[u8]) -> Result<Image, String> {
    let corners = [[0.0_f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let mut mesh: Vec<u8> = corners
        .iter()
        .flatten()
        .flat_map(|v| v.to_le_bytes())
        .collect();
    mesh.extend([0; 24]);
    let scene = json!({
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "textures": [{"source": 0}],
        "images": [{"uri": "image"}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
            {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC2"}
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": 36, "byteStride": 0},
            {"buffer": 0, "byteOffset": 36, "byteLength": 24}
        ],
        "buffers": [{"byteLength": 60, "uri": "mesh.bin?v=3#x"}]
    });
    std::fs::write(folder.join("scene.gltf"), scene.to_string()).unwrap();
    std::fs::write(folder.join("mesh.bin"), mesh).unwrap();
    std::fs::write(folder.join("image"), bytes).unwrap();
    let loaded = load_file(&folder.join("scene.gltf"), &LoadOptions::ALL);
    loaded
        .map(|mut loaded| loaded.scene.images.remove(0))
        .map_err(|e| e.to_string())
}

/// Format with levels and levels that the file holds, if blocks are kept, and the bytes.
type Found = (Option<(TexelFormat, u32, u32)>, Vec<u8>);

fn read(bytes: &[u8]) -> Result<Found, String> {
    let folder = tempfile::tempdir().unwrap();
    let image = image(folder.path(), bytes)?;
    let stored = image.stored.map(|s| (s.format, s.levels, s.held));
    let opened = image.source.open().map_err(|e| e.to_string())?;
    let texels = opened.texels(&[0]).map_err(|e| e.to_string())?.remove(0);
    Ok((stored, texels))
}

/// A KTX2 file by the specification's layout, with a block descriptor without samples.
fn ktx2(
    vk_format: u32,
    size: [u32; 2],
    levels: &[&[u8]],
    level_count: u32,
    keys: &[(&str, &str)],
) -> Vec<u8> {
    let descriptor: Vec<u8> = [28_u32, 0, 24 << 16 | 2, 0, 0, 0, 0]
        .iter()
        .flat_map(|w| w.to_le_bytes())
        .collect();
    let mut values = Vec::new();
    for (key, value) in keys {
        let entry = format!("{key}\0{value}\0");
        values.extend((entry.len() as u32).to_le_bytes());
        values.extend(entry.as_bytes());
        values.resize(values.len().next_multiple_of(4), 0);
    }
    let descriptor_at = 80 + 24 * levels.len() as u32;
    let values_at = descriptor_at + descriptor.len() as u32;
    let data = (values_at as usize + values.len()).next_multiple_of(16);
    let mut bytes = b"\xabKTX 20\xbb\r\n\x1a\n".to_vec();
    let header = [
        vk_format,
        1,
        size[0],
        size[1],
        0,
        0,
        1,
        level_count,
        0,
        descriptor_at,
        28,
        values_at,
        values.len() as u32,
        0,
        0,
        0,
        0,
    ];
    bytes.extend(header.iter().flat_map(|w| w.to_le_bytes()));
    let mut at = data as u64;
    for level in levels {
        let length = level.len() as u64;
        bytes.extend([at, length, length].iter().flat_map(|w| w.to_le_bytes()));
        at += length;
    }
    bytes.extend(descriptor);
    bytes.extend(values);
    bytes.resize(data, 0);
    levels.iter().for_each(|level| bytes.extend(*level));
    bytes
}

/// A DDS file: flags, code, bits and masks of its pixels.
fn dds(code: &[u8; 4], pixels: [u32; 6], extended: &[u32], mips: u32, data: &[u8]) -> Vec<u8> {
    let [flags, bits, masks @ ..] = pixels;
    let mut words = vec![124, 0x1007, 4, 4, data.len() as u32, 0, mips];
    words.extend([0; 11]);
    words.extend([32, flags, u32::from_le_bytes(*code), bits]);
    words.extend(masks);
    words.extend([0x1000, 0, 0, 0, 0]);
    words.extend(extended);
    let mut bytes = b"DDS ".to_vec();
    bytes.extend(words.iter().flat_map(|w| w.to_le_bytes()));
    bytes.extend(data);
    bytes
}

/// A file of Basis Universal as an encoder writes it with a level count of 0: with level 0 alone.
fn without_levels(file: &[u8]) -> Vec<u8> {
    let mut file = file.to_vec();
    let number = |file: &[u8], at: usize| u64::from_le_bytes(file[at..at + 8].try_into().unwrap());
    let levels = u32::from_le_bytes(file[40..44].try_into().unwrap());
    file[40..44].fill(0);
    let (global, global_bytes) = (number(&file, 64), number(&file, 72));
    if global_bytes > 0 {
        // The global data of ETC1S begin with 20 bytes, and with as many for each level.
        let gone = 20 * (u64::from(levels) - 1);
        let rest = (global + 20 + 20) as usize;
        file.drain(rest..rest + gone as usize);
        file[72..80].copy_from_slice(&(global_bytes - gone).to_le_bytes());
        let first_level = number(&file, 80) - gone;
        file[80..88].copy_from_slice(&first_level.to_le_bytes());
    }
    file
}

#[test]
fn a_file_without_levels_asks_for_all_of_them() {
    for (vk_format, format, bytes) in [
        (43, TexelFormat::Rgba8, 1024),
        (133, TexelFormat::Bc1, 128),
        (146, TexelFormat::Bc7, 256),
        (158, TexelFormat::Astc4x4, 256),
    ] {
        let base = vec![0; bytes];
        let (stored, _) = read(&ktx2(vk_format, [16, 16], &[&base], 0, &[])).unwrap();
        assert_eq!(stored, Some((format, 5, 1)));
        let (stored, _) = read(&ktx2(vk_format, [16, 16], &[&base], 1, &[])).unwrap();
        assert_eq!(stored, Some((format, 1, 1)), "one level is one level");
    }
    for (file, format) in [
        (&include_bytes!("images/uastc.ktx2")[..], TexelFormat::Bc7),
        (include_bytes!("images/etc1s.ktx2"), TexelFormat::Bc1),
        (include_bytes!("images/etc1s-alpha.ktx2"), TexelFormat::Bc3),
    ] {
        let (whole, texels) = read(file).unwrap();
        let made = read(&without_levels(file)).unwrap();
        assert_eq!(made, (Some((format, 5, 1)), texels));
        assert_eq!(whole, Some((format, 5, 5)));
    }
}

#[test]
fn uncompressed_formats_are_read() {
    // VkFormat, bytes of two texels, the texture's format, and what is read.
    for (vk_format, bytes, format, texels) in [
        (
            9,
            &[1, 2][..],
            TexelFormat::R8,
            [1, 0, 0, 255, 2, 0, 0, 255],
        ),
        (
            16,
            &[1, 2, 3, 4],
            TexelFormat::Rg8,
            [1, 2, 0, 255, 3, 4, 0, 255],
        ),
        (
            29,
            &[1, 2, 3, 4, 5, 6],
            TexelFormat::Rgba8,
            [1, 2, 3, 255, 4, 5, 6, 255],
        ),
        (
            30,
            &[1, 2, 3, 4, 5, 6],
            TexelFormat::Rgba8,
            [3, 2, 1, 255, 6, 5, 4, 255],
        ),
        (
            50,
            &[1, 2, 3, 4, 5, 6, 7, 8],
            TexelFormat::Rgba8,
            [3, 2, 1, 4, 7, 6, 5, 8],
        ),
        (
            51,
            &[1, 2, 3, 4, 5, 6, 7, 8],
            TexelFormat::Rgba8,
            [1, 2, 3, 4, 5, 6, 7, 8],
        ),
        (
            4,
            &[0, 0xf8, 0x1f, 0],
            TexelFormat::Packed16,
            [255, 0, 0, 255, 0, 0, 255, 255],
        ),
        (
            8,
            &[0, 0x7c, 0, 0x80],
            TexelFormat::Packed16,
            [255, 0, 0, 0, 0, 0, 0, 255],
        ),
    ] {
        let (stored, found) = read(&ktx2(vk_format, [2, 1], &[bytes], 1, &[])).unwrap();
        assert_eq!(
            (stored, &found[..]),
            (Some((format, 1, 1)), &texels[..]),
            "{vk_format}"
        );
    }
    let error = read(&ktx2(97, [1, 1], &[&[0; 8]], 1, &[])).unwrap_err();
    assert!(error.contains("R16G16B16A16_SFLOAT"), "{error}");
}

#[test]
fn swizzles_and_orientations_are_applied_or_refused() {
    let rows: Vec<u8> = (0..4).flat_map(|i| [i, 10 + i, 20 + i, 30 + i]).collect();
    let reds = |keys: &[(&str, &str)]| {
        let (_, texels) = read(&ktx2(37, [2, 2], &[&rows], 1, keys)).unwrap();
        texels.chunks(4).map(|t| t[0]).collect::<Vec<u8>>()
    };
    assert_eq!(reds(&[]), [0, 1, 2, 3]);
    assert_eq!(reds(&[("KTXorientation", "rd")]), [0, 1, 2, 3]);
    assert_eq!(reds(&[("KTXorientation", "ru")]), [2, 3, 0, 1]);
    assert_eq!(reds(&[("KTXorientation", "lu")]), [3, 2, 1, 0]);
    assert_eq!(reds(&[("KTXswizzle", "barg")]), [20, 21, 22, 23]);
    assert_eq!(
        reds(&[("KTXorientation", "ld"), ("KTXswizzle", "1g0a")]),
        [255; 4]
    );
    let (_, grey) = read(&ktx2(9, [1, 1], &[&[7]], 1, &[("KTXswizzle", "rrr1")])).unwrap();
    assert_eq!(grey, [7, 7, 7, 255]);
    for (key, value) in [
        ("KTXswizzle", "rgbx"),
        ("KTXswizzle", "rgb"),
        ("KTXorientation", "up"),
        ("KTXorientation", "r"),
    ] {
        let error = read(&ktx2(37, [2, 2], &[&rows], 1, &[(key, value)])).unwrap_err();
        assert!(error.contains(key) && error.contains(value), "{error}");
    }
}

#[test]
fn a_texel_block_of_256_texels_is_refused() {
    for at in 0..4 {
        let mut bytes = ktx2(43, [1, 1], &[&[0; 4]], 1, &[]);
        // Behind the header, one level, the descriptor's length and its first three words.
        bytes[80 + 24 + 4 + 12 + at] = 255;
        let error = read(&bytes).unwrap_err();
        assert!(error.contains("1 to 255 texels"), "{error}");
    }
}

#[test]
fn dds_is_read_by_legacy_codes_and_masks() {
    let none = [4, 0, 0, 0, 0, 0];
    for (code, format, bytes) in [
        (b"DXT1", TexelFormat::Bc1, 8),
        (b"ATI1", TexelFormat::Bc4, 8),
        (b"BC4U", TexelFormat::Bc4, 8),
        (b"ATI2", TexelFormat::Bc5, 16),
        (b"BC5U", TexelFormat::Bc5, 16),
    ] {
        for mips in [0, 1] {
            let (stored, _) = read(&dds(code, none, &[], mips, &vec![0; bytes])).unwrap();
            assert_eq!(stored, Some((format, 1, 1)), "{code:?}");
        }
    }
    for (pixels, format, texel, shown) in [
        (
            [0x41, 32, 0xff_0000, 0xff00, 0xff, 0xff00_0000],
            TexelFormat::Rgba8,
            &[1, 2, 3, 4][..],
            [3, 2, 1, 4],
        ),
        (
            [0x40, 32, 0xff_0000, 0xff00, 0xff, 0],
            TexelFormat::Rgba8,
            &[1, 2, 3, 4],
            [3, 2, 1, 255],
        ),
        (
            [0x40, 24, 0xff_0000, 0xff00, 0xff, 0],
            TexelFormat::Rgba8,
            &[1, 2, 3],
            [3, 2, 1, 255],
        ),
        (
            [0x40, 16, 0xf800, 0x7e0, 0x1f, 0],
            TexelFormat::Packed16,
            &[0, 0xf8],
            [255, 0, 0, 255],
        ),
        (
            [0x2_0000, 8, 0xff, 0, 0, 0],
            TexelFormat::R8,
            &[9],
            [9, 9, 9, 255],
        ),
        (
            [0x2_0001, 16, 0xff, 0, 0, 0xff00],
            TexelFormat::Rg8,
            &[9, 8],
            [9, 9, 9, 8],
        ),
    ] {
        let (stored, texels) = read(&dds(&[0; 4], pixels, &[], 0, &texel.repeat(16))).unwrap();
        assert_eq!(stored, Some((format, 1, 1)), "{pixels:x?}");
        assert_eq!(texels[..4], shown, "{pixels:x?}");
    }
    let extended = [87, 3, 0, 1, 0];
    let (stored, texels) =
        read(&dds(b"DX10", none, &extended, 1, &[1, 2, 3, 4].repeat(16))).unwrap();
    assert_eq!(
        (stored.map(|s| s.0), &texels[..4]),
        (Some(TexelFormat::Rgba8), &[3, 2, 1, 4][..])
    );
    for (bytes, named) in [
        (dds(b"BC5S", none, &[], 1, &[0; 16]), "BC5S"),
        (
            dds(
                &[0; 4],
                [0x41, 32, 0x3ff, 0xf_fc00, 0x3ff0_0000, 0xc000_0000],
                &[],
                1,
                &[0; 64],
            ),
            "masks",
        ),
    ] {
        let error = read(&bytes).unwrap_err();
        assert!(error.contains(named), "{error}");
    }
}

#[test]
fn an_image_beyond_the_largest_size_names_the_limit() {
    let mut bytes = Cursor::new(Vec::new());
    image::GrayImage::new(16385, 1)
        .write_to(&mut bytes, image::ImageFormat::Png)
        .unwrap();
    let error = read(&bytes.into_inner()).unwrap_err();
    assert!(
        error.contains("16384x16384") && error.contains("16385x1"),
        "{error}"
    );
}
