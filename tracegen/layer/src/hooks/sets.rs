//! Hooks of descriptor sets.

use super::api::slice;
use super::device::Device;
use crate::track::{Template, TemplateEntry, Written};
use ash::vk::{self, Handle};
use std::ffi::c_void;

type Allocator = *const vk::AllocationCallbacks<'static>;

pub(super) unsafe extern "system" fn create_set_layout(
    device: vk::Device,
    info: *const vk::DescriptorSetLayoutCreateInfo<'_>,
    allocator: Allocator,
    layout: *mut vk::DescriptorSetLayout,
) -> vk::Result {
    // SAFETY: a valid call of vkCreateDescriptorSetLayout.
    unsafe {
        let known = Device::of(device);
        let result = (known.next.create_set_layout)(device, info, allocator, layout);
        if result == vk::Result::SUCCESS {
            let bindings = slice((*info).p_bindings, (*info).binding_count).iter();
            let bindings = bindings.map(|binding| {
                let count = binding.descriptor_count;
                let has_samplers = [
                    vk::DescriptorType::SAMPLER,
                    vk::DescriptorType::COMBINED_IMAGE_SAMPLER,
                ]
                .contains(&binding.descriptor_type);
                // For other kinds of descriptors the pointer is ignored and may be invalid.
                let samplers = match has_samplers {
                    true => slice(binding.p_immutable_samplers, count).to_vec(),
                    false => Vec::new(),
                };
                (binding.binding, count, samplers)
            });
            let bindings: Vec<_> = bindings.collect();
            let tracker = &mut *known.tracker();
            tracker
                .descriptors
                .create_layout(*layout, bindings, &tracker.images);
        }
        result
    }
}

pub(super) unsafe extern "system" fn destroy_set_layout(
    device: vk::Device,
    layout: vk::DescriptorSetLayout,
    allocator: Allocator,
) {
    // SAFETY: a valid call of vkDestroyDescriptorSetLayout.
    unsafe {
        let known = Device::of(device);
        known.tracker().descriptors.destroy_layout(layout);
        (known.next.destroy_set_layout)(device, layout, allocator);
    }
}

pub(super) unsafe extern "system" fn allocate_sets(
    device: vk::Device,
    info: *const vk::DescriptorSetAllocateInfo<'_>,
    sets: *mut vk::DescriptorSet,
) -> vk::Result {
    // SAFETY: a valid call of vkAllocateDescriptorSets.
    unsafe {
        let known = Device::of(device);
        let result = (known.next.allocate_sets)(device, info, sets);
        if result == vk::Result::SUCCESS {
            let count = (*info).descriptor_set_count;
            let layouts = slice((*info).p_set_layouts, count);
            let mut tracker = known.tracker();
            for (set, layout) in slice(sets, count).iter().zip(layouts) {
                tracker
                    .descriptors
                    .allocate((*info).descriptor_pool, *set, *layout);
            }
        }
        result
    }
}

pub(super) unsafe extern "system" fn free_sets(
    device: vk::Device,
    pool: vk::DescriptorPool,
    count: u32,
    sets: *const vk::DescriptorSet,
) -> vk::Result {
    // SAFETY: a valid call of vkFreeDescriptorSets.
    unsafe {
        let known = Device::of(device);
        known.tracker().descriptors.free(pool, slice(sets, count));
        (known.next.free_sets)(device, pool, count, sets)
    }
}

pub(super) unsafe extern "system" fn reset_pool(
    device: vk::Device,
    pool: vk::DescriptorPool,
    flags: vk::DescriptorPoolResetFlags,
) -> vk::Result {
    // SAFETY: a valid call of vkResetDescriptorPool.
    unsafe {
        let known = Device::of(device);
        known.tracker().descriptors.reset_pool(pool);
        (known.next.reset_pool)(device, pool, flags)
    }
}

pub(super) unsafe extern "system" fn destroy_pool(
    device: vk::Device,
    pool: vk::DescriptorPool,
    allocator: Allocator,
) {
    // SAFETY: a valid call of vkDestroyDescriptorPool.
    unsafe {
        let known = Device::of(device);
        known.tracker().descriptors.reset_pool(pool);
        (known.next.destroy_pool)(device, pool, allocator);
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

pub(super) unsafe extern "system" fn update_sets(
    device: vk::Device,
    writes: u32,
    first_write: *const vk::WriteDescriptorSet<'_>,
    copies: u32,
    first_copy: *const vk::CopyDescriptorSet<'_>,
) {
    // SAFETY: a valid call of vkUpdateDescriptorSets.
    unsafe {
        let known = Device::of(device);
        {
            let tracker = &mut *known.tracker();
            for write in slice(first_write, writes) {
                let of = written(write);
                tracker
                    .descriptors
                    .write(write.dst_set, &of, &tracker.images);
            }
            for copy in slice(first_copy, copies) {
                tracker.descriptors.copy(copy);
            }
        }
        (known.next.update_sets)(device, writes, first_write, copies, first_copy);
    }
}

pub(super) unsafe extern "system" fn create_template(
    device: vk::Device,
    info: *const vk::DescriptorUpdateTemplateCreateInfo<'_>,
    allocator: Allocator,
    template: *mut vk::DescriptorUpdateTemplate,
) -> vk::Result {
    // SAFETY: a valid call of vkCreateDescriptorUpdateTemplate.
    unsafe {
        let known = Device::of(device);
        let result = (known.next.create_template)(device, info, allocator, template);
        if result == vk::Result::SUCCESS {
            let info = &*info;
            let entries = slice(
                info.p_descriptor_update_entries,
                info.descriptor_update_entry_count,
            );
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
            let of = Template {
                entries: entries.collect(),
                graphics: info.pipeline_bind_point == vk::PipelineBindPoint::GRAPHICS,
            };
            known.tracker().descriptors.create_template(*template, of);
        }
        result
    }
}

pub(super) unsafe extern "system" fn destroy_template(
    device: vk::Device,
    template: vk::DescriptorUpdateTemplate,
    allocator: Allocator,
) {
    // SAFETY: a valid call of vkDestroyDescriptorUpdateTemplate.
    unsafe {
        let known = Device::of(device);
        known.tracker().descriptors.destroy_template(template);
        (known.next.destroy_template)(device, template, allocator);
    }
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

pub(super) unsafe extern "system" fn update_with_template(
    device: vk::Device,
    set: vk::DescriptorSet,
    template: vk::DescriptorUpdateTemplate,
    data: *const c_void,
) {
    // SAFETY: a valid call of vkUpdateDescriptorSetWithTemplate.
    unsafe {
        let known = Device::of(device);
        {
            let tracker = &mut *known.tracker();
            if let Some(of) = tracker.descriptors.template(template).cloned() {
                for write in from_template(&of, data) {
                    tracker.descriptors.write(set, &write, &tracker.images);
                }
            }
        }
        (known.next.update_with_template)(device, set, template, data);
    }
}

pub(super) unsafe extern "system" fn cmd_bind_sets(
    buffer: vk::CommandBuffer,
    point: vk::PipelineBindPoint,
    layout: vk::PipelineLayout,
    first: u32,
    count: u32,
    sets: *const vk::DescriptorSet,
    offset_count: u32,
    offsets: *const u32,
) {
    // SAFETY: a valid call of vkCmdBindDescriptorSets.
    unsafe {
        let known = Device::of(buffer);
        if point == vk::PipelineBindPoint::GRAPHICS {
            let handles = slice(sets, count).iter().map(|set| set.as_raw());
            let mut tracker = known.tracker();
            tracker
                .commands
                .get_mut(buffer.as_raw())
                .bind_sets(first, handles);
        }
        (known.next.cmd_bind_sets)(
            buffer,
            point,
            layout,
            first,
            count,
            sets,
            offset_count,
            offsets,
        );
    }
}

/// Tracks descriptors that are pushed to a set.
fn push(
    known: &Device,
    buffer: vk::CommandBuffer,
    layout: vk::PipelineLayout,
    set: u32,
    writes: &[Written],
) {
    let tracker = &mut *known.tracker();
    let state = tracker.commands.get_mut(buffer.as_raw());
    let of_layout = tracker.pipelines.layout(layout);
    let empty = of_layout.and_then(|layout| layout.sets.get(set as usize));
    let pushed = state.push(set, || empty.cloned().unwrap_or_default());
    for write in writes {
        pushed.write(write, &tracker.images);
    }
}

pub(super) unsafe extern "system" fn cmd_push_set(
    buffer: vk::CommandBuffer,
    point: vk::PipelineBindPoint,
    layout: vk::PipelineLayout,
    set: u32,
    count: u32,
    writes: *const vk::WriteDescriptorSet<'_>,
) {
    // SAFETY: a valid call of vkCmdPushDescriptorSetKHR.
    unsafe {
        let known = Device::of(buffer);
        if point == vk::PipelineBindPoint::GRAPHICS {
            let of: Vec<Written> = slice(writes, count).iter().map(|w| written(w)).collect();
            push(&known, buffer, layout, set, &of);
        }
        (known.next.cmd_push_set)(buffer, point, layout, set, count, writes);
    }
}

pub(super) unsafe extern "system" fn cmd_push_set_with_template(
    buffer: vk::CommandBuffer,
    template: vk::DescriptorUpdateTemplate,
    layout: vk::PipelineLayout,
    set: u32,
    data: *const c_void,
) {
    // SAFETY: a valid call of vkCmdPushDescriptorSetWithTemplateKHR.
    unsafe {
        let known = Device::of(buffer);
        let of = known.tracker().descriptors.template(template).cloned();
        if let Some(of) = of.filter(|of| of.graphics) {
            push(&known, buffer, layout, set, &from_template(&of, data));
        }
        (known.next.cmd_push_set_with_template)(buffer, template, layout, set, data);
    }
}
