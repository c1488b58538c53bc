//! The scene in the driver's memory: vertex and index buffers, textures, materials, instances.

use super::alpha;
use super::bindings;
use super::device::Gpu;
use super::pipelines::Layouts;
use crate::draws::DrawList;
use crate::error::RasterError;
use crate::shader::{ALPHA_BINDING, MATERIAL_BINDING, SAMPLERS_BINDING, TEXTURES_BINDING};
use crate::uniforms::MaterialData;
use crate::vertices::{self, InstanceData, VERTEX_STRIDE};
use formats::texture::{ColorSpace, Filter, MipFilter, Sampler, TexelFormat, Wrap};
use scene::{Animation, Material, Mesh, Scene, TextureRef, TextureSlot};
use std::collections::{BTreeMap, BTreeSet};
use textures::{CompressedTexture, TextureSet};

/// A mesh's buffers.
pub struct MeshBuffers {
    /// Interleaved vertices.
    pub vertices: wgpu::Buffer,
    /// Vertex colours, if the mesh has them.
    pub colors: Option<wgpu::Buffer>,
    /// 32-bit indices.
    pub indices: wgpu::Buffer,
    /// Number of indices.
    pub index_count: u32,
    /// Number of vertices.
    pub vertex_count: u32,
}

/// The uploaded scene.
pub struct SceneBuffers {
    /// By the scene's mesh number; `None` for a mesh that no draw uses.
    pub meshes: Vec<Option<MeshBuffers>>,
    /// Bind group 1 by the scene's material number.
    pub materials: Vec<wgpu::BindGroup>,
    /// One row per draw.
    pub instances: wgpu::Buffer,
    /// Draw numbers by instance, written before each pass.
    pub instance_draws: wgpu::Buffer,
    /// Distinct samplers.
    pub samplers: usize,
}

impl SceneBuffers {
    /// Uploads everything that `draws` use.
    ///
    /// # Errors
    /// Sizes beyond the device's limits, and driver errors.
    pub fn new(
        gpu: &Gpu,
        layouts: &Layouts,
        scene: &Scene,
        draws: &DrawList,
        textures: &TextureSet,
        alpha_copies: &BTreeSet<usize>,
    ) -> Result<Self, RasterError> {
        let mut used = vec![false; scene.meshes.len()];
        for call in &draws.calls {
            used[call.mesh] = true;
        }
        let limit = gpu.device.limits().max_buffer_size;
        let mut meshes = Vec::with_capacity(scene.meshes.len());
        for (mesh, used) in scene.meshes.iter().zip(used) {
            meshes.push(used.then(|| upload_mesh(gpu, mesh, limit)).transpose()?);
        }
        // Replaces the textures that a material lacks. The pipelines never sample it.
        let format = wgpu::TextureFormat::Rgba8Unorm;
        let absent = gpu.checked("uploading a texture", || {
            gpu.texture_of([1, 1], 1, format, &[255; 4])
        })?;
        let views = textures
            .textures
            .iter()
            .map(|t| match t.blocks.as_slice() {
                // No view can see it, so it is never sampled.
                [] => Ok(absent.clone()),
                _ => upload_texture(gpu, t),
            })
            .collect::<Result<Vec<_>, _>>()?;
        let copies = alpha::copies(gpu, alpha_copies, &views)?;
        let mut samplers = Samplers::default();
        let materials = (scene.materials.iter())
            .map(|material| {
                let views = MaterialViews::new(material, textures, &views, &copies, &absent);
                views.bind(gpu, layouts, material, &mut samplers)
            })
            .collect();
        let instances = vertices::instances(draws);
        let instances = gpu.buffer_of(
            &instances,
            wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
        );
        let instance_draws = gpu.buffer(
            4 * draws.calls.len().max(1) as u64,
            wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST,
        );
        Ok(Self {
            meshes,
            materials,
            instances,
            instance_draws,
            samplers: samplers.made.len(),
        })
    }
}

impl SceneBuffers {
    /// Writes the rows of moving draws, consecutive ones together, and the moving vertices. Returns
    /// the number of bytes.
    pub fn pose(&self, gpu: &Gpu, scene: &Scene, draws: &DrawList) -> u64 {
        let mut bytes = 0;
        for mesh in scene.animation.iter().flat_map(Animation::moving_meshes) {
            let Some(buffers) = &self.meshes[mesh] else {
                continue;
            };
            let vertices = vertices::pack(&scene.meshes[mesh]);
            let contents: &[u8] = bytemuck::cast_slice(&vertices);
            gpu.queue.write_buffer(&buffers.vertices, 0, contents);
            bytes += contents.len() as u64;
        }
        for run in draws.moving.chunk_by(|a, b| a + 1 == *b) {
            let rows: Vec<InstanceData> = (run.iter())
                .map(|&draw| InstanceData::new(draw, &draws.calls[draw as usize]))
                .collect();
            let contents: &[u8] = bytemuck::cast_slice(&rows);
            let offset = u64::from(run[0]) * size_of::<InstanceData>() as u64;
            gpu.queue.write_buffer(&self.instances, offset, contents);
            bytes += contents.len() as u64;
        }
        bytes
    }
}

fn upload_mesh(gpu: &Gpu, mesh: &Mesh, limit: u64) -> Result<MeshBuffers, RasterError> {
    let bytes = mesh.positions.len() as u64 * VERTEX_STRIDE;
    if bytes > limit {
        return Err(RasterError::TooLarge {
            what: format!("bytes of vertices of mesh {}", mesh.name),
            found: bytes,
            limit,
        });
    }
    let vertices = vertices::pack(mesh);
    let colors = vertices::pack_colors(mesh);
    // A trailing partial triangle is not a primitive and is left out of the index range.
    Ok(MeshBuffers {
        // Vertices may move.
        vertices: gpu.buffer_of(
            &vertices,
            wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST,
        ),
        colors: (!colors.is_empty()).then(|| gpu.buffer_of(&colors, wgpu::BufferUsages::VERTEX)),
        indices: gpu.buffer_of(&mesh.indices, wgpu::BufferUsages::INDEX),
        index_count: mesh.triangles() as u32 * 3,
        vertex_count: mesh.positions.len() as u32,
    })
}

fn upload_texture(
    gpu: &Gpu,
    compressed: &CompressedTexture,
) -> Result<wgpu::TextureView, RasterError> {
    let compressed = compressed.for_driver();
    let texture = &compressed.texture;
    let srgb = texture.color_space == ColorSpace::Srgb;
    let format = match texture.format {
        TexelFormat::Bc1 if srgb => wgpu::TextureFormat::Bc1RgbaUnormSrgb,
        TexelFormat::Bc1 => wgpu::TextureFormat::Bc1RgbaUnorm,
        TexelFormat::Bc3 if srgb => wgpu::TextureFormat::Bc3RgbaUnormSrgb,
        TexelFormat::Bc3 => wgpu::TextureFormat::Bc3RgbaUnorm,
        TexelFormat::Rgba8 if srgb => wgpu::TextureFormat::Rgba8UnormSrgb,
        TexelFormat::Rgba8 => wgpu::TextureFormat::Rgba8Unorm,
        other => {
            return Err(RasterError::Scene(format!(
                "texture {}: expected BC1, BC3 or RGBA8, found format {}",
                texture.name, other as u16
            )));
        }
    };
    let limit = gpu.device.limits().max_texture_dimension_2d;
    if let Some(&extent) = texture.size.iter().find(|&&e| e > limit) {
        return Err(RasterError::TooLarge {
            what: "texels along a texture's edge".into(),
            found: extent.into(),
            limit: limit.into(),
        });
    }
    // Leaving out levels that are never sampled does not change the sampling of coarser ones. See
    // the crate textures.
    let first = compressed.first_level;
    let (size, levels) = (texture.level_size(first), texture.levels - first);
    gpu.checked("uploading a texture", || {
        gpu.texture_of(size, levels, format, &compressed.blocks)
    })
}

/// Textures and samplers of a material.
struct MaterialViews<'a> {
    textures: [&'a wgpu::TextureView; TextureSlot::COUNT],
    alpha: &'a wgpu::TextureView,
}

impl<'a> MaterialViews<'a> {
    /// `absent` is used for missing textures.
    fn new(
        material: &Material,
        set: &TextureSet,
        views: &'a [wgpu::TextureView],
        copies: &'a BTreeMap<usize, wgpu::TextureView>,
        absent: &'a wgpu::TextureView,
    ) -> Self {
        let of_texture = |texture: Option<TextureRef>| {
            let view =
                texture.and_then(|t| (*set.of_image.get(t.image)?).and_then(|i| views.get(i)));
            view.unwrap_or(absent)
        };
        let copy = alpha::of_material(material, set).and_then(|index| copies.get(&index));
        Self {
            textures: material.textures.map(of_texture),
            alpha: copy.unwrap_or(absent),
        }
    }

    fn bind(
        &self,
        gpu: &Gpu,
        layouts: &Layouts,
        material: &Material,
        samplers: &mut Samplers,
    ) -> wgpu::BindGroup {
        let samplers = (material.textures)
            .map(|t| samplers.index(gpu, &t.map_or(Sampler::TRILINEAR_REPEAT, |t| t.sampler)))
            .map(|index| &samplers.made[index].1);
        let data = MaterialData::new(material);
        let uniform = gpu.buffer_of(&[data], wgpu::BufferUsages::UNIFORM);
        let textures = self.textures.map(wgpu::BindingResource::TextureView);
        let alpha = wgpu::BindingResource::TextureView(self.alpha);
        let bound = [(MATERIAL_BINDING, uniform.as_entire_binding())]
            .into_iter()
            .chain((TEXTURES_BINDING..).zip(textures))
            .chain((SAMPLERS_BINDING..).zip(samplers.map(wgpu::BindingResource::Sampler)))
            .chain([(ALPHA_BINDING, alpha)]);
        bindings::group(gpu, "material", &layouts.material, bound)
    }
}

/// The samplers created so far, one per state.
#[derive(Default)]
struct Samplers {
    made: Vec<(Sampler, wgpu::Sampler)>,
}

impl Samplers {
    fn index(&mut self, gpu: &Gpu, state: &Sampler) -> usize {
        let known = self.made.iter().position(|(made, _)| made == state);
        known.unwrap_or_else(|| {
            let sampler = gpu.device.create_sampler(&sampler_descriptor(state));
            self.made.push((*state, sampler));
            self.made.len() - 1
        })
    }
}

fn sampler_descriptor(state: &Sampler) -> wgpu::SamplerDescriptor<'static> {
    let wrap = |w| match w {
        Wrap::Repeat => wgpu::AddressMode::Repeat,
        Wrap::MirroredRepeat => wgpu::AddressMode::MirrorRepeat,
        // Scene files have no other modes.
        Wrap::ClampToEdge | Wrap::ClampToBorder | Wrap::MirrorClampToEdge => {
            wgpu::AddressMode::ClampToEdge
        }
    };
    let filter = |f| match f {
        Filter::Nearest => wgpu::FilterMode::Nearest,
        Filter::Linear => wgpu::FilterMode::Linear,
    };
    wgpu::SamplerDescriptor {
        address_mode_u: wrap(state.wrap[0]),
        address_mode_v: wrap(state.wrap[1]),
        mag_filter: filter(state.mag),
        min_filter: filter(state.min),
        mipmap_filter: match state.mip {
            MipFilter::None | MipFilter::Nearest => wgpu::MipmapFilterMode::Nearest,
            MipFilter::Linear => wgpu::MipmapFilterMode::Linear,
        },
        // Vulkan has no sampler without levels, but a limit of 0.25 never selects level 1.
        lod_max_clamp: if state.mip == MipFilter::None {
            0.25
        } else {
            32.0
        },
        ..wgpu::SamplerDescriptor::default()
    }
}
