//! Tests of quality with an independent decoder, of determinism, and of formats by material.

use super::*;
use crate::compress::{ENCODER, compress};
use glam::Affine3A;
use scene::{AlphaMode, Instance, Material, Mesh, TextureRef, TextureSlot};

/// A scene of one triangle whose material samples `image` as base colour.
fn scene_of(size: [u32; 2], rgba: Vec<u8>, alpha: AlphaMode) -> Scene {
    Scene {
        meshes: vec![Mesh::default()],
        instances: vec![Instance {
            mesh: 0,
            transform: Affine3A::IDENTITY,
        }],
        materials: vec![Material {
            textures: [(TextureSlot::BaseColor, Some(TextureRef::new(0)))].into(),
            alpha,
            ..Material::default()
        }],
        images: vec![Image::from_texels("test", size, ColorSpace::Srgb, rgba)],
        ..Scene::default()
    }
}

/// Smooth colours with some texture, and an alpha ramp along x.
fn picture(size: [u32; 2]) -> Vec<u8> {
    let mut rgba = Vec::new();
    for y in 0..size[1] {
        for x in 0..size[0] {
            let wave = ((x as f32 * 0.31).sin() * (y as f32 * 0.17).cos() * 30.0) as i32;
            let channel = |base: u32| (base as i32 * 200 / 256 + 28 + wave).clamp(0, 255) as u8;
            let (u, v) = (x * 255 / size[0], y * 255 / size[1]);
            rgba.extend([channel(u), channel(v), channel((u + v) / 2), u as u8]);
        }
    }
    rgba
}

/// Decodes level 0 with an independent decoder.
fn decode(texture: &CompressedTexture) -> Vec<u8> {
    let [width, height] = texture.texture.size.map(|e| e as usize);
    let mut rgba = vec![0; width * height * 4];
    let block_bytes = if texture.texture.format == TexelFormat::Bc1 {
        8
    } else {
        16
    };
    for (i, block) in texture
        .blocks
        .chunks(block_bytes)
        .take(width * height / 16)
        .enumerate()
    {
        let (x, y) = (i % (width / 4) * 4, i / (width / 4) * 4);
        let out = &mut rgba[(y * width + x) * 4..];
        match texture.texture.format {
            TexelFormat::Bc1 => bcdec_rs::bc1(block, out, width * 4),
            _ => bcdec_rs::bc3(block, out, width * 4),
        }
    }
    rgba
}

fn psnr_db(a: &[u8], b: &[u8], channels: std::ops::Range<usize>) -> f64 {
    let mut sum = 0.0;
    let mut count = 0.0;
    for (a, b) in a.chunks(4).zip(b.chunks(4)) {
        for c in channels.clone() {
            sum += (f64::from(a[c]) - f64::from(b[c])).powi(2);
            count += 1.0;
        }
    }
    10.0 * (255.0 * 255.0 * count / sum).log10()
}

#[test]
fn bc1_keeps_a_smooth_picture_above_36_db() {
    let rgba = picture([128, 128]);
    let set = TextureSet::compress(&scene_of([128, 128], rgba.clone(), AlphaMode::Opaque)).unwrap();
    let decoded = decode(&set.textures[0]);
    let psnr = psnr_db(&rgba, &decoded, 0..3);
    assert!(psnr > 36.0, "{psnr} dB");
    assert!(
        decoded.chunks(4).all(|t| t[3] == 255),
        "an opaque image has no holes"
    );
}

#[test]
fn levels_are_a_complete_chain_of_whole_blocks() {
    let set = TextureSet::compress(&scene_of([64, 16], picture([64, 16]), AlphaMode::Opaque));
    let texture = &set.unwrap().textures[0];
    // 64x16, 32x8, 16x4, 8x2, 4x1, 2x1, 1x1 in 4x4 blocks of 8 bytes.
    assert_eq!(
        texture.blocks.len(),
        8 * (16 * 4 + 8 * 2 + 4 + 2 + 1 + 1 + 1)
    );
    assert_eq!(texture.texture.levels, 7);
}

#[test]
fn a_masked_image_becomes_bc1_with_one_bit_alpha_at_the_cutoff() {
    let rgba = picture([64, 64]);
    let scene = scene_of([64, 64], rgba.clone(), AlphaMode::Mask(0.25));
    let texture = TextureSet::compress(&scene).unwrap().textures.remove(0);
    assert_eq!(texture.texture.format, TexelFormat::Bc1);
    let decoded = decode(&texture);
    for (source, texel) in rgba.chunks(4).zip(decoded.chunks(4)) {
        let expected = if f32::from(source[3]) / 255.0 >= 0.25 {
            255
        } else {
            0
        };
        assert_eq!(texel[3], expected);
    }
}

#[test]
fn a_blended_image_becomes_bc3_only_where_its_alpha_is_smooth() {
    let mut rgba = picture([64, 64]);
    let scene = scene_of([64, 64], rgba.clone(), AlphaMode::Blend);
    let texture = TextureSet::compress(&scene).unwrap().textures.remove(0);
    assert_eq!(texture.texture.format, TexelFormat::Bc3);
    let psnr = psnr_db(&rgba, &decode(&texture), 3..4);
    assert!(psnr > 45.0, "{psnr} dB");
    mipmap::make_opaque(&mut rgba);
    let opaque = TextureSet::compress(&scene_of([64, 64], rgba, AlphaMode::Blend)).unwrap();
    assert_eq!(opaque.textures[0].texture.format, TexelFormat::Bc1);
}

#[test]
fn the_bytes_do_not_depend_on_the_number_of_threads() {
    let scene = scene_of([256, 128], picture([256, 128]), AlphaMode::Mask(0.5));
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| TextureSet::compress(&scene).unwrap())
    };
    assert_eq!(with(1), with(3));
}

#[test]
fn sizes_that_are_not_whole_blocks_are_resampled_with_a_note() {
    let scene = scene_of([30, 17], picture([30, 17]), AlphaMode::Opaque);
    let set = TextureSet::compress(&scene).unwrap();
    assert_eq!(set.textures[0].texture.size, [32, 20]);
    assert!(set.notes[0].contains("30x17 to 32x20"), "{}", set.notes[0]);
}

#[test]
fn sizes_out_of_range_are_errors_that_name_the_image() {
    for size in [[0, 4], [4, 0], [20000, 4]] {
        let bytes = (size[0] * size[1] * 4) as usize;
        let error = TextureSet::compress(&scene_of(size, vec![0; bytes], AlphaMode::Opaque));
        let error = error.unwrap_err().to_string();
        let expected = format!("found {}x{}", size[0], size[1]);
        assert!(
            error.contains("'test'") && error.contains(&expected),
            "{error}"
        );
    }
}

#[test]
fn images_that_no_placed_mesh_samples_are_left_out() {
    let mut scene = scene_of([8, 8], picture([8, 8]), AlphaMode::Opaque);
    scene.images.push(scene.images[0].clone());
    let set = TextureSet::compress(&scene).unwrap();
    assert_eq!(set.of_image, [Some(0), None]);
    scene.instances.clear();
    assert!(TextureSet::compress(&scene).unwrap().textures.is_empty());
}

#[test]
fn a_cached_texture_equals_the_compressed_one() {
    let folder = tempfile::tempdir().unwrap();
    let cache = Cache::new(folder.path().to_owned(), 1 << 30);
    for alpha in [AlphaMode::Opaque, AlphaMode::Mask(0.3), AlphaMode::Blend] {
        let scene = scene_of([30, 16], picture([30, 16]), alpha);
        let fresh = TextureSet::compress(&scene).unwrap();
        let prepare = || TextureSet::prepare(&scene, |_| Some(0), Some(&cache)).unwrap();
        assert_eq!(prepare(), fresh);
        let hit = prepare();
        assert_eq!(hit.cached, 1);
        assert_eq!(TextureSet { cached: 0, ..hit }, fresh);
    }
    assert_eq!(folder.path().read_dir().unwrap().count(), 3);
}

#[test]
fn levels_that_are_not_sampled_are_left_out_and_the_others_are_unchanged() {
    for (size, wanted, first) in [
        ([64, 32], 0, 0),
        ([64, 32], 2, 2),
        ([64, 32], 9, 3),
        ([30, 16], 2, 2),
        ([24, 16], 1, 0),
    ] {
        for alpha in [AlphaMode::Opaque, AlphaMode::Mask(0.3), AlphaMode::Blend] {
            let scene = scene_of(size, picture(size), alpha);
            let folder = tempfile::tempdir().unwrap();
            let cache = Cache::new(folder.path().to_owned(), 1 << 30);
            let whole = TextureSet::compress(&scene).unwrap().textures.remove(0);
            let shorter = |cache| {
                let set = TextureSet::prepare(&scene, |_| Some(wanted), cache).unwrap();
                assert_eq!(set.skipped_bytes(), whole.blocks.len() - set.bytes());
                assert_eq!(set.shortened(), usize::from(first > 0));
                (set.textures[0].clone(), set.cached)
            };
            let (texture, _) = shorter(None);
            assert_eq!(
                (texture.first_level, &texture.texture),
                (first, &whole.texture)
            );
            let [width, height] = texture.texture.level_size(first);
            assert!(whole.blocks.ends_with(&texture.blocks));
            assert_eq!(first > 0, texture.blocks.len() < whole.blocks.len());
            assert!(first == 0 || (width % 4, height % 4) == (0, 0));
            // The shorter texture has its own key. It is also taken from a complete texture in the cache.
            assert_eq!(shorter(Some(&cache)), (texture.clone(), 0));
            assert_eq!(shorter(Some(&cache)), (texture.clone(), 1));
            let full = TextureSet::prepare(&scene, |_| Some(0), Some(&cache)).unwrap();
            assert_eq!(full.cached, usize::from(first == 0));
            assert_eq!(shorter(Some(&cache)), (texture, 1));
        }
    }
}

#[test]
fn damaged_cache_files_are_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let cache = Cache::new(folder.path().to_owned(), 1 << 30);
    let scene = scene_of([16, 16], picture([16, 16]), AlphaMode::Opaque);
    let prepare = || TextureSet::prepare(&scene, |_| Some(0), Some(&cache)).unwrap();
    let fresh = prepare();
    let file = folder.path().read_dir().unwrap().next().unwrap().unwrap();
    let whole = std::fs::read(file.path()).unwrap();
    let mut damaged = whole.clone();
    damaged[100] ^= 0x10;
    for bytes in [&damaged[..], &whole[..60], &[]] {
        std::fs::write(file.path(), bytes).unwrap();
        assert_eq!(prepare(), fresh);
        assert_eq!(std::fs::read(file.path()).unwrap(), whole);
    }
}

#[test]
fn the_key_depends_on_everything_that_determines_the_blocks() {
    let folder = tempfile::tempdir().unwrap();
    let cache = Cache::new(folder.path().to_owned(), 1 << 30);
    let mut scenes = vec![
        scene_of([16, 16], picture([16, 16]), AlphaMode::Opaque),
        scene_of([32, 8], picture([16, 16]), AlphaMode::Opaque),
        scene_of([16, 16], picture([16, 16]), AlphaMode::Mask(0.5)),
        scene_of([16, 16], picture([16, 16]), AlphaMode::Mask(0.6)),
        scene_of([16, 16], picture([16, 16]), AlphaMode::Blend),
        scene_of([16, 16], vec![7; 1024], AlphaMode::Opaque),
    ];
    let mut linear = scenes[0].clone();
    linear.images[0].color_space = ColorSpace::Linear;
    let mut normals = linear.clone();
    normals.materials[0].textures[TextureSlot::Normal] = Some(TextureRef::new(0));
    scenes.extend([linear, normals]);
    for scene in &scenes {
        let set = TextureSet::prepare(scene, |_| Some(0), Some(&cache)).unwrap();
        assert_eq!(set.cached, 0);
    }
    assert_eq!(folder.path().read_dir().unwrap().count(), scenes.len());
}

/// A source that must not be read.
struct Unreadable;

impl scene::image::ImageSource for Unreadable {
    fn open(&self) -> Result<Box<dyn scene::image::OpenSource + '_>, SceneError> {
        panic!("an image that no view sees is not read")
    }
}

#[test]
fn an_invisible_image_has_a_table_entry_and_is_not_read() {
    for alpha in [AlphaMode::Opaque, AlphaMode::Mask(0.3), AlphaMode::Blend] {
        let mut scene = scene_of([30, 16], picture([30, 16]), alpha);
        let seen = TextureSet::compress(&scene).unwrap();
        if alpha != AlphaMode::Blend {
            scene.images[0].source = std::sync::Arc::new(Unreadable);
        }
        let unseen = TextureSet::prepare(&scene, |_| None, None).unwrap();
        assert_eq!(unseen.textures[0].texture, seen.textures[0].texture);
        assert_eq!(
            (&unseen.of_image, &unseen.notes),
            (&seen.of_image, &seen.notes)
        );
        assert_eq!(unseen.unseen(), usize::from(alpha != AlphaMode::Blend));
    }
}

#[test]
fn the_bytes_of_a_texture_change_only_with_the_encoder_version() {
    let (name, version) = ENCODER.split_once(", ").unwrap().0.split_once(' ').unwrap();
    let entry = format!("name = \"{name}\"\nversion = \"{version}\"\n");
    assert!(
        include_str!("../../../Cargo.lock").contains(&entry),
        "{ENCODER}"
    );
    let mut hasher = KeyHasher::new("");
    for color_space in [ColorSpace::Srgb, ColorSpace::Linear] {
        for alpha in [Alpha::Ignored, Alpha::Mask(77), Alpha::Smooth] {
            for (size, normal_map) in [([64, 32], false), ([64, 32], true), ([30, 17], false)] {
                let role = Role { alpha, normal_map };
                let (_, blocks) = compress(&picture(size), size, color_space, role, 0);
                hasher.add(&blocks);
            }
        }
    }
    // If this changes, ENCODER must change with it, because it is part of the keys of cached textures.
    assert_eq!(
        format!("{:?}", hasher.finish()),
        "Key(53964728629684028245313165242808893593)"
    );
}

#[test]
fn resampled_images_share_one_note() {
    let mut scene = scene_of([30, 17], picture([30, 17]), AlphaMode::Opaque);
    scene.images.push(Image::from_texels(
        "other",
        [30, 17],
        ColorSpace::Linear,
        picture([30, 17]),
    ));
    scene.materials[0].textures[TextureSlot::Normal] = Some(TextureRef::new(1));
    let set = TextureSet::compress(&scene).unwrap();
    let expected = "2 images resampled to whole blocks of 4x4 texels, the first one 'test' from 30x17 to 32x20";
    assert_eq!(set.notes, [expected]);
}
