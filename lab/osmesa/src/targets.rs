//! Targets of layers and shadow maps.

use crate::gl::{Framebuffer, Gl, Sampler, Texture};
use raster::draws::SHADOW_SIZE;
use raster::error::RasterError;

/// Most pixels along a view's edge: records hold 12 bits of quad column and row.
const MAX_EDGE_PX: u64 = 8192;

/// Target of a layer.
#[derive(Clone, Copy)]
pub struct Target {
    /// Width and height in pixels.
    pub size_px: [u32; 2],
    /// Colour and depth.
    pub framebuffer: Framebuffer,
}

impl Target {
    /// A target of `size_px`.
    ///
    /// # Errors
    /// A size of 0 or beyond the driver's limit, and driver errors.
    pub fn new(gl: &Gl, size_px: [u32; 2]) -> Result<Self, RasterError> {
        let limit = gl.limit(glow::MAX_TEXTURE_SIZE).min(MAX_EDGE_PX);
        if let Some(&extent) = (size_px.iter()).find(|&&e| e == 0 || u64::from(e) > limit) {
            return Err(RasterError::TooLarge {
                what: "pixels along a view's edge (at least 1)".into(),
                found: extent.into(),
                limit,
            });
        }
        let color = gl.texture(glow::SRGB8_ALPHA8, size_px, 1, None)?;
        let depth = gl.texture(glow::DEPTH_COMPONENT32F, size_px, 1, None)?;
        Ok(Self {
            size_px,
            framebuffer: gl.framebuffer(Some(color), depth, None)?,
        })
    }
}

/// The shadow map array.
pub struct ShadowMaps {
    /// All layers.
    pub texture: Texture,
    /// Compares with the nearest four texels.
    pub sampler: Sampler,
    /// Each layer.
    pub layers: Vec<Framebuffer>,
}

impl ShadowMaps {
    /// An array of `cascades` layers; without any, a single texel that no program samples.
    ///
    /// # Errors
    /// Driver errors.
    pub fn new(gl: &Gl, cascades: u32) -> Result<Self, RasterError> {
        let edge = if cascades == 0 { 1 } else { SHADOW_SIZE };
        let layers = Some(cascades.max(1));
        let texture = gl.texture(glow::DEPTH_COMPONENT32F, [edge; 2], 1, layers)?;
        let parameters = [
            (glow::TEXTURE_WRAP_S, glow::CLAMP_TO_EDGE),
            (glow::TEXTURE_WRAP_T, glow::CLAMP_TO_EDGE),
            (glow::TEXTURE_MIN_FILTER, glow::LINEAR),
            (glow::TEXTURE_MAG_FILTER, glow::LINEAR),
            (glow::TEXTURE_COMPARE_MODE, glow::COMPARE_REF_TO_TEXTURE),
            (glow::TEXTURE_COMPARE_FUNC, glow::LEQUAL),
        ];
        let layers = (0..cascades)
            .map(|layer| gl.framebuffer(None, texture, Some(layer)))
            .collect::<Result<_, _>>()?;
        Ok(Self {
            texture,
            sampler: gl.sampler(&parameters, 32.0)?,
            layers,
        })
    }
}
