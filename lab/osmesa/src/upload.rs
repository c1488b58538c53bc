//! The scene in the driver's memory: vertices that triangles do not share, textures, materials,
//! instances.

use crate::gl::{Attribute, Buffer, Gl, Sampler, Texture, Vertices};
use formats::texture::{self, ColorSpace, Filter, MipFilter, TexelFormat, Wrap};
use raster::draws::DrawList;
use raster::error::RasterError;
use raster::uniforms::MaterialData;
use raster::vertices::{self, COLOR_STRIDE, InstanceData, VERTEX_STRIDE, VertexData};
use scene::{Animation, Material, Mesh, Scene, TextureSlot};
use textures::{CompressedTexture, TextureSet};

/// S3TC with sRGB, missing in the bindings.
const SRGB_ALPHA_DXT1: u32 = 0x8C4D;
const SRGB_ALPHA_DXT5: u32 = 0x8C4F;
const RGBA_DXT1: u32 = 0x83F1;
const RGBA_DXT5: u32 = 0x83F3;

/// A material in the driver's memory.
pub struct MaterialObjects {
    /// The shader's `Material`.
    pub uniform: Buffer,
    /// Texture of each unit; white if it has none.
    pub units: [(Texture, Sampler); TextureSlot::COUNT],
}

/// A mesh in the driver's memory.
pub struct MeshObjects {
    /// The attributes of its vertices.
    pub vertices: Vertices,
    /// Their interleaved part.
    interleaved: Buffer,
}

/// The uploaded scene.
pub struct SceneObjects {
    /// By the scene's mesh number; `None` for a mesh that no draw uses.
    pub meshes: Vec<Option<MeshObjects>>,
    /// By the scene's material number.
    pub materials: Vec<MaterialObjects>,
    /// One row per draw.
    pub instances: Buffer,
    /// Draw numbers by instance, written before each pass.
    pub instance_draws: Buffer,
    /// Distinct samplers.
    pub samplers: usize,
}

impl SceneObjects {
    /// Uploads everything that `draws` use.
    ///
    /// # Errors
    /// Sizes beyond the driver's limits, and driver errors.
    pub fn new(
        gl: &Gl,
        scene: &Scene,
        draws: &DrawList,
        textures: &TextureSet,
    ) -> Result<Self, RasterError> {
        let instances = gl.buffer(bytemuck::cast_slice(&vertices::instances(draws)))?;
        let instance_draws = gl.empty_buffer(4 * draws.calls.len().max(1) as u64)?;
        let mut used = vec![false; scene.meshes.len()];
        for call in &draws.calls {
            used[call.mesh] = true;
        }
        let meshes = (scene.meshes.iter().zip(used))
            .map(|(mesh, used)| {
                used.then(|| upload_mesh(gl, mesh, instance_draws))
                    .transpose()
            })
            .collect::<Result<Vec<_>, _>>()?;
        let white = gl.texture(glow::RGBA8, [1, 1], 1, None)?;
        gl.fill(white, 0, [1, 1], None, &[255; 4])?;
        let uploaded = (textures.textures.iter())
            .map(|t| match t.blocks.as_slice() {
                // No view can see it, so it is never sampled.
                [] => Ok(white),
                _ => upload_texture(gl, t),
            })
            .collect::<Result<Vec<_>, _>>()?;
        let mut samplers = Vec::new();
        let materials = (scene.materials.iter())
            .map(|m| material(gl, m, textures, &uploaded, white, &mut samplers))
            .collect::<Result<Vec<_>, _>>()?;
        Ok(Self {
            meshes,
            materials,
            instances,
            instance_draws,
            samplers: samplers.len(),
        })
    }

    /// Writes the rows of moving draws and the moving vertices. Returns the number of bytes.
    pub fn pose(&self, gl: &Gl, scene: &Scene, draws: &DrawList) -> u64 {
        let mut bytes = 0;
        for mesh in scene.animation.iter().flat_map(Animation::moving_meshes) {
            let Some(objects) = &self.meshes[mesh] else {
                continue;
            };
            let corners = corners(&scene.meshes[mesh]);
            let contents: &[u8] = bytemuck::cast_slice(&corners);
            gl.write(objects.interleaved, 0, contents);
            bytes += contents.len() as u64;
        }
        let row_bytes = size_of::<InstanceData>() as u64;
        for &draw in &draws.moving {
            let row = InstanceData::new(draw, &draws.calls[draw as usize]);
            gl.write(
                self.instances,
                u64::from(draw) * row_bytes,
                bytemuck::bytes_of(&row),
            );
        }
        bytes + draws.moving.len() as u64 * row_bytes
    }
}

/// The corners of a mesh's triangles, three per triangle.
fn corners(mesh: &Mesh) -> Vec<VertexData> {
    let shared = vertices::pack(mesh);
    let corners = &mesh.indices[..3 * mesh.triangles()];
    corners.iter().map(|&i| shared[i as usize]).collect()
}

/// Uploads the corners of a mesh's triangles.
fn upload_mesh(gl: &Gl, mesh: &Mesh, draws: Buffer) -> Result<MeshObjects, RasterError> {
    let vertices = gl.buffer(bytemuck::cast_slice(&corners(mesh)))?;
    let corners = &mesh.indices[..3 * mesh.triangles()];
    let interleaved = |location, components, offset| Attribute {
        buffer: vertices,
        location,
        components,
        kind: glow::FLOAT,
        stride: VERTEX_STRIDE,
        offset,
        per_instance: false,
    };
    // Primitive numbers for the shader.
    let numbers: Vec<u32> = (0..mesh.triangles() as u32).flat_map(|n| [n; 3]).collect();
    let number = |location, buffer, per_instance| Attribute {
        buffer,
        location,
        components: 1,
        kind: glow::UNSIGNED_INT,
        stride: 4,
        offset: 0,
        per_instance,
    };
    let mut attributes = vec![
        interleaved(0, 3, 0),
        interleaved(1, 3, 12),
        interleaved(2, 4, 24),
        interleaved(3, 4, 40),
        number(4, draws, true),
        number(6, gl.buffer(bytemuck::cast_slice(&numbers))?, false),
    ];
    let shared = vertices::pack_colors(mesh);
    if !shared.is_empty() {
        let own: Vec<_> = corners.iter().map(|&i| shared[i as usize]).collect();
        attributes.push(Attribute {
            buffer: gl.buffer(bytemuck::cast_slice(&own))?,
            location: 5,
            components: 4,
            kind: glow::UNSIGNED_SHORT,
            stride: COLOR_STRIDE,
            offset: 0,
            per_instance: false,
        });
    }
    Ok(MeshObjects {
        vertices: gl.vertices(&attributes)?,
        interleaved: vertices,
    })
}

fn upload_texture(gl: &Gl, compressed: &CompressedTexture) -> Result<Texture, RasterError> {
    let compressed = compressed.for_driver();
    let texture = &compressed.texture;
    let srgb = texture.color_space == ColorSpace::Srgb;
    let (format, block_bytes) = match texture.format {
        TexelFormat::Bc1 => (if srgb { SRGB_ALPHA_DXT1 } else { RGBA_DXT1 }, Some(8)),
        TexelFormat::Bc3 => (if srgb { SRGB_ALPHA_DXT5 } else { RGBA_DXT5 }, Some(16)),
        TexelFormat::Rgba8 => (
            if srgb {
                glow::SRGB8_ALPHA8
            } else {
                glow::RGBA8
            },
            None,
        ),
        other => {
            return Err(RasterError::Scene(format!(
                "texture {}: expected BC1, BC3 or RGBA8, found format {}",
                texture.name, other as u16
            )));
        }
    };
    let limit = gl.limit(glow::MAX_TEXTURE_SIZE);
    if let Some(&extent) = texture.size.iter().find(|&&e| u64::from(e) > limit) {
        return Err(RasterError::TooLarge {
            what: "texels along a texture's edge".into(),
            found: extent.into(),
            limit,
        });
    }
    // Leaving out levels that are never sampled does not change the sampling of coarser ones. See
    // the crate textures.
    let levels = compressed.first_level..texture.levels;
    let size = texture.level_size(levels.start);
    let made = gl.texture(format, size, levels.len() as u32, None)?;
    let mut rest = compressed.blocks.as_slice();
    for (number, level) in (0..).zip(levels) {
        let size = texture.level_size(level);
        let bytes = match block_bytes {
            Some(bytes) => {
                bytes
                    * size
                        .map(|e| e.div_ceil(4) as usize)
                        .iter()
                        .product::<usize>()
            }
            None => 4 * size[0] as usize * size[1] as usize,
        };
        let Some((own, others)) = rest.split_at_checked(bytes) else {
            return Err(RasterError::Scene(format!(
                "texture {}: expected {bytes} bytes of level {level}, found {}",
                texture.name,
                rest.len()
            )));
        };
        gl.fill(made, number, size, block_bytes.map(|_| format), own)?;
        rest = others;
    }
    Ok(made)
}

/// The samplers created so far, one per state.
type Samplers = Vec<(texture::Sampler, Sampler)>;

fn material(
    gl: &Gl,
    material: &Material,
    set: &TextureSet,
    uploaded: &[Texture],
    white: Texture,
    samplers: &mut Samplers,
) -> Result<MaterialObjects, RasterError> {
    let uniform = gl.buffer(bytemuck::bytes_of(&MaterialData::new(material)))?;
    let none = texture::Sampler::TRILINEAR_REPEAT;
    let mut units = [(white, sampler(gl, &none, samplers)?); TextureSlot::COUNT];
    for (slot, texture) in material.textures.iter() {
        let of_image = set.of_image.get(texture.image).copied().flatten();
        let image = of_image.and_then(|i| uploaded.get(i)).copied();
        units[slot as usize] = (
            image.unwrap_or(white),
            sampler(gl, &texture.sampler, samplers)?,
        );
    }
    Ok(MaterialObjects { uniform, units })
}

fn sampler(gl: &Gl, state: &texture::Sampler, made: &mut Samplers) -> Result<Sampler, RasterError> {
    if let Some((_, sampler)) = made.iter().find(|(known, _)| known == state) {
        return Ok(*sampler);
    }
    let wrap = |w| match w {
        Wrap::Repeat => glow::REPEAT,
        Wrap::MirroredRepeat => glow::MIRRORED_REPEAT,
        // Scene files have no other modes.
        Wrap::ClampToEdge | Wrap::ClampToBorder | Wrap::MirrorClampToEdge => glow::CLAMP_TO_EDGE,
    };
    let between = state.mip == MipFilter::Linear;
    let min = match (state.min, between) {
        (Filter::Nearest, false) => glow::NEAREST_MIPMAP_NEAREST,
        (Filter::Nearest, true) => glow::NEAREST_MIPMAP_LINEAR,
        (Filter::Linear, false) => glow::LINEAR_MIPMAP_NEAREST,
        (Filter::Linear, true) => glow::LINEAR_MIPMAP_LINEAR,
    };
    let mag = match state.mag {
        Filter::Nearest => glow::NEAREST,
        Filter::Linear => glow::LINEAR,
    };
    let parameters = [
        (glow::TEXTURE_WRAP_S, wrap(state.wrap[0])),
        (glow::TEXTURE_WRAP_T, wrap(state.wrap[1])),
        (glow::TEXTURE_MIN_FILTER, min),
        (glow::TEXTURE_MAG_FILTER, mag),
    ];
    // As in lavapipe, a limit of 0.25 stands for no levels: it never selects level 1.
    let max_lod = if state.mip == MipFilter::None {
        0.25
    } else {
        32.0
    };
    let sampler = gl.sampler(&parameters, max_lod)?;
    made.push((*state, sampler));
    Ok(sampler)
}
