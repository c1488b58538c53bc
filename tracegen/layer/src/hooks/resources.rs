//! Hooks of images, views, samplers and swapchains.

use super::api::{find, slice};
use super::device::Device;
use crate::capture::lock;
use ash::vk::{self, Handle};

type Allocator = *const vk::AllocationCallbacks<'static>;

pub(super) unsafe extern "system" fn create_image(
    device: vk::Device,
    info: *const vk::ImageCreateInfo<'_>,
    allocator: Allocator,
    image: *mut vk::Image,
) -> vk::Result {
    // SAFETY: a valid call of vkCreateImage.
    unsafe {
        let known = Device::of(device);
        let result = (known.next.create_image)(device, info, allocator, image);
        if result == vk::Result::SUCCESS {
            known.tracker().images.create(*image, &*info);
        }
        result
    }
}

pub(super) unsafe extern "system" fn destroy_image(
    device: vk::Device,
    image: vk::Image,
    allocator: Allocator,
) {
    // SAFETY: a valid call of vkDestroyImage.
    unsafe {
        let known = Device::of(device);
        known.tracker().images.destroy(image);
        (known.next.destroy_image)(device, image, allocator);
    }
}

pub(super) unsafe extern "system" fn create_image_view(
    device: vk::Device,
    info: *const vk::ImageViewCreateInfo<'_>,
    allocator: Allocator,
    view: *mut vk::ImageView,
) -> vk::Result {
    // SAFETY: a valid call of vkCreateImageView.
    unsafe {
        let known = Device::of(device);
        let result = (known.next.create_image_view)(device, info, allocator, view);
        if result == vk::Result::SUCCESS {
            let least = find::<vk::ImageViewMinLodCreateInfoEXT<'_>>((*info).p_next);
            let min_lod = least.map_or(0.0, |least| least.min_lod);
            known.tracker().images.create_view(*view, &*info, min_lod);
        }
        result
    }
}

pub(super) unsafe extern "system" fn destroy_image_view(
    device: vk::Device,
    view: vk::ImageView,
    allocator: Allocator,
) {
    // SAFETY: a valid call of vkDestroyImageView.
    unsafe {
        let known = Device::of(device);
        known.tracker().images.destroy_view(view);
        (known.next.destroy_image_view)(device, view, allocator);
    }
}

pub(super) unsafe extern "system" fn create_sampler(
    device: vk::Device,
    info: *const vk::SamplerCreateInfo<'_>,
    allocator: Allocator,
    sampler: *mut vk::Sampler,
) -> vk::Result {
    // SAFETY: a valid call of vkCreateSampler.
    unsafe {
        let known = Device::of(device);
        let result = (known.next.create_sampler)(device, info, allocator, sampler);
        if result == vk::Result::SUCCESS {
            known.tracker().images.create_sampler(*sampler, &*info);
        }
        result
    }
}

pub(super) unsafe extern "system" fn destroy_sampler(
    device: vk::Device,
    sampler: vk::Sampler,
    allocator: Allocator,
) {
    // SAFETY: a valid call of vkDestroySampler.
    unsafe {
        let known = Device::of(device);
        known.tracker().images.destroy_sampler(sampler);
        (known.next.destroy_sampler)(device, sampler, allocator);
    }
}

pub(super) unsafe extern "system" fn create_swapchain(
    device: vk::Device,
    info: *const vk::SwapchainCreateInfoKHR<'_>,
    allocator: Allocator,
    swapchain: *mut vk::SwapchainKHR,
) -> vk::Result {
    // SAFETY: a valid call of vkCreateSwapchainKHR.
    unsafe {
        let known = Device::of(device);
        let result = (known.next.create_swapchain)(device, info, allocator, swapchain);
        if result == vk::Result::SUCCESS {
            // The chain and its arrays are valid only during the call.
            let kept = vk::SwapchainCreateInfoKHR {
                image_format: (*info).image_format,
                image_extent: (*info).image_extent,
                image_array_layers: (*info).image_array_layers,
                ..Default::default()
            };
            known.capture.note_swapchain();
            lock(&known.swapchains).insert((*swapchain).as_raw(), kept);
        }
        result
    }
}

pub(super) unsafe extern "system" fn get_swapchain_images(
    device: vk::Device,
    swapchain: vk::SwapchainKHR,
    count: *mut u32,
    images: *mut vk::Image,
) -> vk::Result {
    // SAFETY: a valid call of vkGetSwapchainImagesKHR.
    unsafe {
        let known = Device::of(device);
        let result = (known.next.get_swapchain_images)(device, swapchain, count, images);
        let handed_out = [vk::Result::SUCCESS, vk::Result::INCOMPLETE].contains(&result);
        if handed_out && let Some(info) = lock(&known.swapchains).get(&swapchain.as_raw()) {
            for image in slice(images, *count) {
                known.tracker().images.of_swapchain(*image, info);
            }
        }
        result
    }
}
