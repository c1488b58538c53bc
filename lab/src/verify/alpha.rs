//! The alpha test of masked draws by the software sampler.

use super::geometry::Geometry;
use super::lod::level_of_detail;
use super::piece::{Piece, center};
use super::reference::AlphaTest;
use super::sampler::SoftwareSampler;
use formats::footprint::LodFormula;
use scene::{AlphaMode, TextureSlot};

/// Alpha of base colour, vertex colour and texture against the material's cutoff.
pub struct SampledAlpha<'a> {
    /// The texture unit.
    pub sampler: &'a SoftwareSampler<'a>,
    /// The driver's formula of the level of detail, which its alpha test used.
    pub formula: LodFormula,
}

impl AlphaTest for SampledAlpha<'_> {
    fn margin(&self, geometry: &Geometry<'_>, piece: &Piece, pixel: [u32; 2]) -> f64 {
        let material = geometry.material(piece);
        let AlphaMode::Mask(cutoff) = material.alpha else {
            return 1.0;
        };
        let texel = material.textures[TextureSlot::BaseColor].and_then(|reference| {
            let texture = self.sampler.texture(reference.image)?;
            let at = geometry
                .coordinates(piece, &reference)
                .in_quad(pixel, self.formula);
            let lod = level_of_detail(&at, &texture.texture, self.formula);
            Some(
                self.sampler
                    .sample(texture, &reference.sampler, at.uv, lod)
                    .w,
            )
        });
        let vertex = geometry.vertex_alpha(piece, center(pixel));
        f64::from(material.base_color.w) * vertex * texel.unwrap_or(1.0) - f64::from(cutoff)
    }
}
