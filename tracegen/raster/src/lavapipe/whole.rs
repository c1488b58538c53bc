//! Pipelines that draw one triangle over a whole picture.

use super::device::Gpu;
use super::pipelines::{COLOR_FORMAT, DEPTH_FORMAT};
use std::num::NonZeroU32;

/// A full-screen pass over a layer before its draws.
pub struct OverLayer {
    pictured: wgpu::RenderPipeline,
    depth_alone: wgpu::RenderPipeline,
}

impl OverLayer {
    /// The pipeline for passes with colour, or for depth only.
    pub fn of(&self, picture: bool) -> &wgpu::RenderPipeline {
        if picture {
            &self.pictured
        } else {
            &self.depth_alone
        }
    }
}

/// Description of a full-screen pipeline.
pub struct Whole<'a> {
    /// The shader.
    pub module: &'a wgpu::ShaderModule,
    /// Layout of its groups.
    pub layout: &'a wgpu::PipelineLayout,
    /// The entry point that creates the triangle.
    pub vertex: &'a str,
    /// Views drawn with multiview.
    pub multiview_mask: Option<NonZeroU32>,
}

impl Whole<'_> {
    /// A fragment entry point that writes depth unconditionally, and colour if there is a picture.
    pub fn over_layer(&self, gpu: &Gpu, fragment: &str) -> OverLayer {
        OverLayer {
            pictured: self.pipeline(gpu, fragment, Some(COLOR_FORMAT), true),
            depth_alone: self.pipeline(gpu, fragment, None, true),
        }
    }

    /// A fragment entry point that writes only colour.
    pub fn over_picture(
        &self,
        gpu: &Gpu,
        fragment: &str,
        format: wgpu::TextureFormat,
    ) -> wgpu::RenderPipeline {
        self.pipeline(gpu, fragment, Some(format), false)
    }

    fn pipeline(
        &self,
        gpu: &Gpu,
        fragment: &str,
        color: Option<wgpu::TextureFormat>,
        writes_depth: bool,
    ) -> wgpu::RenderPipeline {
        let targets: Vec<_> = color
            .map(|format| Some(format.into()))
            .into_iter()
            .collect();
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
                depth_stencil: writes_depth.then_some(depth_stencil),
                multisample: wgpu::MultisampleState::default(),
                fragment: Some(wgpu::FragmentState {
                    module: self.module,
                    entry_point: Some(fragment),
                    compilation_options: Default::default(),
                    targets: &targets,
                }),
                multiview_mask: self.multiview_mask,
                cache: None,
            })
    }
}
