//! Initial contents of a layer, other than the sky.

use super::bindings;
use super::device::Gpu;
use super::targets::LayerTarget;
use super::whole::{OverLayer, Whole};
use crate::error::RasterError;
use glam::{Mat3, Mat4};
use techniques::shading_reuse::Reuse;
use techniques::start::{Composition, Opening};

/// Pipelines that draw the initial contents of layers.
pub struct Starts {
    nearer: Pipeline,
    behind: Pipeline,
    composed: Pipeline,
    reused: Pipeline,
}

/// A pipeline over the whole target, with the layout of its only group.
struct Pipeline {
    pipeline: OverLayer,
    layout: wgpu::BindGroupLayout,
    /// Bindings of its textures.
    textures: Vec<u32>,
}

/// Initial contents and the resources to draw them.
pub struct Drawn<'a> {
    /// A pipeline over the whole target.
    pub pipeline: &'a OverLayer,
    /// Group 0 of the pipeline.
    pub bindings: wgpu::BindGroup,
    /// The sky is drawn first.
    pub over_sky: bool,
}

/// The shader's `Start`.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct StartData {
    maps: [[[f32; 4]; 4]; 2],
    from_farther_clip: [[f32; 4]; 4],
    ends: [f32; 4],
}

/// The shader's `Reuse`.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct ReuseData {
    other_from_clip: [[f32; 4]; 4],
    depth_of: [[f32; 2]; 2],
    nearest: f32,
    contrast: f32,
    padding: [f32; 2],
}

const DEPTH: wgpu::TextureSampleType = wgpu::TextureSampleType::Depth;
const COLOR: wgpu::TextureSampleType = wgpu::TextureSampleType::Float { filterable: false };

impl Starts {
    /// Compiles the shader.
    ///
    /// # Errors
    /// Driver and validation errors.
    pub fn new(gpu: &Gpu) -> Result<Self, RasterError> {
        gpu.checked("compiling the shader of initial contents", || {
            let source = concat!(
                include_str!("../shaders/starts.wgsl"),
                include_str!("../shaders/reuse.wgsl")
            );
            let module = gpu.module("starts", source);
            let make = |entry_point, textures: &[(u32, wgpu::TextureSampleType)]| {
                Pipeline::new(gpu, &module, entry_point, textures)
            };
            Self {
                nearer: make("fragment_nearer", &[]),
                behind: make("fragment_behind", &[(1, DEPTH), (2, DEPTH)]),
                composed: make(
                    "fragment_composed",
                    &[(1, DEPTH), (3, COLOR), (4, COLOR), (5, DEPTH)],
                ),
                reused: make("fragment_reused", &[(1, DEPTH), (3, COLOR)]),
            }
        })
    }

    /// Initially empty, with depth limited to `end`.
    pub fn nearer(&self, gpu: &Gpu, end: f32) -> Drawn<'_> {
        let data = StartData {
            ends: [end, 0.0, 0.0, 0.0],
            ..bytemuck::Zeroable::zeroed()
        };
        self.nearer.drawn(gpu, &data, &[], false)
    }

    /// The sky where both of two layers, each given with its target, are empty.
    pub fn behind(&self, gpu: &Gpu, openings: [(&Opening, &LayerTarget); 2]) -> Drawn<'_> {
        let [(left, left_target), (right, right_target)] = openings;
        let data = StartData {
            maps: [left, right].map(|opening| columns(opening.nearer_from_px)),
            from_farther_clip: Mat4::IDENTITY.to_cols_array_2d(),
            ends: [
                left.end,
                right.end,
                left.reach_px.max(right.reach_px) as f32,
                0.0,
            ],
        };
        let textures = [&left_target.depth_view, &right_target.depth_view];
        self.behind.drawn(gpu, &data, &textures, true)
    }

    /// A nearer and a farther layer, given with their targets.
    pub fn composed(
        &self,
        gpu: &Gpu,
        composition: &Composition,
        nearer: &LayerTarget,
        farther: &LayerTarget,
    ) -> Drawn<'_> {
        let data = StartData {
            maps: [columns(composition.farther_from_px); 2],
            from_farther_clip: composition.from_farther_clip.to_cols_array_2d(),
            ends: [composition.end, 0.0, 0.0, 0.0],
        };
        let textures = [
            &nearer.depth_view,
            &nearer.color.view,
            &farther.color.view,
            &farther.depth_view,
        ];
        self.composed.drawn(gpu, &data, &textures, false)
    }

    /// Surfaces that another eye's layer, given with its target, has shaded.
    pub fn reused(&self, gpu: &Gpu, reuse: &Reuse, from: &LayerTarget) -> Drawn<'_> {
        let data = ReuseData {
            other_from_clip: reuse.other_from_clip.to_cols_array_2d(),
            depth_of: reuse.depth_of,
            nearest: reuse.nearest,
            contrast: reuse.contrast,
            padding: [0.0; 2],
        };
        let textures = [&from.depth_view, &from.color.view];
        self.reused.drawn(gpu, &data, &textures, true)
    }
}

impl Pipeline {
    /// `textures`: number and kind of each binding after the uniform's.
    fn new(
        gpu: &Gpu,
        module: &wgpu::ShaderModule,
        entry_point: &'static str,
        textures: &[(u32, wgpu::TextureSampleType)],
    ) -> Self {
        let textures_bound = (textures.iter())
            .map(|(binding, sample_type)| (*binding, bindings::texture(*sample_type)));
        let bound = [(0, bindings::uniform())].into_iter().chain(textures_bound);
        let layout = bindings::fragment_layout(gpu, entry_point, bound);
        let whole = Whole {
            module,
            layout: &bindings::pipeline_layout(gpu, &[&layout]),
            vertex: "vertex_whole",
            multiview_mask: None,
        };
        let pipeline = whole.over_layer(gpu, entry_point);
        Self {
            pipeline,
            layout,
            textures: textures.iter().map(|(binding, _)| *binding).collect(),
        }
    }

    /// `textures` in the order in which [`Self::new`] received them.
    fn drawn(
        &self,
        gpu: &Gpu,
        data: &impl bytemuck::Pod,
        textures: &[&wgpu::TextureView],
        over_sky: bool,
    ) -> Drawn<'_> {
        let uniform = gpu.buffer_of(std::slice::from_ref(data), wgpu::BufferUsages::UNIFORM);
        let textures = (self.textures.iter().copied())
            .zip(textures)
            .map(|(binding, texture)| (binding, wgpu::BindingResource::TextureView(texture)));
        let bound = [(0, uniform.as_entire_binding())]
            .into_iter()
            .chain(textures);
        let bindings = bindings::group(gpu, "start", &self.layout, bound);
        Drawn {
            pipeline: &self.pipeline,
            bindings,
            over_sky,
        }
    }
}

/// A homogeneous map of the plane in the columns of a larger matrix.
fn columns(map: Mat3) -> [[f32; 4]; 4] {
    Mat4::from_cols(
        map.x_axis.extend(0.0),
        map.y_axis.extend(0.0),
        map.z_axis.extend(0.0),
        glam::Vec4::ZERO,
    )
    .to_cols_array_2d()
}
