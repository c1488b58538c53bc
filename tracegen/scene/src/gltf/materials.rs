//! Materials and the textures that they sample.
//!
//! For the ray tracer, which follows mirror reflections and refractions but no glossy ones:
//! - `transmission` is KHR_materials_transmission's factor, without its texture. Without it, a blended material without
//!   a base colour texture counts as glass that transmits `1 - alpha`.
//! - `mirror` is 0, because glTF has no such factor. The reflectance of a smooth metal follows from
//!   its metalness and roughness where it is hit.
//!
//! KHR_materials_pbrSpecularGlossiness becomes base colour, specular colour and
//! roughness = 1 - glossiness; the glossiness channel of its texture is not used.

use super::accessors::Buffers;
use super::find_file;
use super::material_textures::{CORE, GLOSSINESS, LAYERS, MaterialTexture};
use crate::files::shown;
use crate::image_files::{Embedded, Request, Requests, Source, Usage};
use crate::lookup::Lookup;
use crate::uri::{self, Uri};
use crate::warnings::Warnings;
use crate::{AlphaMode, LoadOptions, Material, SceneError, TextureRef, TextureSlot};
use formats::texture::{Filter, MipFilter, Sampler, Wrap};
use glam::{Vec3, Vec4};
use gltf::json::extensions::texture::TextureTransform;
use gltf::material::AlphaMode as JsonAlphaMode;
use gltf::texture::{MagFilter, MinFilter, Texture, WrappingMode};
use serde::Deserialize;
use serde_json::Value;
use std::collections::HashMap;
use std::sync::Arc;

const TRANSFORM: &str = "KHR_texture_transform";

/// Number of different coordinates of a material's textures. A draw of a trace has at most 15 groups of
/// coordinates, and up to 4 of them are of shadow maps.
const MAX_COORDINATES: usize = 11;

/// Attributes that a mesh needs for its material.
#[derive(Clone, Copy, Default)]
pub(super) struct Uses {
    /// The file's set of texture coordinates for each set of a mesh, and whether a texture samples it.
    pub sets: [(u32, bool); 2],
    /// The normal map's set, of those of a mesh.
    pub normal_map_uv: Option<u32>,
}

impl Uses {
    /// Chooses the sets of a mesh for the (at most two) sets that a material samples. Sets 0 and 1 keep
    /// their places.
    fn new(sampled: &[u32]) -> Self {
        let mut sets = [0, 1].map(|set| (set, sampled.contains(&set)));
        for &set in sampled.iter().filter(|&&set| set > 1) {
            if let Some(free) = sets.iter_mut().rev().find(|(_, used)| !used) {
                *free = (set, true);
            }
        }
        Self {
            sets,
            normal_map_uv: None,
        }
    }

    /// The set of a mesh for a set of the file.
    fn of_mesh(&self, set: u32) -> u32 {
        u32::from(self.sets[1].0 == set)
    }
}

/// The materials that placed meshes use, in order of first use. Others are not read.
pub(super) struct Table<'a> {
    document: &'a gltf::Document,
    buffers: &'a Buffers<'a>,
    options: &'a LoadOptions,
    /// The image of each texture.
    texture_images: &'a [Option<usize>],
    lookup: &'a mut Lookup,
    /// The scene's index of each used glTF material (`None` is glTF's default material) and the
    /// attributes that it needs.
    used: HashMap<Option<usize>, (usize, Uses)>,
    /// Source and name of each requested glTF image.
    sources: HashMap<usize, (Source, Option<String>)>,
    /// The used materials.
    pub materials: Vec<Material>,
    /// The images that these materials sample.
    pub requests: Requests,
    /// Warnings about these materials.
    pub warnings: Warnings,
    /// The current material, named in errors.
    place: String,
    /// The sets of texture coordinates that the current material samples.
    sets: Vec<u32>,
}

impl<'a> Table<'a> {
    pub fn new(
        document: &'a gltf::Document,
        buffers: &'a Buffers<'a>,
        options: &'a LoadOptions,
        texture_images: &'a [Option<usize>],
        lookup: &'a mut Lookup,
    ) -> Self {
        Self {
            document,
            buffers,
            options,
            texture_images,
            lookup,
            used: HashMap::new(),
            sources: HashMap::new(),
            materials: Vec::new(),
            requests: Requests::default(),
            warnings: Warnings::default(),
            place: String::new(),
            sets: Vec::new(),
        }
    }

    /// The scene's index of a glTF material, and the attributes that it needs.
    pub fn index(&mut self, material: Option<usize>) -> Result<(usize, Uses), SceneError> {
        if let Some(known) = self.used.get(&material) {
            return Ok(*known);
        }
        self.sets.clear();
        let mut read = match material.and_then(|m| self.document.materials().nth(m)) {
            Some(json) => self.build(&json)?,
            // glTF's default material is fully metallic. A dielectric shows its shape better.
            None => Material {
                name: "default".into(),
                ..Material::default()
            },
        };
        let sampled = |set: &u32| read.textures.all().any(|t| t.uv_set == *set);
        self.sets.retain(sampled);
        let mut uses = Uses::new(&self.sets);
        for texture in read.textures.all_mut() {
            texture.uv_set = uses.of_mesh(texture.uv_set);
        }
        uses.normal_map_uv = read.textures[TextureSlot::Normal].map(|t| t.uv_set);
        let known = (self.materials.len(), uses);
        self.used.insert(material, known);
        self.materials.push(read);
        Ok(known)
    }

    fn build(&mut self, json: &gltf::Material<'_>) -> Result<Material, SceneError> {
        let index = json.index().unwrap_or_default();
        let name = json
            .name()
            .map_or_else(|| format!("material-{index}"), shown);
        self.place = format!("materials[{index}] '{name}'");
        let pbr = json.pbr_metallic_roughness();
        let mut material = Material {
            name,
            base_color: Vec4::from(pbr.base_color_factor()),
            metallic: pbr.metallic_factor(),
            roughness: pbr.roughness_factor(),
            emissive: Vec3::from(json.emissive_factor()) * json.emissive_strength().unwrap_or(1.0),
            double_sided: json.double_sided(),
            ior: json.ior().filter(|&n| n > 0.0).unwrap_or(1.5),
            alpha: match json.alpha_mode() {
                JsonAlphaMode::Opaque => AlphaMode::Opaque,
                JsonAlphaMode::Mask => AlphaMode::Mask(json.alpha_cutoff().unwrap_or(0.5)),
                JsonAlphaMode::Blend => AlphaMode::Blend,
            },
            ..Material::default()
        };
        if let Some(normal) = json.normal_texture() {
            material.normal_scale = normal.scale();
        }
        if let Some(specular) = json.specular() {
            material.specular =
                Vec3::from(specular.specular_color_factor()) * specular.specular_factor();
        }
        let of_file = self.buffers.root.materials.get(index);
        // As JSON, because the crate has types for some extensions only.
        let of_file = serde_json::to_value(of_file).unwrap_or_default();
        let has_color = json.specular().and_then(|s| s.specular_color_texture());
        for texture in &CORE {
            if texture.usage != Usage::AlphaFactor || has_color.is_none() {
                self.add(texture, &of_file, &mut material)?;
            }
        }
        if let Some(old) = json.pbr_specular_glossiness() {
            material.base_color = Vec4::from(old.diffuse_factor());
            material.metallic = 0.0;
            material.roughness = 1.0 - old.glossiness_factor();
            material.specular = Vec3::from(old.specular_factor());
            for texture in &GLOSSINESS {
                material.textures[texture.slot] = None;
                self.add(texture, &of_file, &mut material)?;
            }
        }
        if json.unlit() {
            // The colour is shown unchanged: it is emitted and nothing is reflected.
            material.emissive = material.base_color.truncate();
            material.textures[TextureSlot::Emissive] = material.textures[TextureSlot::BaseColor];
            material.base_color = Vec3::ZERO.extend(material.base_color.w);
            material.specular = Vec3::ZERO;
            (material.metallic, material.roughness) = (0.0, 1.0);
        }
        self.check_factors(&mut material);
        for texture in &LAYERS {
            self.add(texture, &of_file, &mut material)?;
        }
        self.limit_coordinates(&mut material);
        material.transmission = match json.transmission() {
            Some(transmission) => transmission.transmission_factor(),
            None if material.alpha == AlphaMode::Blend
                && material.textures[TextureSlot::BaseColor].is_none() =>
            {
                1.0 - material.base_color.w
            }
            None => 0.0,
        };
        Ok(material)
    }

    /// Clamps factors to their ranges. NaN becomes the default.
    fn check_factors(&mut self, material: &mut Material) {
        let defaults = Material::default();
        let mut bad = false;
        let mut fix = |value: &mut f32, low: f32, high: f32, default: f32| {
            let fixed = if value.is_nan() {
                default
            } else {
                value.clamp(low, high)
            };
            bad |= fixed != *value;
            *value = fixed;
        };
        for value in material.base_color.as_mut() {
            fix(value, 0.0, 1.0, 1.0);
        }
        fix(&mut material.metallic, 0.0, 1.0, defaults.metallic);
        fix(&mut material.roughness, 0.0, 1.0, defaults.roughness);
        fix(&mut material.normal_scale, -100.0, 100.0, 1.0);
        for value in material.emissive.as_mut() {
            fix(value, 0.0, 1e6, 0.0);
        }
        for value in material.specular.as_mut() {
            fix(value, 0.0, 100.0, 1.0);
        }
        if bad {
            self.warnings.count("factors", || {
                format!("{} has factors out of range; clamped", self.place)
            });
        }
    }

    /// Adds a texture of a material, if the material has it.
    fn add(
        &mut self,
        of: &MaterialTexture,
        json: &Value,
        material: &mut Material,
    ) -> Result<(), SceneError> {
        let place = || format!("{}, {}.{}", self.place, of.object, of.property);
        let found = of.reference(json);
        let found = found.map_err(|e| {
            self.buffers
                .origin
                .invalid(place(), "a texture", e.to_string())
        })?;
        let Some(found) = found else { return Ok(()) };
        let Some(texture) = self.document.textures().nth(found.index) else {
            let expected = format!("an index below {}", self.buffers.root.textures.len());
            return Err(self
                .buffers
                .origin
                .invalid(place(), expected, found.index.to_string()));
        };
        let transform = self.transform(found.extensions.get(TRANSFORM))?;
        let (slot, set) = (of.slot, found.tex_coord);
        material.textures[slot] = self.texture(slot, &texture, set, transform, of.usage)?;
        Ok(())
    }

    /// Leaves out textures with more coordinates than a draw of a trace can have.
    fn limit_coordinates(&mut self, material: &mut Material) {
        let mut known: Vec<TextureRef> = Vec::new();
        for slot in TextureSlot::ALL {
            let Some(texture) = material.textures[slot] else {
                continue;
            };
            let same = |t: &TextureRef| {
                t.uv_set == texture.uv_set && t.uv_transform == texture.uv_transform
            };
            if known.iter().any(same) {
                continue;
            }
            if known.len() == MAX_COORDINATES {
                material.textures[slot] = None;
                self.warnings.count("coordinates", || {
                    format!(
                        "{} has textures with more than {MAX_COORDINATES} different coordinates; the others are left out",
                        self.place
                    )
                });
                continue;
            }
            known.push(texture);
        }
    }

    /// KHR_texture_transform of a texture that the crate leaves as JSON.
    fn transform(&self, json: Option<&Value>) -> Result<Option<TextureTransform>, SceneError> {
        json.map(TextureTransform::deserialize)
            .transpose()
            .map_err(|e| {
                let place = format!("{}, {TRANSFORM}", self.place);
                self.buffers
                    .origin
                    .invalid(place, "a texture transform", e.to_string())
            })
    }

    fn texture(
        &mut self,
        slot: TextureSlot,
        texture: &Texture<'_>,
        uv_set: u32,
        transform: Option<TextureTransform>,
        usage: Usage,
    ) -> Result<Option<TextureRef>, SceneError> {
        if !self.options.slots.contains(slot) {
            return Ok(None);
        }
        let uv_set = transform
            .as_ref()
            .and_then(|t| t.tex_coord)
            .unwrap_or(uv_set);
        let Some(image) = self.texture_images.get(texture.index()).copied().flatten() else {
            self.warnings.count("no image", || {
                format!(
                    "{} uses textures[{}], which has no image; left out",
                    self.place,
                    texture.index()
                )
            });
            return Ok(None);
        };
        if !self.sets.contains(&uv_set) {
            if let [a, b] = self.sets[..] {
                self.warnings.count("uv set", || {
                    format!(
                        "{} uses TEXCOORD_{a}, TEXCOORD_{b} and TEXCOORD_{uv_set}; a material has at most two sets, the texture of the last one is left out",
                        self.place
                    )
                });
                return Ok(None);
            }
            self.sets.push(uv_set);
        }
        let request = self.request(image, usage)?;
        let uv_transform = transform.map_or(TextureRef::IDENTITY, |t| matrix(&t));
        if !uv_transform.as_flattened().iter().all(|v| v.is_finite()) {
            return Err(self.buffers.origin.invalid(
                format!("{}, {TRANSFORM}", self.place),
                "finite numbers",
                format!("{uv_transform:?}"),
            ));
        }
        Ok(Some(TextureRef {
            image: self.requests.index(request),
            sampler: sampler(&texture.sampler()),
            uv_set,
            uv_transform,
        }))
    }

    fn request(&mut self, index: usize, usage: Usage) -> Result<Request, SceneError> {
        let place = format!("images[{index}], used by {}", self.place);
        let (source, name) = match self.sources.get(&index) {
            Some(known) => known.clone(),
            None => {
                let read = self.source(index, &place)?;
                self.sources.insert(index, read.clone());
                read
            }
        };
        let given = self.buffers.root.images.get(index);
        let given = given.and_then(|image| image.name.clone());
        let given = given.filter(|name| !name.is_empty());
        Ok(Request {
            source,
            usage,
            name: name.or(given).unwrap_or_else(|| format!("image-{index}")),
            place,
        })
    }

    /// The source of an image, and its file's name.
    fn source(
        &mut self,
        index: usize,
        place: &str,
    ) -> Result<(Source, Option<String>), SceneError> {
        let origin = self.buffers.origin;
        let embedded = |bytes: Arc<[u8]>| {
            Source::Bytes(Embedded {
                number: index,
                bytes,
            })
        };
        let Some(json) = self.buffers.root.images.get(index) else {
            return Err(origin.invalid(
                place,
                format!("one of {} images", self.buffers.root.images.len()),
                index.to_string(),
            ));
        };
        match (&json.uri, &json.buffer_view) {
            (Some(uri), _) => match uri::parse(uri) {
                Ok(Uri::Path(path)) => {
                    let (lookup, warnings) = (&mut *self.lookup, &mut self.warnings);
                    let file = find_file(origin, uri, path, place, lookup, warnings);
                    let name = file.file_name();
                    let name = name.map(|n| n.to_string_lossy().into_owned());
                    Ok((Source::File(file), name))
                }
                Ok(Uri::Data(bytes)) => Ok((embedded(bytes.into()), None)),
                Err(found) => Err(origin.invalid(place, "a data URI or relative path", found)),
            },
            (None, Some(view)) => Ok((embedded(self.buffers.view(view.value())?.into()), None)),
            (None, None) => Err(origin.invalid(place, "a uri or a bufferView", "neither")),
        }
    }
}

/// KHR_texture_transform: translation * rotation * scale, rows of the 2x3 matrix.
fn matrix(transform: &TextureTransform) -> [[f32; 3]; 2] {
    let ([tx, ty], [sx, sy]) = (transform.offset.0, transform.scale.0);
    let (sin, cos) = transform.rotation.0.sin_cos();
    // The extension rotates counter-clockwise with v growing downwards.
    [[cos * sx, sin * sy, tx], [-sin * sx, cos * sy, ty]]
}

/// A mode that a glTF sampler leaves out is trilinear.
fn sampler(json: &gltf::texture::Sampler<'_>) -> Sampler {
    let wrap = |mode| match mode {
        WrappingMode::ClampToEdge => Wrap::ClampToEdge,
        WrappingMode::MirroredRepeat => Wrap::MirroredRepeat,
        WrappingMode::Repeat => Wrap::Repeat,
    };
    let (min, mip) = match json.min_filter() {
        Some(MinFilter::Nearest) => (Filter::Nearest, MipFilter::None),
        Some(MinFilter::Linear) => (Filter::Linear, MipFilter::None),
        Some(MinFilter::NearestMipmapNearest) => (Filter::Nearest, MipFilter::Nearest),
        Some(MinFilter::LinearMipmapNearest) => (Filter::Linear, MipFilter::Nearest),
        Some(MinFilter::NearestMipmapLinear) => (Filter::Nearest, MipFilter::Linear),
        Some(MinFilter::LinearMipmapLinear) | None => (Filter::Linear, MipFilter::Linear),
    };
    Sampler {
        wrap: [wrap(json.wrap_s()), wrap(json.wrap_t())],
        mag: match json.mag_filter() {
            Some(MagFilter::Nearest) => Filter::Nearest,
            Some(MagFilter::Linear) | None => Filter::Linear,
        },
        min,
        mip,
        ..Sampler::TRILINEAR_REPEAT
    }
}
