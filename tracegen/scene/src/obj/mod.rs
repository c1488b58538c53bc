//! Wavefront OBJ with MTL materials.
//!
//! v grows upwards in OBJ and downwards here, so it is turned over. Quads and polygons are cut
//! into fans. From MTL: `Kd`, `Ks`, `Ns`, `d`, `Ke`, `Ni`, `illum`, and the maps `map_Kd`, `map_Ks`,
//! `map_Ke`, `map_d` (merged into the base colour's alpha; the material becomes alpha-masked) and
//! `map_Bump`, `bump` or `norm` (read as a tangent-space normal map).

use super::files::{Origin, read_file};
use super::geometry::{vertex_normals, vertex_tangents};
use super::images::{Request, Requests, Source, Usage};
use super::{
    AlphaMode, Instance, LoadOptions, Loaded, Material, Mesh, Scene, SceneError, TextureRef,
};
use glam::{Affine3A, Vec2, Vec3};
use std::cell::RefCell;
use std::io::Cursor;
use std::path::{Path, PathBuf};

/// `illum` models that mirror: 3 (reflection), 5 (Fresnel reflection), 8 (reflection, no rays).
const MIRRORS: [u8; 3] = [3, 5, 8];
/// `illum` models that refract: 4, 6, 7, 9.
const GLASSES: [u8; 4] = [4, 6, 7, 9];

/// Loads an OBJ file and the MTL files that it names.
///
/// # Errors
/// See [`SceneError`].
pub fn load(path: &Path, options: &LoadOptions) -> Result<Loaded, SceneError> {
    let origin = Origin::new(path);
    let bytes = read_file(path, "scene")?;
    let mut warnings = Vec::new();
    // The folder of the last MTL file: its maps are relative to it.
    let mtl_file: RefCell<Option<PathBuf>> = RefCell::new(None);
    let mtl_error = RefCell::new(None);
    let parsed = tobj::load_obj_buf(
        &mut Cursor::new(&bytes),
        &tobj::LoadOptions {
            triangulate: true,
            single_index: true,
            ignore_points: true,
            ignore_lines: true,
        },
        |name| {
            let file = origin.sibling(name);
            match read_file(&file, "mtllib") {
                Ok(bytes) => {
                    *mtl_file.borrow_mut() = Some(file);
                    tobj::load_mtl_buf(&mut Cursor::new(&bytes))
                }
                Err(error) => {
                    *mtl_error.borrow_mut() = Some(error);
                    Err(tobj::LoadError::OpenFileFailed)
                }
            }
        },
    );
    let (models, materials) =
        parsed.map_err(|e| origin.invalid("file", "a Wavefront OBJ", e.to_string()))?;
    let mtl_file = mtl_file.into_inner();
    let json = match (mtl_error.into_inner(), materials) {
        // A missing MTL costs colours, not shapes.
        (Some(error), _) => {
            warnings.push(format!("{error}; default materials are used"));
            Vec::new()
        }
        (None, Ok(materials)) => materials,
        (None, Err(error)) => {
            let file = mtl_file.unwrap_or_else(|| path.to_owned());
            return Err(Origin::new(&file).invalid(
                "file",
                "a material library",
                error.to_string(),
            ));
        }
    };

    let mut requests = Requests::default();
    let materials_from = Origin::new(mtl_file.as_deref().unwrap_or(path));
    let mut scene = Scene::default();
    for mtl in &json {
        let material = material(mtl, &materials_from, options, &mut requests);
        scene.materials.push(material);
    }
    for model in models {
        let Some(mut mesh) = mesh(&origin, model)? else {
            continue;
        };
        if mesh.material >= scene.materials.len() {
            mesh.material = default_material(&mut scene.materials, json.len());
        }
        scene.instances.push(Instance {
            mesh: scene.meshes.len(),
            transform: Affine3A::IDENTITY,
        });
        scene.meshes.push(mesh);
    }
    scene.images = requests.decode(&origin, options)?;
    Ok(Loaded { scene, warnings })
}

/// The material of faces before any `usemtl`: one for all of them.
fn default_material(materials: &mut Vec<Material>, from_file: usize) -> usize {
    if materials.len() == from_file {
        materials.push(Material {
            name: "default".into(),
            ..Material::default()
        });
    }
    from_file
}

/// `None` for a model without triangles.
fn mesh(origin: &Origin, model: tobj::Model) -> Result<Option<Mesh>, SceneError> {
    let tobj::Model { mesh: json, name } = model;
    if json.indices.is_empty() {
        return Ok(None);
    }
    let vec3 = |v: &[f32]| -> Vec<Vec3> { v.chunks_exact(3).map(Vec3::from_slice).collect() };
    let positions = vec3(&json.positions);
    if let Some(vertex) = positions.iter().position(|p| !p.is_finite()) {
        return Err(origin.invalid(
            format!("object '{name}', vertex {vertex}"),
            "a finite position",
            positions[vertex].to_string(),
        ));
    }
    if let Some(&index) = json
        .indices
        .iter()
        .find(|&&i| i as usize >= positions.len())
    {
        return Err(origin.invalid(
            format!("object '{name}'"),
            format!("a vertex below {}", positions.len()),
            index.to_string(),
        ));
    }
    let mut uv0: Vec<Vec2> = (json.texcoords.chunks_exact(2))
        .map(|t| Vec2::new(t[0], 1.0 - t[1]))
        .map(|t| if t.is_finite() { t } else { Vec2::ZERO })
        .collect();
    uv0.resize(positions.len(), Vec2::ZERO);
    let computed = vertex_normals(&positions, &json.indices);
    let mut normals = vec3(&json.normals);
    normals.resize(positions.len(), Vec3::ZERO);
    for (n, computed) in normals.iter_mut().zip(computed) {
        *n = n.normalize_or(computed);
    }
    let tangents = vertex_tangents(&positions, &normals, &uv0, &json.indices);
    Ok(Some(Mesh {
        name,
        positions,
        normals,
        tangents,
        uv0,
        uv1: Vec::new(),
        indices: json.indices,
        material: json.material_id.unwrap_or(usize::MAX),
    }))
}

fn material(
    mtl: &tobj::Material,
    origin: &Origin,
    options: &LoadOptions,
    requests: &mut Requests,
) -> Material {
    let extra = |key: &str| mtl.unknown_param.get(key).map(String::as_str);
    let unit = |value: f32| {
        if value.is_nan() {
            1.0
        } else {
            value.clamp(0.0, 1.0)
        }
    };
    let dissolve = unit(mtl.dissolve.unwrap_or(1.0));
    let illum = mtl.illumination_model.unwrap_or(2);
    let shininess = mtl.shininess.unwrap_or(32.0).max(0.0);
    let specular = Vec3::from(mtl.specular.unwrap_or([0.0; 3])).map(unit);
    let mut result = Material {
        name: mtl.name.clone(),
        base_color: Vec3::from(mtl.diffuse.unwrap_or([1.0; 3]))
            .map(unit)
            .extend(dissolve),
        specular,
        // Blinn-Phong exponent to roughness: alpha^2 = 2 / (n + 2), perceptual = sqrt(alpha).
        roughness: (2.0 / (shininess + 2.0)).sqrt().sqrt(),
        emissive: Vec3::from(mtl.emissive.unwrap_or_default()).max(Vec3::ZERO),
        ior: mtl.optical_density.filter(|n| *n > 0.0).unwrap_or(1.5),
        alpha: if dissolve < 1.0 {
            AlphaMode::Blend
        } else {
            AlphaMode::Opaque
        },
        double_sided: true,
        ..Material::default()
    };
    if MIRRORS.contains(&illum) {
        result.mirror = specular.max_element();
    }
    if GLASSES.contains(&illum) || (dissolve < 1.0 && mtl.diffuse_texture.is_none()) {
        result.transmission = 1.0 - dissolve;
    }

    let mut texture = |slot: usize, map: Option<&str>, usage: Usage| {
        let path = map
            .map(path_of)
            .filter(|p| !p.is_empty() && options.slots[slot])?;
        let request = request(path, usage, origin, &mtl.name);
        Some(TextureRef::new(requests.index(request)))
    };
    result.normal_texture = texture(
        1,
        mtl.normal_texture
            .as_deref()
            .or_else(|| extra("norm"))
            .or_else(|| extra("bump")),
        Usage::Data,
    );
    result.specular_texture = texture(3, mtl.specular_texture.as_deref(), Usage::Color);
    if result.specular_texture.is_some() && result.specular == Vec3::ZERO {
        result.specular = Vec3::ONE;
    }
    result.emissive_texture = texture(5, extra("map_Ke"), Usage::Color);
    if result.emissive_texture.is_some() && result.emissive == Vec3::ZERO {
        result.emissive = Vec3::ONE;
    }
    let opacity = mtl
        .dissolve_texture
        .as_deref()
        .map(path_of)
        .filter(|p| !p.is_empty());
    let color = mtl
        .diffuse_texture
        .as_deref()
        .map(path_of)
        .filter(|p| !p.is_empty());
    if options.slots[0] && (color.is_some() || opacity.is_some()) {
        let usage = match opacity {
            Some(opacity) => {
                result.alpha = AlphaMode::Mask(0.5);
                result.base_color.w = 1.0;
                let mask = request(opacity, Usage::Data, origin, &mtl.name);
                Usage::Masked(requests.mask(mask))
            }
            None => Usage::Color,
        };
        // An opacity map without a colour map serves as both; `Kd` still colours it.
        let path = color.or(opacity).unwrap_or_default();
        let request = request(path, usage, origin, &mtl.name);
        result.base_color_texture = Some(TextureRef::new(requests.index(request)));
    }
    result
}

/// The file of a map statement, which may have options before it (`-bm 0.2 bricks.png`).
fn path_of(statement: &str) -> &str {
    let statement = statement.trim();
    if !statement.starts_with('-') {
        return statement;
    }
    statement
        .rsplit(char::is_whitespace)
        .next()
        .unwrap_or_default()
}

fn request(path: &str, usage: Usage, origin: &Origin, material: &str) -> Request {
    // Exporters on Windows write backslashes.
    let path = path.replace('\\', "/");
    let relative = Path::new(&path);
    let name = relative
        .file_name()
        .map(|n| n.to_string_lossy().into_owned());
    Request {
        source: Source::File(origin.sibling(relative)),
        usage,
        name: name.unwrap_or_else(|| path.clone()),
        place: format!("{}: material '{material}'", origin.file.display()),
    }
}

#[cfg(test)]
mod tests;
