//! Properties of a scene's materials for rays.

use super::soup::{Attributes, Soup};
use super::texture::{Pyramid, fast_log2};
use formats::raytrace::RayMaterial;
use glam::{Vec3, Vec4};
use rayon::prelude::*;
use scene::{AlphaMode, Material, Scene, SceneError, TextureRef, TextureSlot};

/// Dielectrics below this roughness get a highlight.
const GLOSSY_ROUGHNESS: f32 = 0.7;
/// Metals below this roughness mirror their surroundings.
const MIRROR_ROUGHNESS: f32 = 0.35;

/// Alpha from which a blended surface stops a closest-hit ray.
const BLEND_STOPS_FROM: f32 = 1.0 / 255.0;

/// Dielectrics below this roughness mirror their surroundings, with Fresnel's reflectance.
const POLISHED_ROUGHNESS: f32 = 0.15;

/// The sampled properties of a material at a hit.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    /// Diffuse albedo, linear.
    pub albedo: Vec3,
    /// Reflectance at normal incidence, linear.
    pub specular: Vec3,
    /// Fraction mirrored in addition to Fresnel's reflectance.
    pub mirror: f32,
    /// Colour of that fraction.
    pub mirror_tint: Vec3,
    /// True if the surface is smooth enough to show a mirror image.
    pub polished: bool,
    /// Blinn-Phong exponent, 0 for no highlight.
    pub exponent: u32,
    /// Fraction of light that is transmitted, refracted.
    pub transmission: f32,
    /// Colour of the transmitted light.
    pub tint: Vec3,
    /// Index of refraction.
    pub ior: f32,
    /// Coverage: 1 except for blended surfaces.
    pub alpha: f32,
    /// Emitted radiance.
    pub emissive: Vec3,
}

/// A primitive and the weights of its second and third vertex.
pub(crate) type Hit = (u32, [f32; 2]);

/// Materials and their textures.
pub struct Materials {
    materials: Vec<Material>,
    pyramids: Vec<Option<Pyramid>>,
    srgb: &'static [f32; 256],
}

impl Materials {
    /// Creates the pyramids of the images that rays sample.
    ///
    /// # Errors
    /// Images that cannot be read or decoded.
    pub fn new(scene: &Scene) -> Result<Self, SceneError> {
        let mut used = vec![false; scene.images.len()];
        for texture in scene.materials.iter().flat_map(ray_textures) {
            if let Some(used) = used.get_mut(texture.image) {
                *used = true;
            }
        }
        let texels = scene::image::texels(&scene.images, |i| used[i])?;
        let pyramids = (scene.images.par_iter())
            .zip(texels)
            .map(|(image, rgba)| Pyramid::new(image, rgba?))
            .collect();
        Ok(Self {
            materials: scene.materials.clone(),
            pyramids,
            srgb: &scene::srgb::LINEAR,
        })
    }

    /// The material table of a trace.
    pub fn table(&self) -> Vec<RayMaterial> {
        self.materials.iter().map(describe).collect()
    }

    /// Properties at a hit. `footprint_m` is the ray's width there.
    pub fn surface(&self, material: usize, at: &Attributes, footprint_m: f32) -> Surface {
        let m = &self.materials[material];
        let sample = |t: &Option<TextureRef>| self.sample(t.as_ref(), at, footprint_m);
        let base = m.base_color
            * at.color
            * sample(&m.textures[TextureSlot::BaseColor]).unwrap_or(Vec4::ONE);
        let rough_metal = sample(&m.textures[TextureSlot::MetallicRoughness]).unwrap_or(Vec4::ONE);
        let roughness = (m.roughness * rough_metal.y).clamp(0.0, 1.0);
        let metallic = (m.metallic * rough_metal.z).clamp(0.0, 1.0);
        let emissive = m.emissive
            * sample(&m.textures[TextureSlot::Emissive])
                .unwrap_or(Vec4::ONE)
                .truncate();
        let color = base.truncate();
        let specular = (0.04 * m.specular).lerp(color, metallic);
        let smooth_metal = if roughness < MIRROR_ROUGHNESS {
            metallic
        } else {
            0.0
        };
        let mirror = m.mirror.max(smooth_metal * (1.0 - roughness));
        let opaque = (1.0 - m.transmission) * (1.0 - m.mirror);
        Surface {
            albedo: color * (1.0 - metallic) * opaque,
            specular,
            mirror,
            mirror_tint: Vec3::ONE.lerp(color, metallic),
            polished: mirror > 0.0 || m.transmission > 0.0 || roughness < POLISHED_ROUGHNESS,
            exponent: highlight_exponent(roughness),
            transmission: m.transmission,
            tint: color,
            ior: m.ior.max(1.0),
            alpha: match m.alpha {
                AlphaMode::Blend => base.w.clamp(0.0, 1.0),
                _ => 1.0,
            },
            emissive,
        }
    }

    /// The interpolated normal, bent by the material's normal map, if it has one. The capture
    /// shader's is the same.
    pub(crate) fn bent_normal(&self, material: usize, at: &Attributes, footprint_m: f32) -> Vec3 {
        let m = &self.materials[material];
        let (normal, tangent) = (at.shading_normal, at.tangent);
        let Some(texel) = self.sample(m.textures[TextureSlot::Normal].as_ref(), at, footprint_m)
        else {
            return normal;
        };
        let [x, y, z] = (texel.truncate() * 2.0 - 1.0).to_array();
        let along = tangent.truncate();
        let along = (along - normal * normal.dot(along)).normalize_or_zero();
        let across = normal.cross(along) * tangent.w;
        let bent = m.normal_scale * (x * along + y * across) + z.max(0.05) * normal;
        bent.normalize_or(normal)
    }

    /// Alpha of a masked or blended material at full resolution.
    fn alpha(&self, material: &Material, scene: &Scene, soup: &Soup, hit: Hit) -> f32 {
        let (primitive, bary) = hit;
        let texel = material.textures[TextureSlot::BaseColor]
            .as_ref()
            .and_then(|t| {
                let pyramid = self.pyramids.get(t.image)?.as_ref()?;
                let uv = soup.uv(scene, primitive, bary, t.uv_set);
                Some(pyramid.sample(t, uv, 0.0, self.srgb).w)
            });
        // As in the raster capture, a mask without a texture is tested once per draw.
        let constant = texel.is_none() && material.alpha != AlphaMode::Blend;
        let vertex = if constant {
            1.0
        } else {
            soup.vertex_alpha(scene, primitive, bary)
        };
        material.base_color.w * vertex * texel.unwrap_or(1.0)
    }

    /// True if the surface stops a closest-hit ray.
    pub fn stops(&self, scene: &Scene, soup: &Soup, primitive: u32, bary: [f32; 2]) -> bool {
        let material = &self.materials[soup.material(scene, primitive)];
        let alpha = || self.alpha(material, scene, soup, (primitive, bary));
        match material.alpha {
            AlphaMode::Opaque => true,
            AlphaMode::Mask(cutoff) => alpha() >= cutoff,
            AlphaMode::Blend => alpha() >= BLEND_STOPS_FROM,
        }
    }

    /// True if the surface casts a shadow. Glass and nearly transparent surfaces do not.
    pub fn shades(&self, scene: &Scene, soup: &Soup, primitive: u32, bary: [f32; 2]) -> bool {
        let material = &self.materials[soup.material(scene, primitive)];
        let alpha = || self.alpha(material, scene, soup, (primitive, bary));
        match material.alpha {
            _ if material.transmission > 0.5 => false,
            AlphaMode::Opaque => true,
            AlphaMode::Mask(cutoff) => alpha() >= cutoff,
            AlphaMode::Blend => alpha() >= 0.5,
        }
    }

    /// The light of a shadow ray that passes the surface, with the colours of glass (once, on entry)
    /// and of blended surfaces.
    pub(crate) fn passes(&self, scene: &Scene, soup: &Soup, hit: Hit, enters: bool) -> Vec3 {
        let material = &self.materials[soup.material(scene, hit.0)];
        let alpha = || self.alpha(material, scene, soup, hit);
        let open = |open: bool| if open { Vec3::ONE } else { Vec3::ZERO };
        match material.alpha {
            _ if material.transmission > 0.0 && !enters => Vec3::ONE,
            _ if material.transmission > 0.0 => {
                let at = soup.attributes(scene, hit.0, hit.1);
                self.surface(soup.material(scene, hit.0), &at, 0.0).tint * material.transmission
            }
            AlphaMode::Opaque => Vec3::ZERO,
            AlphaMode::Mask(cutoff) => open(alpha() < cutoff),
            AlphaMode::Blend => Vec3::splat((1.0 - alpha()).clamp(0.0, 1.0)),
        }
    }

    fn sample(
        &self,
        texture: Option<&TextureRef>,
        at: &Attributes,
        footprint_m: f32,
    ) -> Option<Vec4> {
        let texture = texture?;
        let pyramid = self.pyramids.get(texture.image)?.as_ref()?;
        let set = usize::from(texture.uv_set == 1);
        let [[a, b, _], [d, e, _]] = texture.uv_transform;
        let [width, height] = pyramid.size();
        let scale = (a * e - b * d).abs() * width as f32 * height as f32;
        // Texels across the footprint, squared.
        let texels = at.uv_density[set] * scale * footprint_m * footprint_m;
        let lod = 0.5 * fast_log2(texels);
        Some(pyramid.sample(texture, at.uv[set], lod, self.srgb))
    }
}

/// True if rays must test alpha or may pass through the material.
pub fn needs_alpha_test(m: &Material) -> bool {
    m.alpha != AlphaMode::Opaque || m.transmission > 0.0
}

/// Textures of the materials that rays sample. With normal maps, they also sample these.
pub const SLOTS: [TextureSlot; 3] = [
    TextureSlot::BaseColor,
    TextureSlot::MetallicRoughness,
    TextureSlot::Emissive,
];

/// The textures of a material that rays sample.
fn ray_textures(m: &Material) -> impl Iterator<Item = TextureRef> {
    let slots = SLOTS.into_iter().chain([TextureSlot::Normal]);
    slots.filter_map(|slot| m.textures[slot])
}

/// Blinn-Phong exponent of a roughness (Karis 2013), 0 where there is no visible highlight.
fn highlight_exponent(roughness: f32) -> u32 {
    if roughness >= GLOSSY_ROUGHNESS {
        return 0;
    }
    let a = roughness.max(0.05);
    (2.0 / (a * a * a * a) - 2.0).clamp(1.0, 4096.0) as u32
}

fn describe(m: &Material) -> RayMaterial {
    let glass = m.transmission > 0.0 || m.alpha == AlphaMode::Blend;
    // Textures reduce both factors, so any texel may be smoother or less metallic.
    let may_be_smooth =
        m.textures[TextureSlot::MetallicRoughness].is_some() || m.roughness < MIRROR_ROUGHNESS;
    let metal = m.metallic > 0.0 && may_be_smooth;
    let polished =
        m.textures[TextureSlot::MetallicRoughness].is_some() || m.roughness < POLISHED_ROUGHNESS;
    let glossy =
        m.textures[TextureSlot::MetallicRoughness].is_some() || m.roughness < GLOSSY_ROUGHNESS;
    let flawless = m.textures[TextureSlot::MetallicRoughness].is_none()
        && m.metallic * (1.0 - m.roughness) >= 1.0;
    RayMaterial {
        name: m.name.clone(),
        diffuse: m.transmission < 1.0
            && m.mirror < 1.0
            && !flawless
            && (m.metallic < 1.0 || may_be_smooth),
        mirror: m.mirror > 0.0 || metal || polished,
        glass,
        glossy,
        alpha_masked: match m.alpha {
            AlphaMode::Opaque => false,
            AlphaMode::Mask(_) => true,
            AlphaMode::Blend => {
                m.textures[TextureSlot::BaseColor].is_some() || m.base_color.w < BLEND_STOPS_FROM
            }
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blended_textures_and_masks_need_an_alpha_test() {
        let masked = |alpha, alpha_factor: f32, textured: bool| {
            let material = Material {
                alpha,
                base_color: Vec4::new(1.0, 1.0, 1.0, alpha_factor),
                textures: [(TextureSlot::BaseColor, textured.then(|| TextureRef::new(0)))].into(),
                ..Material::default()
            };
            describe(&material).alpha_masked
        };
        assert!(masked(AlphaMode::Blend, 1.0, true));
        assert!(masked(AlphaMode::Blend, 0.001, false));
        assert!(masked(AlphaMode::Mask(0.5), 1.0, true));
        // A surface of constant alpha stops every ray.
        assert!(!masked(AlphaMode::Blend, 0.5, false));
        assert!(!masked(AlphaMode::Opaque, 1.0, true));
    }
}
