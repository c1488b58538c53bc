//! Textures, samplers, framebuffers and what is read back from them.

use super::{Framebuffer, Gl, Sampler, Texture, made};
use glow::HasContext;
use raster::error::RasterError;

impl Gl {
    /// Creates a texture without contents, an array if `layers` is given.
    ///
    /// # Errors
    /// Driver errors.
    pub fn texture(
        &self,
        format: u32,
        [width, height]: [u32; 2],
        levels: u32,
        layers: Option<u32>,
    ) -> Result<Texture, RasterError> {
        let (width, height, levels) = (width as i32, height as i32, levels as i32);
        // SAFETY: see the module.
        let texture = unsafe {
            let texture = self.gl.create_texture().map_err(made("a texture"))?;
            let target = target(layers.is_some());
            self.gl.bind_texture(target, Some(texture));
            match layers {
                None => self
                    .gl
                    .tex_storage_2d(target, levels, format, width, height),
                Some(n) => {
                    (self.gl).tex_storage_3d(target, levels, format, width, height, n as i32)
                }
            }
            texture
        };
        self.check("making a texture")?;
        Ok(texture)
    }

    /// Fills a level of a texture, row by row: RGBA8, or blocks of a compressed `format`.
    ///
    /// # Errors
    /// Driver errors, and compressed blocks whose size does not match.
    ///
    /// # Panics
    /// If the number of RGBA8 texels does not match the size.
    pub fn fill(
        &self,
        texture: Texture,
        level: u32,
        [width, height]: [u32; 2],
        compressed: Option<u32>,
        texels: &[u8],
    ) -> Result<(), RasterError> {
        let (at, w, h) = (level as i32, width as i32, height as i32);
        // SAFETY: see the module. The driver checks the length of compressed levels.
        unsafe {
            self.gl.bind_texture(glow::TEXTURE_2D, Some(texture));
            if let Some(format) = compressed {
                let blocks = glow::CompressedPixelUnpackData::Slice(texels);
                (self.gl).compressed_tex_sub_image_2d(
                    glow::TEXTURE_2D,
                    at,
                    0,
                    0,
                    w,
                    h,
                    format,
                    blocks,
                );
            } else {
                assert_eq!(
                    texels.len() as u64,
                    4 * u64::from(width) * u64::from(height)
                );
                let texels = glow::PixelUnpackData::Slice(Some(texels));
                let (format, kind) = (glow::RGBA, glow::UNSIGNED_BYTE);
                (self.gl).tex_sub_image_2d(glow::TEXTURE_2D, at, 0, 0, w, h, format, kind, texels);
            }
        }
        self.check("uploading a texture")
    }

    /// Creates a sampler with integer parameters and the highest level that it reads.
    ///
    /// # Errors
    /// Driver errors.
    pub fn sampler(&self, parameters: &[(u32, u32)], max_lod: f32) -> Result<Sampler, RasterError> {
        // SAFETY: see the module.
        let sampler = unsafe {
            let sampler = self.gl.create_sampler().map_err(made("a sampler"))?;
            for &(name, value) in parameters {
                self.gl.sampler_parameter_i32(sampler, name, value as i32);
            }
            self.gl
                .sampler_parameter_f32(sampler, glow::TEXTURE_MAX_LOD, max_lod);
            sampler
        };
        self.check("making a sampler")?;
        Ok(sampler)
    }

    /// Binds a texture and a sampler to a unit.
    pub fn bind_texture(&self, unit: u32, is_array: bool, texture: Texture, sampler: Sampler) {
        // SAFETY: see the module.
        unsafe {
            self.gl.active_texture(glow::TEXTURE0 + unit);
            self.gl.bind_texture(target(is_array), Some(texture));
            self.gl.bind_sampler(unit, Some(sampler));
        }
    }

    /// Creates a framebuffer from an optional colour texture and a depth texture or a layer of one.
    ///
    /// # Errors
    /// Driver errors.
    pub fn framebuffer(
        &self,
        color: Option<Texture>,
        depth: Texture,
        layer: Option<u32>,
    ) -> Result<Framebuffer, RasterError> {
        let target = glow::FRAMEBUFFER;
        // SAFETY: see the module.
        let (framebuffer, status) = unsafe {
            let framebuffer = self
                .gl
                .create_framebuffer()
                .map_err(made("a framebuffer"))?;
            self.gl.bind_framebuffer(target, Some(framebuffer));
            match layer {
                None => {
                    (self.gl).framebuffer_texture(target, glow::DEPTH_ATTACHMENT, Some(depth), 0)
                }
                Some(layer) => (self.gl).framebuffer_texture_layer(
                    target,
                    glow::DEPTH_ATTACHMENT,
                    Some(depth),
                    0,
                    layer as i32,
                ),
            }
            if color.is_some() {
                (self.gl).framebuffer_texture(target, glow::COLOR_ATTACHMENT0, color, 0);
            }
            let drawn = color.map_or(glow::NONE, |_| glow::COLOR_ATTACHMENT0);
            self.gl.draw_buffers(&[drawn]);
            (framebuffer, self.gl.check_framebuffer_status(target))
        };
        self.check("making a framebuffer")?;
        if status == glow::FRAMEBUFFER_COMPLETE {
            return Ok(framebuffer);
        }
        Err(made("a framebuffer")(format!("status {status:#x}")))
    }

    /// Sets the framebuffer, its size, and the rectangle for later draws.
    pub fn target(&self, framebuffer: Framebuffer, size_px: [u32; 2], scissor: [[u32; 2]; 2]) {
        let [[x, y], [width, height]] = scissor.map(|pair| pair.map(|px| px as i32));
        // SAFETY: see the module.
        unsafe {
            self.gl
                .bind_framebuffer(glow::FRAMEBUFFER, Some(framebuffer));
            self.gl.viewport(0, 0, size_px[0] as i32, size_px[1] as i32);
            self.gl.scissor(x, y, width, height);
        }
    }

    /// Clears the depth of the current target to the farthest value.
    pub fn clear_depth(&self) {
        // SAFETY: see the module.
        unsafe {
            self.gl.depth_mask(true);
            self.gl.clear_buffer_f32_slice(glow::DEPTH, 0, &[1.0]);
        }
    }

    /// The colours of a framebuffer: sRGB RGBA8, row by row.
    pub fn pixels(&self, framebuffer: Framebuffer, [width, height]: [u32; 2]) -> Vec<u8> {
        let mut pixels = vec![0; 4 * width as usize * height as usize];
        let into = glow::PixelPackData::Slice(Some(&mut pixels));
        let (width, height) = (width as i32, height as i32);
        // SAFETY: see the module. The vector has four bytes per pixel.
        unsafe {
            self.gl
                .bind_framebuffer(glow::FRAMEBUFFER, Some(framebuffer));
            self.gl
                .read_pixels(0, 0, width, height, glow::RGBA, glow::UNSIGNED_BYTE, into);
        }
        pixels
    }

    /// Depth of a framebuffer, row by row.
    pub fn depths(&self, framebuffer: Framebuffer, [width, height]: [u32; 2]) -> Vec<f32> {
        let mut depths = vec![0.0_f32; width as usize * height as usize];
        let into = glow::PixelPackData::Slice(Some(bytemuck::cast_slice_mut(&mut depths)));
        let (width, height) = (width as i32, height as i32);
        // SAFETY: see the module. The vector has one float per pixel.
        unsafe {
            self.gl
                .bind_framebuffer(glow::FRAMEBUFFER, Some(framebuffer));
            (self.gl).read_pixels(
                0,
                0,
                width,
                height,
                glow::DEPTH_COMPONENT,
                glow::FLOAT,
                into,
            );
        }
        depths
    }
}

fn target(is_array: bool) -> u32 {
    if is_array {
        glow::TEXTURE_2D_ARRAY
    } else {
        glow::TEXTURE_2D
    }
}
