//! The pipelines for a scene's draws, all from one shader source.

use super::bindings;
use super::device::Gpu;
use super::whole::{OverLayer, Whole};
use crate::error::RasterError;
use crate::roles::{PipelineKey, Role};
use crate::shader::{
    self, ALPHA_BINDING, AlphaSource, Granularity, MATERIAL_BINDING, SAMPLERS_BINDING,
    TEXTURES_BINDING,
};
use crate::vertices::{COLOR_STRIDE, VERTEX_STRIDE};
use std::collections::BTreeMap;
use std::num::NonZeroU32;

/// Format of the picture.
pub const COLOR_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;
/// Format of depth and shadow maps.
pub const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// Depth of an eye's view without a draw.
pub const FARTHEST: f32 = 0.0;

/// Format of sampled texels.
pub const TEXEL_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;
/// Format of the primitive numbers that accompany texels.
pub const PRIMITIVE_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::R32Uint;

/// The views that [`Pipelines::for_both_views`] draws at once.
pub const VIEWS: NonZeroU32 = NonZeroU32::new(0b11).unwrap();
/// Number of these views.
pub const VIEW_COUNT: u32 = VIEWS.get().count_ones();

const ADDITIVE: wgpu::BlendState = {
    let add = wgpu::BlendComponent {
        src_factor: wgpu::BlendFactor::One,
        dst_factor: wgpu::BlendFactor::One,
        operation: wgpu::BlendOperation::Add,
    };
    wgpu::BlendState {
        color: add,
        alpha: add,
    }
};

/// Bind group layouts of the shader.
pub struct Layouts {
    /// Group 0: view, instances, records, shadow maps.
    pub view: wgpu::BindGroupLayout,
    /// Group 1: material.
    pub material: wgpu::BindGroupLayout,
}

/// The shader and the pipelines created from it so far.
pub struct Pipelines {
    /// Bind group layouts.
    pub layouts: Layouts,
    /// Draws the background and clears the region's depth.
    pub background: OverLayer,
    module: wgpu::ShaderModule,
    layout: wgpu::PipelineLayout,
    multiview_mask: Option<NonZeroU32>,
    made: BTreeMap<PipelineKey, wgpu::RenderPipeline>,
}

impl Pipelines {
    /// Compiles the shader.
    ///
    /// # Errors
    /// Driver and validation errors.
    pub fn new(gpu: &Gpu, alpha: AlphaSource) -> Result<Self, RasterError> {
        Self::compile(gpu, gpu.granularity(), alpha, None)
    }

    /// Compiles the shader for pictures of two views.
    ///
    /// # Errors
    /// Driver and validation errors.
    pub fn for_both_views(gpu: &Gpu) -> Result<Self, RasterError> {
        let (granularity, alpha) = (Granularity::TwoViews, AlphaSource::Color);
        Self::compile(gpu, granularity, alpha, Some(VIEWS))
    }

    fn compile(
        gpu: &Gpu,
        granularity: Granularity,
        alpha: AlphaSource,
        multiview_mask: Option<NonZeroU32>,
    ) -> Result<Self, RasterError> {
        gpu.checked("compiling the shader", || {
            let module = gpu.module("capture", shader::source(granularity, alpha));
            let layouts = Layouts {
                view: bindings::layout(gpu, "view", view_bindings()),
                material: bindings::fragment_layout(gpu, "material", material_bindings()),
            };
            let layout = bindings::pipeline_layout(gpu, &[&layouts.view, &layouts.material]);
            let background = Whole {
                module: &module,
                layout: &layout,
                vertex: "vertex_background",
                multiview_mask,
            };
            let background = background.over_layer(gpu, "fragment_background");
            Self {
                layouts,
                background,
                module,
                layout,
                multiview_mask,
                made: BTreeMap::new(),
            }
        })
    }

    /// Creates the pipeline for `key` unless it exists.
    ///
    /// # Errors
    /// Driver and validation errors.
    pub fn prepare(&mut self, gpu: &Gpu, key: PipelineKey) -> Result<(), RasterError> {
        if !self.made.contains_key(&key) {
            let pipeline = gpu.checked("making a pipeline", || self.make(gpu, &key))?;
            self.made.insert(key, pipeline);
        }
        Ok(())
    }

    /// A prepared pipeline.
    pub fn get(&self, key: &PipelineKey) -> Option<&wgpu::RenderPipeline> {
        self.made.get(key)
    }

    /// Number of pipelines created.
    pub fn count(&self) -> u64 {
        self.made.len() as u64
    }

    fn make(&self, gpu: &Gpu, key: &PipelineKey) -> wgpu::RenderPipeline {
        let constants = key.constants();
        let compilation_options = wgpu::PipelineCompilationOptions {
            constants: &constants,
            ..Default::default()
        };
        let attributes = wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Float32x4, 3 => Float32x4];
        let draw = wgpu::vertex_attr_array![4 => Uint32];
        let color = wgpu::vertex_attr_array![5 => Unorm16x4];
        let mut buffers = vec![
            Some(wgpu::VertexBufferLayout {
                array_stride: VERTEX_STRIDE,
                step_mode: wgpu::VertexStepMode::Vertex,
                attributes: &attributes,
            }),
            Some(wgpu::VertexBufferLayout {
                array_stride: 4,
                step_mode: wgpu::VertexStepMode::Instance,
                attributes: &draw,
            }),
        ];
        if key.colored {
            buffers.push(Some(wgpu::VertexBufferLayout {
                array_stride: COLOR_STRIDE,
                step_mode: wgpu::VertexStepMode::Vertex,
                attributes: &color,
            }));
        }
        let shadow = key.role.casts();
        let entry_point = key.role.fragment_entry_point();
        let targets = color_targets(key);
        gpu.device
            .create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: None,
                layout: Some(&self.layout),
                vertex: wgpu::VertexState {
                    module: &self.module,
                    entry_point: Some(if key.colored {
                        "vertex_colored"
                    } else {
                        "vertex_main"
                    }),
                    compilation_options: compilation_options.clone(),
                    buffers: &buffers,
                },
                primitive: wgpu::PrimitiveState {
                    front_face: if key.mirrored {
                        wgpu::FrontFace::Cw
                    } else {
                        wgpu::FrontFace::Ccw
                    },
                    cull_mode: (!key.double_sided).then_some(wgpu::Face::Back),
                    ..wgpu::PrimitiveState::default()
                },
                depth_stencil: Some(wgpu::DepthStencilState {
                    format: DEPTH_FORMAT,
                    depth_write_enabled: Some(!key.role.keeps_depth()),
                    depth_compare: Some(match key.role {
                        // Depth of a cascade runs from 0 to 1.
                        role if role.casts() => wgpu::CompareFunction::Less,
                        role if role.marks() => wgpu::CompareFunction::GreaterEqual,
                        _ => wgpu::CompareFunction::Greater,
                    }),
                    stencil: wgpu::StencilState::default(),
                    bias: if shadow {
                        wgpu::DepthBiasState {
                            constant: 2,
                            slope_scale: 2.0,
                            clamp: 0.0,
                        }
                    } else {
                        wgpu::DepthBiasState::default()
                    },
                }),
                multisample: wgpu::MultisampleState::default(),
                fragment: entry_point.map(|entry_point| wgpu::FragmentState {
                    module: &self.module,
                    entry_point: Some(entry_point),
                    compilation_options,
                    targets: &targets,
                }),
                multiview_mask: self.multiview_mask,
                cache: None,
            })
    }
}

/// In the order of [`shader::VIEW_BINDINGS`].
fn view_bindings() -> impl Iterator<Item = (u32, wgpu::ShaderStages, wgpu::BindingType)> {
    let fragment = wgpu::ShaderStages::FRAGMENT;
    let storage = |read_only| bindings::buffer(wgpu::BufferBindingType::Storage { read_only });
    let shadow_map = wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Depth,
        view_dimension: wgpu::TextureViewDimension::D2Array,
        multisampled: false,
    };
    let comparison = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Comparison);
    let read: [_; shader::VIEW_BINDINGS.len()] = [
        (wgpu::ShaderStages::VERTEX_FRAGMENT, bindings::uniform()),
        (wgpu::ShaderStages::VERTEX, storage(true)),
        (fragment, storage(false)),
        (fragment, storage(false)),
        (fragment, shadow_map),
        (fragment, comparison),
        (fragment, storage(false)),
    ];
    (0..)
        .zip(read)
        .map(|(binding, (stages, ty))| (binding, stages, ty))
}

fn material_bindings() -> impl Iterator<Item = (u32, wgpu::BindingType)> {
    let texture = bindings::texture(wgpu::TextureSampleType::Float { filterable: true });
    let sampler = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering);
    let textures = TEXTURES_BINDING..SAMPLERS_BINDING;
    let samplers = SAMPLERS_BINDING..SAMPLERS_BINDING + textures.len() as u32;
    [(MATERIAL_BINDING, bindings::uniform())]
        .into_iter()
        .chain(textures.map(move |binding| (binding, texture)))
        .chain(samplers.map(move |binding| (binding, sampler)))
        .chain([(ALPHA_BINDING, texture)])
}

fn color_targets(key: &PipelineKey) -> Vec<Option<wgpu::ColorTargetState>> {
    let (format, blend) = match key.role {
        Role::Blended => (COLOR_FORMAT, Some(wgpu::BlendState::ALPHA_BLENDING)),
        Role::Count | Role::CountBlended => (wgpu::TextureFormat::R16Float, Some(ADDITIVE)),
        Role::Texel | Role::TexelMasked => (TEXEL_FORMAT, None),
        _ => (COLOR_FORMAT, None),
    };
    let mut targets = vec![Some(wgpu::ColorTargetState {
        format,
        blend,
        write_mask: if key.role.keeps_color() {
            wgpu::ColorWrites::empty()
        } else {
            wgpu::ColorWrites::ALL
        },
    })];
    if key.role.writes_texels() {
        targets.push(Some(PRIMITIVE_FORMAT.into()));
    } else if key.colorless {
        targets.clear();
    }
    targets
}
