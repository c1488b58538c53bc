//! Hooks of descriptor sets.

use super::api::slice;
use super::device::Device;
use crate::track::{Template, TemplateEntry, Written};
use ash::vk::{self, Handle};
use std::ffi::c_void;

creates! {
    create_set_layout DescriptorSetLayoutCreateInfo => DescriptorSetLayout |device, info, layout| {
        let bindings = slice(info.p_bindings, info.binding_count).iter();
        let bindings: Vec<_> = bindings.map(|binding| layout_binding(binding)).collect();
        let tracker = &mut *device.tracker();
        tracker.descriptors.create_layout(layout, bindings, &tracker.images);
    };
    create_template DescriptorUpdateTemplateCreateInfo => DescriptorUpdateTemplate |device, info, template|
        device.tracker().descriptors.create_template(template, described(info));
}

destroys! {
    destroy_set_layout DescriptorSetLayout |device, layout| device.tracker().descriptors.destroy_layout(layout);
    destroy_pool DescriptorPool |device, pool| device.tracker().descriptors.reset_pool(pool);
    destroy_template DescriptorUpdateTemplate |device, template| device.tracker().descriptors.destroy_template(template);
}

after! {
    allocate_sets(handle: vk::Device, info: *const vk::DescriptorSetAllocateInfo<'_>, sets: *mut vk::DescriptorSet) |device, result|
        if result == vk::Result::SUCCESS {
            let count = (*info).descriptor_set_count;
            let layouts = slice((*info).p_set_layouts, count);
            let mut tracker = device.tracker();
            for (set, layout) in slice(sets, count).iter().zip(layouts) {
                tracker.descriptors.allocate((*info).descriptor_pool, *set, *layout);
            }
        };
}

before! {
    free_sets(handle: vk::Device, pool: vk::DescriptorPool, count: u32, sets: *const vk::DescriptorSet) -> vk::Result |device|
        device.tracker().descriptors.free(pool, slice(sets, count));
    reset_pool(handle: vk::Device, pool: vk::DescriptorPool, flags: vk::DescriptorPoolResetFlags) -> vk::Result |device|
        device.tracker().descriptors.reset_pool(pool);
    update_sets(handle: vk::Device, writes: u32, first_write: *const vk::WriteDescriptorSet<'_>, copies: u32, first_copy: *const vk::CopyDescriptorSet<'_>) |device| {
        let tracker = &mut *device.tracker();
        for write in slice(first_write, writes) {
            tracker.descriptors.write(write.dst_set, &written(write), &tracker.images);
        }
        for copy in slice(first_copy, copies) {
            tracker.descriptors.copy(copy);
        }
    };
    update_with_template(handle: vk::Device, set: vk::DescriptorSet, template: vk::DescriptorUpdateTemplate, data: *const c_void) |device| {
        let tracker = &mut *device.tracker();
        if let Some(of) = tracker.descriptors.template(template).cloned() {
            for write in from_template(&of, data) {
                tracker.descriptors.write(set, &write, &tracker.images);
            }
        }
    };
    cmd_bind_sets(buffer: vk::CommandBuffer, point: vk::PipelineBindPoint, layout: vk::PipelineLayout, first: u32, count: u32, sets: *const vk::DescriptorSet, offset_count: u32, offsets: *const u32) |device|
        if point == vk::PipelineBindPoint::GRAPHICS {
            let handles = slice(sets, count).iter().map(|set| set.as_raw());
            device.tracker().commands.get_mut(buffer.as_raw()).bind_sets(first, handles);
        };
    cmd_push_set(buffer: vk::CommandBuffer, point: vk::PipelineBindPoint, layout: vk::PipelineLayout, set: u32, count: u32, writes: *const vk::WriteDescriptorSet<'_>) |device|
        if point == vk::PipelineBindPoint::GRAPHICS {
            let of: Vec<Written> = slice(writes, count).iter().map(|w| written(w)).collect();
            push(&device, buffer, layout, set, &of);
        };
    cmd_push_set_with_template(buffer: vk::CommandBuffer, template: vk::DescriptorUpdateTemplate, layout: vk::PipelineLayout, set: u32, data: *const c_void) |device| {
        let of = device.tracker().descriptors.template(template).cloned();
        if let Some(of) = of.filter(|of| of.graphics) {
            push(&device, buffer, layout, set, &from_template(&of, data));
        }
    };
}

/// Number, count and immutable samplers of a binding.
///
/// # Safety
/// A valid description.
unsafe fn layout_binding(
    binding: &vk::DescriptorSetLayoutBinding<'_>,
) -> (u32, u32, Vec<vk::Sampler>) {
    let count = binding.descriptor_count;
    let has_samplers = [
        vk::DescriptorType::SAMPLER,
        vk::DescriptorType::COMBINED_IMAGE_SAMPLER,
    ]
    .contains(&binding.descriptor_type);
    let samplers = match has_samplers {
        // SAFETY: as the caller promises. For other kinds of descriptors the pointer is ignored and may be invalid.
        true => unsafe { slice(binding.p_immutable_samplers, count) }.to_vec(),
        false => Vec::new(),
    };
    (binding.binding, count, samplers)
}

/// The textures of a template.
///
/// # Safety
/// A valid description.
unsafe fn described(info: &vk::DescriptorUpdateTemplateCreateInfo<'_>) -> Template {
    // SAFETY: as the caller promises.
    let entries = unsafe {
        slice(
            info.p_descriptor_update_entries,
            info.descriptor_update_entry_count,
        )
    };
    let textures = entries
        .iter()
        .filter(|entry| is_texture(entry.descriptor_type));
    let entries = textures.map(|entry| TemplateEntry {
        binding: entry.dst_binding,
        element: entry.dst_array_element,
        count: entry.descriptor_count,
        kind: entry.descriptor_type,
        offset: entry.offset,
        stride: entry.stride,
    });
    Template {
        entries: entries.collect(),
        graphics: info.pipeline_bind_point == vk::PipelineBindPoint::GRAPHICS,
    }
}

/// Describes a write of descriptors, with its images if they are textures.
///
/// # Safety
/// A valid `VkWriteDescriptorSet`.
unsafe fn written(write: &vk::WriteDescriptorSet<'_>) -> Written {
    let images = match is_texture(write.descriptor_type) {
        // SAFETY: for these kinds, the array has this number of elements.
        true => unsafe { slice(write.p_image_info, write.descriptor_count) },
        false => &[],
    };
    Written {
        binding: write.dst_binding,
        element: write.dst_array_element,
        kind: write.descriptor_type,
        images: images.to_vec(),
    }
}

fn is_texture(kind: vk::DescriptorType) -> bool {
    use vk::DescriptorType as Type;
    matches!(
        kind,
        Type::SAMPLER
            | Type::COMBINED_IMAGE_SAMPLER
            | Type::SAMPLED_IMAGE
            | Type::STORAGE_IMAGE
            | Type::INPUT_ATTACHMENT
    )
}

/// The writes that a template describes.
///
/// # Safety
/// `data` has the layout of the template.
unsafe fn from_template(template: &Template, data: *const c_void) -> Vec<Written> {
    let read = |entry: &TemplateEntry| Written {
        binding: entry.binding,
        element: entry.element,
        kind: entry.kind,
        images: (0..entry.count as usize)
            .map(|number| {
                let at = entry.offset + number * entry.stride;
                // SAFETY: as the caller promises; the data need not be aligned.
                unsafe {
                    let info: *const vk::DescriptorImageInfo = data.cast::<u8>().add(at).cast();
                    info.read_unaligned()
                }
            })
            .collect(),
    };
    template.entries.iter().map(read).collect()
}

/// Tracks descriptors that are pushed to a set.
fn push(
    device: &Device,
    buffer: vk::CommandBuffer,
    layout: vk::PipelineLayout,
    set: u32,
    writes: &[Written],
) {
    let tracker = &mut *device.tracker();
    let state = tracker.commands.get_mut(buffer.as_raw());
    let of_layout = tracker.pipelines.layout(layout);
    let empty = of_layout.and_then(|layout| layout.sets.get(set as usize));
    let pushed = state.push(set, || empty.cloned().unwrap_or_default());
    for write in writes {
        pushed.write(write, &tracker.images);
    }
}
