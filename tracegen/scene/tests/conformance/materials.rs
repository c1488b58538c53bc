//! Materials, their textures, and lights.

use super::files::{File, QUAD};
use super::rows::{Check, Load, Row, Status};
use glam::{Vec3, Vec4};
use scene::{AlphaMode, Light, Loaded, Material, TextureSlot};
use serde_json::{Value, json};

const fn row(
    feature: &'static str,
    status: Status,
    how: &'static str,
    load: Load,
    check: Check,
) -> Row {
    Row::new(feature, (status, how), (load, check))
}

pub const ROWS: &[Row] = &[
    row(
        "metallic-roughness",
        Status::Drawn,
        "factors and textures",
        |f| {
            paint(json!({
                "pbrMetallicRoughness": {
                    "baseColorFactor": [0.5, 0.25, 1, 1], "metallicFactor": 0.5, "roughnessFactor": 0.25,
                    "baseColorTexture": {"index": 0}, "metallicRoughnessTexture": {"index": 0}
                },
                "normalTexture": {"index": 0, "scale": 2}, "occlusionTexture": {"index": 0},
                "emissiveTexture": {"index": 0}, "emissiveFactor": [1, 0, 0.5]
            }))
            .load(f)
        },
        |l, f| {
            let m = material(l, f);
            assert_eq!(m.base_color, Vec4::new(0.5, 0.25, 1.0, 1.0), "{f}");
            assert_eq!([m.metallic, m.roughness, m.normal_scale], [0.5, 0.25, 2.0]);
            assert_eq!(m.emissive, Vec3::new(1.0, 0.0, 0.5));
            let slots: Vec<_> = m.textures.iter().map(|(slot, _)| slot.name()).collect();
            let expected = "base-color normal metallic-roughness occlusion emissive";
            assert_eq!(slots.join(" "), expected);
        },
    ),
    row(
        "alpha modes, alphaCutoff",
        Status::Drawn,
        "opaque, tested or blended",
        |f| paint(json!({"alphaMode": "MASK", "alphaCutoff": 0.25})).load(f),
        |l, f| assert_eq!(material(l, f).alpha, AlphaMode::Mask(0.25), "{f}"),
    ),
    row(
        "doubleSided",
        Status::Drawn,
        "both faces",
        |f| paint(json!({"doubleSided": true})).load(f),
        |l, f| assert!(material(l, f).double_sided, "{f}"),
    ),
    row(
        "COLOR_0",
        Status::Drawn,
        "multiplies the base colour",
        |f| {
            let mut file = File::quad();
            let colors = file.floats("VEC4", &[[0.5, 1.0, 0.25, 1.0]; 4]);
            file.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = json!(colors);
            file.load(f)
        },
        |l, f| {
            let colors = &l.scene.meshes[0].colors;
            assert_eq!(colors.len(), QUAD.len(), "{f}");
        },
    ),
    row(
        "KHR_texture_transform",
        Status::Drawn,
        "per texture, of every slot",
        |f| {
            let moved = json!({"KHR_texture_transform": {"scale": [2, 3], "offset": [0.5, 0]}});
            paint(json!({
                "normalTexture": {"index": 0, "extensions": moved},
                "extensions": {"KHR_materials_clearcoat": {
                    "clearcoatFactor": 1, "clearcoatTexture": {"index": 0, "extensions": moved}
                }}
            }))
            .load(f)
        },
        |l, f| {
            for slot in [TextureSlot::Normal, TextureSlot::Clearcoat] {
                let texture = material(l, f).textures[slot].unwrap();
                let expected = [[2.0, 0.0, 0.5], [0.0, 3.0, 0.0]];
                assert_eq!(texture.uv_transform, expected, "{f}: {}", slot.name());
            }
        },
    ),
    row(
        "KHR_materials_emissive_strength",
        Status::Drawn,
        "multiplies the emission",
        |f| {
            extended(
                "KHR_materials_emissive_strength",
                json!({"emissiveStrength": 8}),
            )
            .load(f)
        },
        |l, f| assert_eq!(material(l, f).emissive, Vec3::splat(8.0), "{f}"),
    ),
    row(
        "KHR_materials_ior",
        Status::Drawn,
        "by ray tracing",
        |f| extended("KHR_materials_ior", json!({"ior": 1.25})).load(f),
        |l, f| assert_eq!(material(l, f).ior, 1.25, "{f}"),
    ),
    row(
        "KHR_materials_specular",
        Status::Drawn,
        "specular colour; its texture, or else that of the factor",
        |f| {
            let texture = json!({"index": 0});
            let of = json!({"specularColorFactor": [0.5, 1, 1], "specularColorTexture": texture});
            extended("KHR_materials_specular", of).load(f)
        },
        |l, f| {
            sampled(l, f, &[TextureSlot::Specular]);
            assert_eq!(material(l, f).specular, Vec3::new(0.5, 1.0, 1.0), "{f}");
        },
    ),
    row(
        "KHR_materials_unlit",
        Status::Drawn,
        "shown as emission",
        |f| extended("KHR_materials_unlit", json!({})).load(f),
        |l, f| assert_eq!(material(l, f).emissive, Vec3::ONE, "{f}"),
    ),
    row(
        "KHR_materials_pbrSpecularGlossiness",
        Status::Approximated,
        "becomes metallic-roughness; the glossiness channel does not change the roughness",
        |f| {
            let texture = json!({"index": 0});
            let of = json!({"glossinessFactor": 0.25, "specularGlossinessTexture": texture});
            extended("KHR_materials_pbrSpecularGlossiness", of).load(f)
        },
        |l, f| {
            sampled(l, f, &[TextureSlot::Specular]);
            assert_eq!(material(l, f).roughness, 0.75, "{f}");
        },
    ),
    layer(
        "KHR_materials_clearcoat",
        |f| {
            let properties = [
                "clearcoatTexture",
                "clearcoatRoughnessTexture",
                "clearcoatNormalTexture",
            ];
            layered("KHR_materials_clearcoat", "clearcoatFactor", &properties).load(f)
        },
        |l, f| {
            use TextureSlot::{Clearcoat, ClearcoatNormal, ClearcoatRoughness};
            sampled(l, f, &[Clearcoat, ClearcoatRoughness, ClearcoatNormal]);
        },
    ),
    layer(
        "KHR_materials_sheen",
        |f| {
            let properties = ["sheenColorTexture", "sheenRoughnessTexture"];
            layered("KHR_materials_sheen", "sheenColorFactor", &properties).load(f)
        },
        |l, f| {
            sampled(
                l,
                f,
                &[TextureSlot::SheenColor, TextureSlot::SheenRoughness],
            )
        },
    ),
    layer(
        "KHR_materials_transmission",
        |f| {
            let properties = ["transmissionTexture"];
            layered(
                "KHR_materials_transmission",
                "transmissionFactor",
                &properties,
            )
            .load(f)
        },
        |l, f| {
            sampled(l, f, &[TextureSlot::Transmission]);
            assert_eq!(material(l, f).transmission, 0.5, "{f}");
        },
    ),
    layer(
        "KHR_materials_volume",
        |f| {
            layered(
                "KHR_materials_volume",
                "thicknessFactor",
                &["thicknessTexture"],
            )
            .load(f)
        },
        |l, f| sampled(l, f, &[TextureSlot::Thickness]),
    ),
    layer(
        "KHR_materials_iridescence",
        |f| {
            let properties = ["iridescenceTexture", "iridescenceThicknessTexture"];
            layered(
                "KHR_materials_iridescence",
                "iridescenceFactor",
                &properties,
            )
            .load(f)
        },
        |l, f| {
            use TextureSlot::{Iridescence, IridescenceThickness};
            sampled(l, f, &[Iridescence, IridescenceThickness]);
        },
    ),
    layer(
        "KHR_materials_anisotropy",
        |f| {
            layered(
                "KHR_materials_anisotropy",
                "anisotropyStrength",
                &["anisotropyTexture"],
            )
            .load(f)
        },
        |l, f| sampled(l, f, &[TextureSlot::Anisotropy]),
    ),
    layer(
        "KHR_materials_diffuse_transmission",
        |f| {
            let properties = [
                "diffuseTransmissionTexture",
                "diffuseTransmissionColorTexture",
            ];
            let extension = "KHR_materials_diffuse_transmission";
            layered(extension, "diffuseTransmissionFactor", &properties).load(f)
        },
        |l, f| {
            use TextureSlot::{DiffuseTransmission, DiffuseTransmissionColor};
            sampled(l, f, &[DiffuseTransmission, DiffuseTransmissionColor]);
        },
    ),
    row(
        "layers with a factor of zero",
        Status::Drawn,
        "absent: their textures are not sampled",
        |f| {
            let texture = json!({"index": 0});
            let of = json!({"clearcoatFactor": 0, "clearcoatTexture": texture});
            extended("KHR_materials_clearcoat", of).load(f)
        },
        |l, f| sampled(l, f, &[]),
    ),
    row(
        "a texture of a layer that does not exist",
        Status::Refused,
        "KHR_materials_sheen.sheenColorTexture",
        |f| {
            let texture = json!({"index": 7});
            let of = json!({"sheenColorFactor": [1, 1, 1], "sheenColorTexture": texture});
            extended("KHR_materials_sheen", of).load(f)
        },
        |_, _| {},
    ),
    row(
        "KHR_materials_dispersion",
        Status::Approximated,
        "left out, with a warning; it has no texture",
        |f| {
            let mut file = File::quad();
            file.push("extensionsUsed", json!("KHR_materials_dispersion"));
            file.load(f)
        },
        |l, f| assert!(l.warnings[0].contains("KHR_materials_dispersion"), "{f}"),
    ),
    row(
        "KHR_lights_punctual: directional",
        Status::Drawn,
        "parallel light",
        |f| lit("directional").load(f),
        |l, f| {
            assert!(
                matches!(l.scene.lights[..], [Light::Directional { .. }]),
                "{f}"
            )
        },
    ),
    row(
        "KHR_lights_punctual: spot",
        Status::Approximated,
        "a point light, with a warning",
        |f| lit("spot").load(f),
        |l, f| {
            assert!(matches!(l.scene.lights[..], [Light::Point { .. }]), "{f}");
            assert_eq!(l.warnings.len(), 1, "{f}: {:?}", l.warnings);
        },
    ),
];

const fn layer(extension: &'static str, load: Load, check: Check) -> Row {
    row(
        extension,
        Status::Approximated,
        "its textures are sampled; rasterizing dims the colour by them",
        load,
        check,
    )
}

fn material<'a>(loaded: &'a Loaded, feature: &str) -> &'a Material {
    let [material] = &loaded.scene.materials[..] else {
        panic!("{feature}: {} materials", loaded.scene.materials.len());
    };
    material
}

/// Checks which textures the material samples.
fn sampled(loaded: &Loaded, feature: &str, expected: &[TextureSlot]) {
    let found: Vec<_> = material(loaded, feature)
        .textures
        .iter()
        .map(|(s, _)| s)
        .collect();
    assert_eq!(found, expected, "{feature}");
    assert!(
        loaded.warnings.is_empty(),
        "{feature}: {:?}",
        loaded.warnings
    );
}

/// A quad with a material and a texture.
fn paint(material: Value) -> File {
    let mut file = File::quad();
    let png = image::RgbaImage::from_pixel(4, 4, image::Rgba([9, 90, 200, 255]));
    let mut bytes = std::io::Cursor::new(Vec::new());
    png.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    let view = file.view(bytes.get_ref());
    file.json["images"] = json!([{"bufferView": view, "mimeType": "image/png"}]);
    file.json["textures"] = json!([{"source": 0}]);
    file.json["materials"] = json!([material]);
    file
}

/// A quad that emits light and has a required extension of its material.
fn extended(extension: &str, of: Value) -> File {
    let mut file = paint(json!({"emissiveFactor": [1, 1, 1], "extensions": {extension: of}}));
    file.requires(extension);
    file
}

/// A quad with an additional layer.
fn layered(extension: &str, factor: &str, textures: &[&str]) -> File {
    let mut of = json!({});
    of[factor] = match factor {
        "sheenColorFactor" => json!([0, 0.5, 0]),
        _ => json!(0.5),
    };
    for texture in textures {
        of[texture] = json!({"index": 0});
    }
    extended(extension, of)
}

/// A quad and a light.
fn lit(kind: &str) -> File {
    let mut file = File::quad();
    file.requires("KHR_lights_punctual");
    file.json["extensions"] =
        json!({"KHR_lights_punctual": {"lights": [{"type": kind, "spot": {}}]}});
    let light = json!({"extensions": {"KHR_lights_punctual": {"light": 0}}});
    let node = file.push("nodes", light);
    file.json["scenes"][0]["nodes"] = json!([0, node]);
    file
}
