//! Images, image views and samplers.

use ash::vk::{self, Handle};
use spool::{ImageInfo, SamplerInfo, ViewInfo};
use std::collections::{HashMap, HashSet};
use std::sync::Arc;

/// Images, views and samplers by handle. Handles are reused, so images also have unique numbers.
#[derive(Debug, Default)]
pub struct Images {
    /// Number of the first image.
    first: u32,
    images: HashMap<u64, Arc<ImageInfo>>,
    /// Images whose texels the host can read in memory.
    linear: HashSet<u64>,
    /// By number. Destroyed images stay, because a draw may be described later.
    numbered: Vec<Arc<ImageInfo>>,
    views: HashMap<u64, ViewInfo>,
    samplers: HashMap<u64, SamplerInfo>,
}

impl Images {
    pub(super) fn numbered_from(first: u32) -> Self {
        Self {
            first,
            ..Self::default()
        }
    }

    /// Adds an image.
    pub fn create(&mut self, image: vk::Image, info: &vk::ImageCreateInfo<'_>) {
        let size = [info.extent.width, info.extent.height, info.extent.depth];
        if info.tiling == vk::ImageTiling::LINEAR {
            self.linear.insert(image.as_raw());
        }
        self.add(image, |number| ImageInfo {
            image: number,
            format: info.format.as_raw(),
            size,
            levels: info.mip_levels,
            layers: info.array_layers,
            samples: info.samples.as_raw(),
            presented: false,
        });
    }

    /// Adds an image of a swapchain, unless it is known.
    pub fn of_swapchain(&mut self, image: vk::Image, info: &vk::SwapchainCreateInfoKHR<'_>) {
        if self
            .images
            .get(&image.as_raw())
            .is_some_and(|known| known.presented)
        {
            return;
        }
        let size = [info.image_extent.width, info.image_extent.height, 1];
        self.add(image, |number| ImageInfo {
            image: number,
            format: info.image_format.as_raw(),
            size,
            levels: 1,
            layers: info.image_array_layers,
            samples: 1,
            presented: true,
        });
    }

    fn add(&mut self, image: vk::Image, info: impl FnOnce(u32) -> ImageInfo) {
        let info = Arc::new(info(self.first + self.numbered.len() as u32));
        self.numbered.push(Arc::clone(&info));
        self.images.insert(image.as_raw(), info);
    }

    /// Removes the handle of a destroyed image.
    pub fn destroy(&mut self, image: vk::Image) {
        self.images.remove(&image.as_raw());
        self.linear.remove(&image.as_raw());
    }

    /// Whether the host can read an image's texels in memory.
    pub fn is_linear(&self, image: vk::Image) -> bool {
        self.linear.contains(&image.as_raw())
    }

    /// The image of a handle.
    pub fn get(&self, image: vk::Image) -> Option<&Arc<ImageInfo>> {
        self.images.get(&image.as_raw())
    }

    /// The image with a number.
    pub fn numbered(&self, number: u32) -> Option<&Arc<ImageInfo>> {
        let place = number.checked_sub(self.first)?;
        self.numbered.get(place as usize)
    }

    /// Number and handle of the newest image with this width, height, number of layers and of samples.
    pub fn newest(&self, [width, height, layers, samples]: [u32; 4]) -> Option<(u32, vk::Image)> {
        let has_size = |image: &ImageInfo| {
            image.size == [width, height, 1] && image.layers == layers && image.samples == samples
        };
        let fitting = self.images.iter().filter(|(_, image)| has_size(image));
        let newest = fitting.max_by_key(|(_, image)| image.image);
        newest.map(|(handle, image)| (image.image, vk::Image::from_raw(*handle)))
    }

    /// Handle of an image, unless it was destroyed.
    pub fn handle(&self, number: u32) -> Option<vk::Image> {
        let mut all = self.images.iter();
        let found = all.find(|(_, image)| image.image == number);
        found.map(|(handle, _)| vk::Image::from_raw(*handle))
    }

    /// Adds an image view, with the least level that it lets samples read.
    pub fn create_view(
        &mut self,
        view: vk::ImageView,
        info: &vk::ImageViewCreateInfo<'_>,
        min_lod: f32,
    ) {
        let Some(image) = self.images.get(&info.image.as_raw()) else {
            return;
        };
        let range = &info.subresource_range;
        let rest = |first: u32, count: u32, all: u32, remaining: u32| {
            let rest = all.saturating_sub(first);
            [
                first,
                if count == remaining {
                    rest
                } else {
                    count.min(rest)
                },
            ]
        };
        let of = ViewInfo {
            image: image.image,
            format: info.format.as_raw(),
            kind: info.view_type.as_raw(),
            levels: rest(
                range.base_mip_level,
                range.level_count,
                image.levels,
                vk::REMAINING_MIP_LEVELS,
            ),
            layers: rest(
                range.base_array_layer,
                range.layer_count,
                image.layers,
                vk::REMAINING_ARRAY_LAYERS,
            ),
            min_lod_256ths: (256.0 * min_lod).round() as u32,
        };
        self.views.insert(view.as_raw(), of);
    }

    /// Removes an image view.
    pub fn destroy_view(&mut self, view: vk::ImageView) {
        self.views.remove(&view.as_raw());
    }

    /// The image view of a handle.
    pub fn view(&self, view: vk::ImageView) -> Option<ViewInfo> {
        self.views.get(&view.as_raw()).copied()
    }

    /// Adds a sampler.
    pub fn create_sampler(&mut self, sampler: vk::Sampler, info: &vk::SamplerCreateInfo<'_>) {
        // JSON cannot represent infinity.
        let finite = |value: f32| if value.is_finite() { value } else { 1000.0 };
        let of = SamplerInfo {
            filters: [info.mag_filter.as_raw(), info.min_filter.as_raw()],
            mip: info.mipmap_mode.as_raw(),
            wrap: [info.address_mode_u.as_raw(), info.address_mode_v.as_raw()],
            lod: [info.mip_lod_bias, info.min_lod, info.max_lod].map(finite),
            anisotropy: match info.anisotropy_enable {
                0 => 1.0,
                _ => finite(info.max_anisotropy),
            },
            unnormalized: info.unnormalized_coordinates != 0,
            non_seamless: (info.flags).contains(vk::SamplerCreateFlags::NON_SEAMLESS_CUBE_MAP_EXT),
        };
        self.samplers.insert(sampler.as_raw(), of);
    }

    /// Removes a sampler.
    pub fn destroy_sampler(&mut self, sampler: vk::Sampler) {
        self.samplers.remove(&sampler.as_raw());
    }

    /// The sampler of a handle.
    pub fn sampler(&self, sampler: vk::Sampler) -> Option<SamplerInfo> {
        self.samplers.get(&sampler.as_raw()).copied()
    }
}
