//! Swapchains, and what is drawn into them.

use crate::Layout;
use crate::api::{Api, Result, of};
use crate::draw::{Draws, EDGE, FORMAT, To, change, draw};
use crate::gpu::{Gpu, Image, ImageKind, checked};
use crate::xr_do;
use ash::vk::{self, Handle as _};
use openxr_sys as xr;

/// A swapchain and its images.
pub struct Chain {
    pub handle: xr::Swapchain,
    pub images: Vec<vk::Image>,
    /// A view of each image and eye; of both layers for multiview.
    views: Vec<[vk::ImageView; 2]>,
}

/// Everything that draws the eyes.
pub struct Targets {
    layout: Layout,
    pub chains: Vec<Chain>,
    draws: Draws,
    /// A pipeline per eye, and one for full-screen passes.
    pipelines: [vk::Pipeline; 3],
    set: vk::DescriptorSet,
    /// Targets of the program's own, each with a set that shows it.
    own: Vec<(Image, vk::DescriptorSet)>,
}

const COLOR: vk::ImageLayout = vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL;

fn view(gpu: &Gpu, image: vk::Image, layer: u32, layers: u32) -> Result<vk::ImageView> {
    let kind = match layers {
        1 => vk::ImageViewType::TYPE_2D,
        _ => vk::ImageViewType::TYPE_2D_ARRAY,
    };
    let info = vk::ImageViewCreateInfo::default()
        .image(image)
        .view_type(kind)
        .format(FORMAT)
        .subresource_range(vk::ImageSubresourceRange {
            aspect_mask: vk::ImageAspectFlags::COLOR,
            base_mip_level: 0,
            level_count: 1,
            base_array_layer: layer,
            layer_count: layers,
        });
    // SAFETY: the image is the device's.
    checked("a view", unsafe {
        gpu.device.create_image_view(&info, None)
    })
}

/// A multisampled image of the program's own.
fn multisampled(gpu: &Gpu) -> Result<Image> {
    // The helper creates images of one sample, so the image is created here.
    let info = vk::ImageCreateInfo::default()
        .image_type(vk::ImageType::TYPE_2D)
        .format(FORMAT)
        .extent(vk::Extent3D {
            width: EDGE,
            height: EDGE,
            depth: 1,
        })
        .mip_levels(1)
        .array_layers(1)
        .samples(vk::SampleCountFlags::TYPE_4)
        .usage(vk::ImageUsageFlags::COLOR_ATTACHMENT);
    let device = &gpu.device;
    // SAFETY: the device is open, and lavapipe's first memory type fits all images.
    unsafe {
        let handle = checked("an image", device.create_image(&info, None))?;
        let needs = device.get_image_memory_requirements(handle);
        let info = vk::MemoryAllocateInfo::default()
            .allocation_size(needs.size)
            .memory_type_index(needs.memory_type_bits.trailing_zeros());
        let memory = checked("memory", device.allocate_memory(&info, None))?;
        checked("memory", device.bind_image_memory(handle, memory, 0))?;
        let view = view(gpu, handle, 0, 1)?;
        Ok(Image {
            handle,
            view,
            memory,
        })
    }
}

impl Targets {
    pub fn new(
        api: &Api,
        session: xr::Session,
        gpu: &Gpu,
        layout: Layout,
        texture: &Image,
    ) -> Result<Self> {
        let layers = match layout {
            Layout::Separate | Layout::Side => 1,
            _ => 2,
        };
        let count = if layout == Layout::Separate { 2 } else { 1 };
        let width = if layout == Layout::Side {
            2 * EDGE
        } else {
            EDGE
        };
        let mut chains = Vec::new();
        for _ in 0..count {
            chains.push(Chain::new(
                api,
                session,
                gpu,
                [width, EDGE],
                layers,
                layout == Layout::Multiview,
            )?);
        }
        let draws = Draws::new(gpu)?;
        let kind = match layout {
            Layout::Multiview => (1, 3),
            Layout::Msaa => (4, 0),
            _ => (1, 0),
        };
        let pipelines = [
            draws.pipeline(gpu, kind)?,
            draws.pipeline(gpu, kind)?,
            draws.pipeline(gpu, (1, 0))?,
        ];
        let mut own = Vec::new();
        for _ in 0..2 {
            let image = match layout {
                Layout::Msaa => multisampled(gpu)?,
                Layout::Target | Layout::Blit => gpu.image(&ImageKind {
                    format: FORMAT,
                    size: [EDGE, EDGE, 1],
                    levels: 1,
                    layers: 1,
                    view: vk::ImageViewType::TYPE_2D,
                    usage: vk::ImageUsageFlags::COLOR_ATTACHMENT
                        | vk::ImageUsageFlags::SAMPLED
                        | vk::ImageUsageFlags::TRANSFER_SRC,
                })?,
                _ => break,
            };
            gpu.execute(|_, buffer| {
                change(
                    gpu,
                    buffer,
                    image.handle,
                    [vk::ImageLayout::UNDEFINED, COLOR],
                )
            })?;
            own.push((image, draws.set(gpu, image.view)?));
        }
        Ok(Self {
            layout,
            chains,
            set: draws.set(gpu, texture.view)?,
            draws,
            pipelines,
            own,
        })
    }

    /// Draws both eyes into acquired images.
    pub fn draw(&self, gpu: &Gpu, acquired: &[usize]) -> Result<()> {
        gpu.execute(|_, buffer| {
            for eye in 0..2 {
                self.draw_eye(gpu, buffer, acquired, eye);
            }
        })
    }

    fn draw_eye(&self, gpu: &Gpu, buffer: vk::CommandBuffer, acquired: &[usize], eye: usize) {
        let chain = &self.chains[eye.min(self.chains.len() - 1)];
        let number = acquired[eye.min(acquired.len() - 1)];
        let (image, view) = (chain.images[number], chain.views[number][eye]);
        let plain = To {
            view,
            ..To::default()
        };
        let pipeline = self.pipelines[eye];
        let scene = |to: To| draw(gpu, buffer, &self.draws, pipeline, self.set, to);
        match self.layout {
            Layout::Separate | Layout::Layers => scene(plain),
            Layout::Multiview if eye == 0 => scene(To {
                view_mask: 3,
                ..plain
            }),
            Layout::Multiview => {}
            Layout::Side => scene(To {
                left: eye as u32 * EDGE,
                keeps: true,
                ..plain
            }),
            Layout::Msaa => scene(To {
                view: self.own[eye].0.view,
                resolve: view,
                ..To::default()
            }),
            Layout::Target => {
                let (own, set) = &self.own[eye];
                let read = vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL;
                scene(To {
                    view: own.view,
                    ..To::default()
                });
                change(gpu, buffer, own.handle, [COLOR, read]);
                draw(gpu, buffer, &self.draws, self.pipelines[2], *set, plain);
                change(gpu, buffer, own.handle, [read, COLOR]);
            }
            Layout::Blit => {
                let own = self.own[eye].0;
                scene(To {
                    view: own.view,
                    ..To::default()
                });
                let (from, to) = (
                    vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
                    vk::ImageLayout::TRANSFER_DST_OPTIMAL,
                );
                change(gpu, buffer, own.handle, [COLOR, from]);
                change(gpu, buffer, image, [COLOR, to]);
                let layers = |layer| vk::ImageSubresourceLayers {
                    aspect_mask: vk::ImageAspectFlags::COLOR,
                    mip_level: 0,
                    base_array_layer: layer,
                    layer_count: 1,
                };
                let corners = [
                    vk::Offset3D::default(),
                    vk::Offset3D {
                        x: EDGE as i32,
                        y: EDGE as i32,
                        z: 1,
                    },
                ];
                let blit = vk::ImageBlit {
                    src_subresource: layers(0),
                    src_offsets: corners,
                    dst_subresource: layers(eye as u32),
                    dst_offsets: corners,
                };
                // SAFETY: the command buffer is being recorded, and the images are in these layouts.
                unsafe {
                    gpu.device.cmd_blit_image(
                        buffer,
                        own.handle,
                        from,
                        image,
                        to,
                        &[blit],
                        vk::Filter::NEAREST,
                    )
                };
                change(gpu, buffer, own.handle, [from, COLOR]);
                change(gpu, buffer, image, [to, COLOR]);
            }
        }
    }

    /// The part of a swapchain that shows an eye.
    pub fn shown(&self, eye: usize) -> xr::SwapchainSubImage {
        let chain = &self.chains[eye.min(self.chains.len() - 1)];
        let left = if self.layout == Layout::Side {
            eye as i32 * EDGE as i32
        } else {
            0
        };
        let layer = match self.layout {
            Layout::Separate | Layout::Side => 0,
            _ => eye as u32,
        };
        xr::SwapchainSubImage {
            swapchain: chain.handle,
            image_rect: xr::Rect2Di {
                offset: xr::Offset2Di { x: left, y: 0 },
                extent: xr::Extent2Di {
                    width: EDGE as i32,
                    height: EDGE as i32,
                },
            },
            image_array_index: layer,
        }
    }
}

impl Chain {
    fn new(
        api: &Api,
        session: xr::Session,
        gpu: &Gpu,
        size: [u32; 2],
        layers: u32,
        multiview: bool,
    ) -> Result<Self> {
        let info = swapchain_info(size, layers);
        let mut handle = xr::Swapchain::default();
        xr_do!(api, CreateSwapchain(session, &info, &mut handle));
        let mut count = 0;
        xr_do!(
            api,
            EnumerateSwapchainImages(handle, 0, &mut count, std::ptr::null_mut())
        );
        let mut images: Vec<xr::SwapchainImageVulkanKHR> = Vec::new();
        images.resize_with(count as usize, || {
            of(xr::StructureType::SWAPCHAIN_IMAGE_VULKAN_KHR)
        });
        xr_do!(
            api,
            EnumerateSwapchainImages(handle, count, &mut count, images.as_mut_ptr().cast())
        );
        let images: Vec<vk::Image> = images
            .iter()
            .map(|image| vk::Image::from_raw(image.image))
            .collect();
        let mut views = Vec::new();
        for &image in &images {
            let of_eye = |eye: u32| match (layers, multiview) {
                (1, _) => view(gpu, image, 0, 1),
                (_, true) => view(gpu, image, 0, 2),
                _ => view(gpu, image, eye, 1),
            };
            views.push([of_eye(0)?, of_eye(1)?]);
        }
        Ok(Self {
            handle,
            images,
            views,
        })
    }
}

/// A swapchain of this size.
pub fn swapchain_info(size: [u32; 2], layers: u32) -> xr::SwapchainCreateInfo {
    let mut info: xr::SwapchainCreateInfo = of(xr::StructureType::SWAPCHAIN_CREATE_INFO);
    info.usage_flags =
        xr::SwapchainUsageFlags::COLOR_ATTACHMENT | xr::SwapchainUsageFlags::TRANSFER_DST;
    info.format = i64::from(FORMAT.as_raw());
    info.sample_count = 1;
    [info.width, info.height] = size;
    (info.face_count, info.array_size, info.mip_count) = (1, layers, 1);
    info
}
