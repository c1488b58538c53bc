//! Compares a trace's tables with the scene's instances, materials and images.
//!
//! All expected values are derived here from the loaded scene by the rules of FORMAT.md, without the
//! capture's list of draws and textures, which wrote the tables.

use super::faults::Faults;
use super::views::Views;
use formats::textrace::{Draw, PassKind, Sample, Surfaces, Tables, UvGroup};
use formats::texture::{ColorSpace, Sampler, TexelFormat, Texture};
use scene::{AlphaMode, Material, Scene, SceneError, TextureRef, TextureSlot};
use std::collections::BTreeSet;

/// Edge of the blocks that textures are compressed in, texels.
const BLOCK: u32 = 4;
/// Edge of a shadow cascade, texels.
const SHADOW_SIZE: u32 = 2048;
/// Cascades that `--shadows` adds.
const MOST_CASCADES: u32 = 4;
/// Texel offsets of the taps of a shadow look-up.
const SHADOW_TAPS: [[i8; 2]; 4] = [[-1, -1], [1, -1], [-1, 1], [1, 1]];

/// Contradictions between the tables of a trace and its scene.
///
/// # Errors
/// An image whose alpha decides a format and that cannot be read.
pub fn faults(scene: &Scene, tables: &Tables) -> Result<Vec<String>, SceneError> {
    let mut faults = Faults::default();
    let used = used_images(scene);
    let textures = used
        .iter()
        .map(|&image| texture(scene, image))
        .collect::<Result<Vec<_>, _>>()?;
    let cascades = cascades(scene, tables, textures.len(), &mut faults);
    hold_textures(textures, cascades, tables, &mut faults);
    hold_samplers(scene, cascades, tables, &mut faults);
    hold_draws(scene, &used, cascades, tables, &mut faults);
    hold_description(scene, tables, &mut faults);
    hold_passes(tables, &mut faults);
    Views {
        hmd: &tables.meta.hmd,
        frames: &tables.meta.frames,
    }
    .hold(&mut faults);
    Ok(faults.0)
}

/// Images that the materials of placed meshes sample, ascending: each is a texture.
fn used_images(scene: &Scene) -> Vec<usize> {
    let placed = placed_materials(scene);
    let images: BTreeSet<usize> = (placed.into_iter())
        .flat_map(|material| scene.materials[material].textures.all())
        .map(|reference| reference.image)
        .filter(|&image| image < scene.images.len())
        .collect();
    images.into_iter().collect()
}

fn placed_materials(scene: &Scene) -> BTreeSet<usize> {
    (scene.instances.iter())
        .filter_map(|instance| scene.meshes.get(instance.mesh))
        .map(|mesh| mesh.material)
        .filter(|&material| material < scene.materials.len())
        .collect()
}

/// The expected entry of an image. Stored blocks keep their format and levels. Other images get whole blocks,
/// every mip level, and BC3 if alpha is blended and not 1, else BC1.
fn texture(scene: &Scene, index: usize) -> Result<Texture, SceneError> {
    let image = &scene.images[index];
    if let Some(stored) = image.stored {
        return Ok(Texture {
            name: image.name.clone(),
            size: image.size,
            levels: stored.levels,
            layers: 1,
            format: stored.format,
            color_space: image.color_space,
            part: None,
        });
    }
    let size = image.size.map(|edge| edge.div_ceil(BLOCK) * BLOCK);
    let mut levels = 1;
    while size.iter().any(|edge| edge >> levels > 0) {
        levels += 1;
    }
    let blended = placed_materials(scene).into_iter().any(|material| {
        let material = &scene.materials[material];
        let samples = |slot| material.textures[slot].is_some_and(|texture| texture.image == index);
        let blends = material.alpha == AlphaMode::Blend && samples(TextureSlot::BaseColor);
        // These textures are read in their alpha channel.
        let of_layers = [
            TextureSlot::SheenRoughness,
            TextureSlot::DiffuseTransmission,
        ];
        blends || of_layers.into_iter().any(samples)
    });
    let smooth = blended && {
        let texels = image.source.open()?.texels(&[image.part])?;
        let mut alphas = texels.iter().flat_map(|rgba| rgba.chunks_exact(4));
        alphas.any(|texel| texel[3] != u8::MAX)
    };
    Ok(Texture {
        name: image.name.clone(),
        size,
        levels,
        layers: 1,
        format: if smooth {
            TexelFormat::Bc3
        } else {
            TexelFormat::Bc1
        },
        color_space: image.color_space,
        part: None,
    })
}

/// The number of shadow cascades: the scene's own, or those of `--shadows`.
fn cascades(scene: &Scene, tables: &Tables, images: usize, faults: &mut Faults) -> u32 {
    let own = scene.shadow_cascades.min(MOST_CASCADES);
    let found = tables.textures.get(images).map_or(0, |maps| maps.layers);
    if found != own && found != MOST_CASCADES {
        let expected = format!("{own} or {MOST_CASCADES} layers");
        faults.add("shadow cascades", &expected, &found.to_string());
        return own;
    }
    found
}

/// The format of the shadow maps: that of the trace, if maps can have it.
fn shadow_format(tables: &Tables, images: usize) -> TexelFormat {
    let found = tables.textures.get(images).map(|maps| maps.format);
    let smaller = found.filter(|found| matches!(found, TexelFormat::D16 | TexelFormat::Bc4));
    smaller.unwrap_or(TexelFormat::R32f)
}

fn hold_textures(mut expected: Vec<Texture>, cascades: u32, tables: &Tables, faults: &mut Faults) {
    if cascades > 0 {
        expected.push(Texture {
            name: "shadow cascades".into(),
            size: [SHADOW_SIZE; 2],
            levels: 1,
            layers: cascades,
            format: shadow_format(tables, expected.len()),
            color_space: ColorSpace::Linear,
            part: None,
        });
    }
    faults.hold(
        "number of textures",
        &expected.len(),
        &tables.textures.len(),
    );
    for (number, (expected, found)) in expected.iter().zip(&tables.textures).enumerate() {
        let place = |field| format!("texture {number} ({}): {field}", expected.name);
        faults.hold(&place("name"), &expected.name, &found.name);
        faults.hold(&place("size"), &expected.size, &found.size);
        faults.hold(&place("mip levels"), &expected.levels, &found.levels);
        faults.hold(&place("layers"), &expected.layers, &found.layers);
        faults.hold(&place("format"), &expected.format, &found.format);
        let color_spaces = (&expected.color_space, &found.color_space);
        faults.hold(&place("colour space"), color_spaces.0, color_spaces.1);
    }
}

/// Every sampler must belong to a material or to the shadow maps; draws are compared by the values of their
/// samplers.
fn hold_samplers(scene: &Scene, cascades: u32, tables: &Tables, faults: &mut Faults) {
    let materials = scene
        .materials
        .iter()
        .flat_map(|material| material.textures.all());
    let mut known: Vec<Sampler> = materials.map(|reference| reference.sampler).collect();
    known.extend((cascades > 0).then_some(Sampler::SHADOW));
    for (number, sampler) in tables.samplers.iter().enumerate() {
        if !known.contains(sampler) {
            let found = serde_json::to_string(sampler).unwrap_or_default();
            faults.add(&format!("sampler {number}"), "one of the scene's", &found);
        }
        if tables.samplers[..number].contains(sampler) {
            faults.add(
                &format!("sampler {number}"),
                "each sampler once",
                "one again",
            );
        }
    }
}

/// Opaque and masked instances in the scene's order, then blended ones.
fn hold_draws(scene: &Scene, used: &[usize], cascades: u32, tables: &Tables, faults: &mut Faults) {
    let meshes = || scene.instances.iter().map(|i| &scene.meshes[i.mesh]);
    let of = |blended: bool| {
        meshes().filter(move |mesh| {
            let material = &scene.materials[mesh.material];
            let is_blended = matches!(material.alpha, AlphaMode::Blend);
            !mesh.indices.is_empty() && is_blended == blended && is_seen(material)
        })
    };
    let mut opaque = Vec::new();
    let mut first_primitive = 0;
    let mut number = 0;
    for mesh in of(false).chain(of(true)) {
        let material = &scene.materials[mesh.material];
        let primitives = (mesh.indices.len() / 3) as u32;
        opaque.push(match material.alpha {
            AlphaMode::Opaque => true,
            AlphaMode::Mask(_) => material.textures[TextureSlot::BaseColor].is_none(),
            AlphaMode::Blend => false,
        });
        if let Some(draw) = tables.draws.get(number) {
            let place = |field| format!("draw {number} ({}): {field}", material.name);
            faults.hold(&place("material"), &material.name, &draw.material);
            let first = (&first_primitive, &draw.first_primitive);
            faults.hold(&place("first primitive"), first.0, first.1);
            faults.hold(&place("primitives"), &primitives, &draw.primitives);
            hold_groups(number, material, used, cascades, draw, tables, faults);
        }
        first_primitive += primitives;
        number += 1;
    }
    faults.hold("number of draws", &number, &tables.draws.len());
    if let Some(surfaces) = &tables.meta.surfaces {
        let expected = Surfaces::ranges(opaque);
        faults.hold("surfaces.not_opaque", &expected, &surfaces.not_opaque);
    }
}

/// A constant alpha below the cutoff discards all fragments.
fn is_seen(material: &Material) -> bool {
    match material.alpha {
        AlphaMode::Mask(cutoff) => {
            material.textures[TextureSlot::BaseColor].is_some() || material.base_color.w >= cutoff
        }
        AlphaMode::Opaque | AlphaMode::Blend => true,
    }
}

/// The groups of a material: its textures by coordinates, then one group per cascade. Samplers by value.
fn groups(
    material: &Material,
    used: &[usize],
    images: usize,
    cascades: u32,
) -> Vec<Vec<(Sample, Sampler)>> {
    let mut groups: Vec<(TextureRef, Vec<(Sample, Sampler)>)> = Vec::new();
    for reference in material.textures.all() {
        let texture = used.iter().position(|&image| image == reference.image);
        let sample = texture.map(|texture| {
            let sample = Sample {
                texture: texture as u32,
                ..Sample::default()
            };
            (sample, reference.sampler)
        });
        let coordinates = |r: &TextureRef| (r.uv_set, r.uv_transform);
        let same =
            |(leader, _): &&mut (TextureRef, _)| coordinates(leader) == coordinates(reference);
        match groups.iter_mut().find(same) {
            Some((_, samples)) => samples.extend(sample),
            None => groups.push((*reference, sample.into_iter().collect())),
        }
    }
    let shadow = |layer| {
        let tap = |offset| Sample {
            texture: images as u32,
            sampler: 0,
            layer,
            offset,
            level: Default::default(),
        };
        SHADOW_TAPS
            .map(|offset| (tap(offset), Sampler::SHADOW))
            .into()
    };
    (groups.into_iter().map(|(_, samples)| samples))
        .chain((0..cascades as u16).map(shadow))
        .collect()
}

fn hold_groups(
    number: usize,
    material: &Material,
    used: &[usize],
    cascades: u32,
    draw: &Draw,
    tables: &Tables,
    faults: &mut Faults,
) {
    let expected = groups(material, used, used.len(), cascades);
    let place = format!("draw {number} ({})", material.name);
    let counts = [expected.len(), draw.groups.len()];
    faults.hold(
        &format!("{place}: number of uv groups"),
        &counts[0],
        &counts[1],
    );
    for (group, (expected, found)) in expected.iter().zip(&draw.groups).enumerate() {
        hold_group(
            &format!("{place} group {group}"),
            expected,
            found,
            tables,
            faults,
        );
    }
}

fn hold_group(
    place: &str,
    expected: &[(Sample, Sampler)],
    found: &UvGroup,
    tables: &Tables,
    faults: &mut Faults,
) {
    let counts = [expected.len(), found.samples.len()];
    faults.hold(
        &format!("{place}: number of samples"),
        &counts[0],
        &counts[1],
    );
    let size = |sample: &Sample, axis: usize| {
        let texture = tables.textures.get(sample.texture as usize);
        texture.map_or(1, |texture| texture.size[axis])
    };
    let extent = [0, 1].map(|axis| {
        let sizes = expected.iter().map(|(sample, _)| size(sample, axis));
        sizes.max().unwrap_or(1)
    });
    faults.hold(&format!("{place}: extent"), &extent, &found.extent);
    for (number, ((expected, sampler), found)) in expected.iter().zip(&found.samples).enumerate() {
        let place = |field| format!("{place} sample {number}: {field}");
        faults.hold(&place("texture"), &expected.texture, &found.texture);
        faults.hold(&place("layer"), &expected.layer, &found.layer);
        faults.hold(&place("offset"), &expected.offset, &found.offset);
        if let Some(found) = tables.samplers.get(usize::from(found.sampler)) {
            faults.hold(&place("sampler's wrap"), &sampler.wrap, &found.wrap);
            let magnified = (&sampler.mag, &found.mag);
            faults.hold(&place("sampler's magnification"), magnified.0, magnified.1);
            let minified = (&sampler.min, &found.min);
            faults.hold(&place("sampler's minification"), minified.0, minified.1);
            faults.hold(&place("sampler's mip filter"), &sampler.mip, &found.mip);
        }
    }
}

fn hold_description(scene: &Scene, tables: &Tables, faults: &mut Faults) {
    let meta = &tables.meta;
    let of_mesh = |mesh: usize| scene.meshes[mesh].indices.len() as u64 / 3;
    let triangles: u64 = scene.instances.iter().map(|i| of_mesh(i.mesh)).sum();
    faults.hold("scene_triangles", &triangles, &meta.scene_triangles);
    faults.hold("origin_m", &scene.origin.to_array(), &meta.origin_m);
    // A capture by a rasteriser uses no random numbers.
    faults.hold("seed", &0, &meta.seed);
}

/// Each frame is a left or a right picture, or both in this order.
fn hold_passes(tables: &Tables, faults: &mut Faults) {
    for views in &tables.meta.frames {
        let passes = (tables.passes.iter()).filter(|pass| pass.frame == views.frame);
        let eyes: Vec<_> = passes
            .filter(|pass| pass.kind == PassKind::Main)
            .map(|pass| pass.eye.map(|eye| eye as u8))
            .collect();
        let sound = eyes.iter().all(Option::is_some) && eyes.is_sorted_by(|a, b| a < b);
        if eyes.is_empty() || !sound {
            let found = serde_json::to_string(&eyes).unwrap_or_default();
            let place = format!("passes of frame {}", views.frame);
            faults.add(
                &place,
                "a picture of the left eye (0), the right (1) or both in this order",
                &found,
            );
        }
    }
}
