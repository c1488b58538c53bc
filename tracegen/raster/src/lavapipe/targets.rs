//! Attachments of layers and pictures.

use super::device::Gpu;
use super::pipelines::{COLOR_FORMAT, DEPTH_FORMAT};
use crate::error::RasterError;
use record::Region;
use std::sync::Arc;
use techniques::Mask;

/// A colour attachment that can be sampled and read back.
pub struct ColorTarget {
    /// Width and height in pixels.
    pub size_px: [u32; 2],
    /// View of the picture.
    pub view: wgpu::TextureView,
}

/// Target of a layer.
pub struct LayerTarget {
    /// Its picture.
    pub color: ColorTarget,
    /// View of its depth buffer.
    pub depth_view: wgpu::TextureView,
    /// Mask of the pixels that may be drawn.
    pub mask: Option<LayerMask>,
}

/// A layer's mask in the driver's memory.
pub struct LayerMask {
    /// The uploaded mask.
    pub mask: Arc<Mask>,
    /// Bindings of the mask for the layers' shader.
    pub bindings: wgpu::BindGroup,
    /// Tiles with pixels that may be drawn; `None` without any.
    pub bounds: Option<Region>,
}

impl LayerTarget {
    /// Attachments of `size_px`.
    ///
    /// # Errors
    /// A size that [`check_size`] refuses, and driver errors.
    pub fn new(gpu: &Gpu, size_px: [u32; 2]) -> Result<Self, RasterError> {
        check_size(gpu, size_px)?;
        let color = ColorTarget::new(gpu, size_px)?;
        gpu.checked("making a depth buffer", || {
            let depth = attachment(
                gpu,
                size_px,
                1,
                1,
                DEPTH_FORMAT,
                wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_SRC,
            );
            Self {
                color,
                depth_view: depth.create_view(&Default::default()),
                mask: None,
            }
        })
    }

    /// The part of a region that may have pixels to draw.
    pub fn open_part(&self, region: Region) -> Option<Region> {
        let Some(mask) = &self.mask else {
            return Some(region);
        };
        let bounds = mask.bounds?;
        let end = |r: &Region, axis: usize| r.origin_px[axis] + r.size_px[axis];
        let origin_px = [0, 1].map(|axis| region.origin_px[axis].max(bounds.origin_px[axis]));
        let end_px = [0, 1].map(|axis| end(&region, axis).min(end(&bounds, axis)));
        let is_open = (0..2).all(|axis| origin_px[axis] < end_px[axis])
            && mask.mask.any_in(origin_px, end_px);
        is_open.then(|| Region {
            origin_px,
            size_px: [0, 1].map(|axis: usize| end_px[axis] - origin_px[axis]),
        })
    }

    /// Begins a render pass into depth, and into the picture if requested. The regions of a layer
    /// accumulate, so existing contents are loaded.
    pub fn pass<'e>(
        &self,
        encoder: &'e mut wgpu::CommandEncoder,
        picture: bool,
    ) -> wgpu::RenderPass<'e> {
        let colors: Vec<_> = (picture.then(|| color_attachment(&self.color.view, None)))
            .into_iter()
            .collect();
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &colors,
            depth_stencil_attachment: depth_attachment(&self.depth_view, None),
            ..Default::default()
        })
    }

    /// Clears the picture to black, which remains where the mask prevents drawing.
    ///
    /// # Errors
    /// Driver errors.
    pub fn clear(&self, gpu: &Gpu) -> Result<(), RasterError> {
        gpu.submit("clearing a layer", |encoder| {
            encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                color_attachments: &[color_attachment(&self.color.view, Some(wgpu::Color::BLACK))],
                ..Default::default()
            });
        })
    }
}

/// A colour attachment, cleared if a colour is given.
pub fn color_attachment(
    view: &wgpu::TextureView,
    clear: Option<wgpu::Color>,
) -> Option<wgpu::RenderPassColorAttachment<'_>> {
    Some(wgpu::RenderPassColorAttachment {
        view,
        depth_slice: None,
        resolve_target: None,
        ops: wgpu::Operations {
            load: clear.map_or(wgpu::LoadOp::Load, wgpu::LoadOp::Clear),
            store: wgpu::StoreOp::Store,
        },
    })
}

/// A depth attachment, cleared if a depth is given.
pub fn depth_attachment(
    view: &wgpu::TextureView,
    clear: Option<f32>,
) -> Option<wgpu::RenderPassDepthStencilAttachment<'_>> {
    Some(wgpu::RenderPassDepthStencilAttachment {
        view,
        depth_ops: Some(wgpu::Operations {
            load: clear.map_or(wgpu::LoadOp::Load, wgpu::LoadOp::Clear),
            store: wgpu::StoreOp::Store,
        }),
        stencil_ops: None,
    })
}

/// Checks the size of a layer.
///
/// # Errors
/// A size of 0 or beyond the device's limit.
pub fn check_size(gpu: &Gpu, size_px: [u32; 2]) -> Result<(), RasterError> {
    // Records hold 12 bits of quad column and row.
    let limit = gpu.device.limits().max_texture_dimension_2d.min(8192);
    match size_px
        .iter()
        .find(|&&extent| extent == 0 || extent > limit)
    {
        None => Ok(()),
        Some(&extent) => Err(RasterError::TooLarge {
            what: "pixels along a view's edge (at least 1)".into(),
            found: extent.into(),
            limit: limit.into(),
        }),
    }
}

impl ColorTarget {
    /// A picture of `size_px`, which [`check_size`] has accepted.
    ///
    /// # Errors
    /// Driver errors.
    pub fn new(gpu: &Gpu, size_px: [u32; 2]) -> Result<Self, RasterError> {
        gpu.checked("making a render target", || {
            let usage = wgpu::TextureUsages::COPY_SRC
                | wgpu::TextureUsages::COPY_DST
                | wgpu::TextureUsages::TEXTURE_BINDING;
            let texture = attachment(gpu, size_px, 1, 1, COLOR_FORMAT, usage);
            Self {
                size_px,
                view: texture.create_view(&Default::default()),
            }
        })
    }
}

/// A render target with the given numbers of layers and levels.
pub fn attachment(
    gpu: &Gpu,
    size_px: [u32; 2],
    layers: u32,
    levels: u32,
    format: wgpu::TextureFormat,
    usage: wgpu::TextureUsages,
) -> wgpu::Texture {
    gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d {
            width: size_px[0],
            height: size_px[1],
            depth_or_array_layers: layers,
        },
        mip_level_count: levels,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: usage | wgpu::TextureUsages::RENDER_ATTACHMENT,
        view_formats: &[],
    })
}
