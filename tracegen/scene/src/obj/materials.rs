//! Conversion of a library's entries to materials, and the images that they sample.
//!
//! Properties for the ray tracer: with `illum` 3, 5 and 8 a material reflects as much as `Ks`
//! states. With `illum` 4, 6, 7 and 9, and for untextured materials with `d` below 1, it transmits
//! `1 - d`.

use super::library::{Entry, Map};
use crate::files::Origin;
use crate::image_files::{Request, Requests, Source, Usage, is_readable};
use crate::lookup::{Found, Lookup};
use crate::warnings::Warnings;
use crate::{AlphaMode, LoadOptions, Material, TextureRef, TextureSlot};
use formats::texture::Wrap;
use glam::Vec3;

/// `illum` models that mirror: 3 (reflection), 5 (Fresnel reflection), 8 (reflection, no rays).
const MIRRORS: [u8; 3] = [3, 5, 8];
/// `illum` models that refract: 4, 6, 7, 9.
const GLASSES: [u8; 4] = [4, 6, 7, 9];

/// Inputs for the materials.
pub(super) struct Maker<'a> {
    /// The library, whose folder its textures are relative to.
    pub library: &'a Origin,
    /// The OBJ file. Textures that are not beside the library are looked up beside it.
    pub scene: &'a Origin,
    pub options: &'a LoadOptions,
    pub lookup: &'a mut Lookup,
    pub requests: &'a mut Requests,
    pub warnings: &'a mut Warnings,
}

impl Maker<'_> {
    /// Converts the entry to a material.
    pub fn material(&mut self, entry: &Entry) -> Material {
        let unit = |value: f32| {
            if value.is_nan() {
                1.0
            } else {
                value.clamp(0.0, 1.0)
            }
        };
        let dissolve = unit(self.dissolve(entry));
        let illumination = entry.illumination.unwrap_or(2.0) as u8;
        let shininess = entry.shininess.unwrap_or(32.0).max(0.0);
        let specular = entry.specular.unwrap_or(Vec3::ZERO).map(unit);
        let mut result = Material {
            name: entry.name.clone(),
            base_color: (entry.diffuse.unwrap_or(Vec3::ONE))
                .map(unit)
                .extend(dissolve),
            specular,
            // Blinn-Phong exponent to roughness: alpha^2 = 2 / (n + 2), perceptual = sqrt(alpha).
            roughness: (2.0 / (shininess + 2.0)).sqrt().sqrt(),
            emissive: (entry.emissive.unwrap_or_default()).clamp(Vec3::ZERO, Vec3::splat(1e6)),
            ior: entry.ior.filter(|n| *n > 0.0).unwrap_or(1.5),
            alpha: if dissolve < 1.0 {
                AlphaMode::Blend
            } else {
                AlphaMode::Opaque
            },
            double_sided: true,
            ..Material::default()
        };
        if MIRRORS.contains(&illumination) {
            result.mirror = specular.max_element();
        }
        if GLASSES.contains(&illumination) || (dissolve < 1.0 && entry.diffuse_map.is_none()) {
            result.transmission = 1.0 - dissolve;
        }
        let bump = entry.bump_map.as_ref().or(entry.normal_map.as_ref());
        result.normal_scale = bump.map_or(1.0, |map| map.bump_multiplier.clamp(-100.0, 100.0));
        for (slot, map, usage) in [
            (TextureSlot::Normal, bump, Usage::Data),
            (
                TextureSlot::Specular,
                entry.specular_map.as_ref(),
                Usage::Color,
            ),
            (
                TextureSlot::Emissive,
                entry.emissive_map.as_ref(),
                Usage::Color,
            ),
        ] {
            result.textures[slot] = self.texture(slot, entry, map, usage);
        }
        if result.textures[TextureSlot::Specular].is_some() && result.specular == Vec3::ZERO {
            result.specular = Vec3::ONE;
        }
        if result.textures[TextureSlot::Emissive].is_some() && result.emissive == Vec3::ZERO {
            result.emissive = Vec3::ONE;
        }
        if self.options.slots.contains(TextureSlot::BaseColor) {
            self.add_base_color(entry, &mut result);
        }
        result
    }

    /// `d`, or `1 - Tr` if `d` is missing. A lone `Tr 1` would hide the material; exporters that
    /// write it mean opaque.
    fn dissolve(&mut self, entry: &Entry) -> f32 {
        match (entry.dissolve, entry.transparency) {
            (Some(dissolve), _) => dissolve,
            (None, Some(transparency)) if transparency >= 1.0 => {
                let place = place(self.library, entry);
                self.warnings.count("opaque Tr", || {
                    format!("{place}: 'Tr 1' without 'd' is taken as opaque")
                });
                1.0
            }
            (None, Some(transparency)) => 1.0 - transparency,
            (None, None) => 1.0,
        }
    }

    /// The colour map, with the opacity map in its alpha. The material becomes alpha-masked.
    fn add_base_color(&mut self, entry: &Entry, result: &mut Material) {
        let opacity =
            (entry.opacity_map.as_ref()).and_then(|map| self.request(entry, map, Usage::Data));
        let usage = match &opacity {
            Some(opacity) => {
                result.alpha = AlphaMode::Mask(0.5);
                result.base_color.w = 1.0;
                Usage::Masked(self.requests.mask(opacity.clone()))
            }
            None => Usage::Color,
        };
        let color = entry.diffuse_map.as_ref();
        result.textures[TextureSlot::BaseColor] = self
            .texture(TextureSlot::BaseColor, entry, color, usage)
            .or_else(|| {
                // An opacity map without a colour map serves as both. `Kd` still colours it.
                let both = Request { usage, ..opacity? };
                let image = self.requests.index(both);
                Some(reference(image, entry.opacity_map.as_ref()?))
            });
    }

    fn texture(
        &mut self,
        slot: TextureSlot,
        entry: &Entry,
        map: Option<&Map>,
        usage: Usage,
    ) -> Option<TextureRef> {
        let map = map?;
        if !self.options.slots.contains(slot) {
            // The scene still refers to the file, so no output may overwrite it.
            self.find(map);
            return None;
        }
        let request = self.request(entry, map, usage)?;
        Some(reference(self.requests.index(request), map))
    }

    /// The map's file, beside the library or else beside the scene.
    fn find(&mut self, map: &Map) -> Option<Found> {
        let folders = [self.library.folder(), self.scene.folder()];
        (folders.iter()).find_map(|folder| self.lookup.find(folder, &map.names))
    }

    /// `None`, with a warning, if the file does not exist or its format is not supported.
    fn request(&mut self, entry: &Entry, map: &Map, usage: Usage) -> Option<Request> {
        let name = &map.names[0];
        let place = place(self.library, entry);
        let Some(found) = self.find(map) else {
            self.warnings.count("missing texture", || {
                format!("{place}: texture '{name}' is not there; left out")
            });
            return None;
        };
        let file = found.path.display();
        if found.inexact {
            self.warnings.count("inexact name", || {
                format!("{place}: texture '{name}' is taken from {file}")
            });
        }
        if is_readable(&found.path) == Some(false) {
            self.warnings.count("image format", || {
                format!("{place}: {file} is no PNG, JPEG, WebP, KTX2 or DDS image; left out")
            });
            return None;
        }
        let name = found.path.file_name().unwrap_or_default().to_string_lossy();
        Some(Request {
            usage,
            name: name.into_owned(),
            place,
            source: Source::File(found.path),
        })
    }
}

fn place(library: &Origin, entry: &Entry) -> String {
    format!("{}: material '{}'", library.file.display(), entry.name)
}

/// The image with the map's options. They assume a v that grows upwards, so
/// `1 - v' = s (1 - v) + o`.
fn reference(image: usize, map: &Map) -> TextureRef {
    let mut reference = TextureRef::new(image);
    let ([su, sv], [ou, ov]) = (map.scale.to_array(), map.offset.to_array());
    reference.uv_transform = [[su, 0.0, ou], [0.0, sv, 1.0 - sv - ov]];
    if map.clamp {
        reference.sampler.wrap = [Wrap::ClampToEdge; 2];
    }
    reference
}
