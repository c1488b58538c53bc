//! Hooks of images, views, samplers and swapchains.

use super::api::{find, slice};
use super::device::Device;
use crate::capture::lock;
use ash::vk::{self, Handle};

creates! {
    create_image ImageCreateInfo => Image |device, info, image|
        device.tracker().images.create(image, info);
    create_image_view ImageViewCreateInfo => ImageView |device, info, view| {
        let least = find::<vk::ImageViewMinLodCreateInfoEXT<'_>>(info.p_next);
        let min_lod = least.map_or(0.0, |least| least.min_lod);
        device.tracker().images.create_view(view, info, min_lod);
    };
    create_sampler SamplerCreateInfo => Sampler |device, info, sampler|
        device.tracker().images.create_sampler(sampler, info);
    create_swapchain SwapchainCreateInfoKHR => SwapchainKHR |device, info, swapchain| {
        // The chain and its arrays are valid only during the call.
        let kept = vk::SwapchainCreateInfoKHR {
            image_format: info.image_format,
            image_extent: info.image_extent,
            image_array_layers: info.image_array_layers,
            ..Default::default()
        };
        device.capture.note_swapchain();
        lock(&device.swapchains).insert(swapchain.as_raw(), kept);
    };
}

destroys! {
    destroy_image Image |device, image| device.tracker().images.destroy(image);
    destroy_image_view ImageView |device, view| device.tracker().images.destroy_view(view);
    destroy_sampler Sampler |device, sampler| device.tracker().images.destroy_sampler(sampler);
}

after! {
    get_swapchain_images(handle: vk::Device, swapchain: vk::SwapchainKHR, count: *mut u32, images: *mut vk::Image) |device, result| {
        let handed_out = [vk::Result::SUCCESS, vk::Result::INCOMPLETE].contains(&result);
        if handed_out && let Some(info) = lock(&device.swapchains).get(&swapchain.as_raw()) {
            for image in slice(images, *count) {
                device.tracker().images.of_swapchain(*image, info);
            }
        }
    };
}
