//! Pipelines that draw one triangle over a whole picture.

use super::device::Gpu;
use super::pipelines::{COLOR_FORMAT, DEPTH_FORMAT};
use std::num::NonZeroU32;

/// What such a pipeline is made of.
pub struct Whole<'a> {
    /// The shader.
    pub module: &'a wgpu::ShaderModule,
    /// Its groups.
    pub layout: &'a wgpu::PipelineLayout,
    /// The entry point that makes the triangle.
    pub vertex: &'a str,
    /// There is a depth buffer, which it writes whatever it holds.
    pub writes_depth: bool,
    /// Views that are drawn at once.
    pub multiview_mask: Option<NonZeroU32>,
}

impl Whole<'_> {
    /// Makes the pipeline of a fragment entry point.
    pub fn pipeline(&self, gpu: &Gpu, fragment: &str) -> wgpu::RenderPipeline {
        let depth_stencil = wgpu::DepthStencilState {
            format: DEPTH_FORMAT,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Always),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        };
        gpu.device
            .create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some(fragment),
                layout: Some(self.layout),
                vertex: wgpu::VertexState {
                    module: self.module,
                    entry_point: Some(self.vertex),
                    compilation_options: Default::default(),
                    buffers: &[],
                },
                primitive: wgpu::PrimitiveState::default(),
                depth_stencil: self.writes_depth.then_some(depth_stencil),
                multisample: wgpu::MultisampleState::default(),
                fragment: Some(wgpu::FragmentState {
                    module: self.module,
                    entry_point: Some(fragment),
                    compilation_options: Default::default(),
                    targets: &[Some(COLOR_FORMAT.into())],
                }),
                multiview_mask: self.multiview_mask,
                cache: None,
            })
    }
}
