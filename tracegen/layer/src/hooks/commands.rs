//! Hooks of command buffers for bound objects, dynamic state and queries.

use super::api::slice;
use super::device::Device;
use crate::track::CommandState;
use ash::vk::{self, Handle};

pub(super) unsafe extern "system" fn begin_command_buffer(
    buffer: vk::CommandBuffer,
    info: *const vk::CommandBufferBeginInfo<'_>,
) -> vk::Result {
    // SAFETY: a valid call of vkBeginCommandBuffer.
    unsafe {
        let known = Device::of(buffer);
        let one_time = (*info)
            .flags
            .contains(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        known.tracker().commands.begin(buffer.as_raw(), one_time);
        (known.next.begin_command_buffer)(buffer, info)
    }
}

pub(super) unsafe extern "system" fn free_command_buffers(
    device: vk::Device,
    pool: vk::CommandPool,
    count: u32,
    buffers: *const vk::CommandBuffer,
) {
    // SAFETY: a valid call of vkFreeCommandBuffers.
    unsafe {
        let known = Device::of(device);
        for buffer in slice(buffers, count) {
            known.tracker().commands.free(buffer.as_raw());
        }
        (known.next.free_command_buffers)(device, pool, count, buffers);
    }
}

pub(super) unsafe extern "system" fn cmd_bind_pipeline(
    buffer: vk::CommandBuffer,
    point: vk::PipelineBindPoint,
    pipeline: vk::Pipeline,
) {
    // SAFETY: a valid call of vkCmdBindPipeline. The recording pipeline has the same dynamic states.
    unsafe {
        let known = Device::of(buffer);
        let mut bound = pipeline;
        if point == vk::PipelineBindPoint::GRAPHICS {
            let tracker = &mut *known.tracker();
            let of = tracker.pipelines.get(pipeline).cloned();
            let state = tracker.commands.get_mut(buffer.as_raw());
            let twin = of.as_ref().and_then(|of| of.recorded.as_ref());
            if let Some(twin) = twin
                && !twin.twice
                && super::draws::records(&known, state)
            {
                bound = twin.handle;
            }
            state.bind(pipeline, of);
        } else if point == vk::PipelineBindPoint::COMPUTE {
            let tracker = &mut *known.tracker();
            let of = tracker.pipelines.compute(pipeline);
            tracker.commands.get_mut(buffer.as_raw()).compute = of;
        }
        (known.next.cmd_bind_pipeline)(buffer, point, bound);
    }
}

pub(super) unsafe extern "system" fn cmd_execute_commands(
    buffer: vk::CommandBuffer,
    count: u32,
    secondaries: *const vk::CommandBuffer,
) {
    // SAFETY: a valid call of vkCmdExecuteCommands.
    unsafe {
        let known = Device::of(buffer);
        for secondary in slice(secondaries, count) {
            known
                .tracker()
                .commands
                .execute(buffer.as_raw(), secondary.as_raw());
        }
        (known.next.cmd_execute_commands)(buffer, count, secondaries);
    }
}

/// Changes the tracked state of a command buffer.
///
/// # Safety
/// The command buffer is being recorded.
unsafe fn set(
    buffer: vk::CommandBuffer,
    change: impl FnOnce(&mut CommandState),
) -> std::sync::Arc<Device> {
    // SAFETY: as the caller promises.
    let known = unsafe { Device::of(buffer) };
    change(known.tracker().commands.get_mut(buffer.as_raw()));
    known
}

/// Hooks of commands that set a state: the change of the tracked state, and the next function.
macro_rules! setters {
    ($($hook:ident ($($argument:ident: $kind:ty),*) $next:ident |$state:ident| $change:expr;)*) => { $(
        pub(super) unsafe extern "system" fn $hook(buffer: vk::CommandBuffer, $($argument: $kind),*) {
            // SAFETY: a valid call of the command; its arrays have the lengths in its arguments.
            unsafe {
                let known = set(buffer, |$state| $change);
                (known.next.$next)(buffer, $($argument),*);
            }
        }
    )* };
}

setters! {
    cmd_set_viewport(first: u32, count: u32, viewports: *const vk::Viewport) cmd_set_viewport |state|
        if first == 0 { state.dynamic.viewport = slice(viewports, count).first().copied() };
    cmd_set_viewport_with_count(count: u32, viewports: *const vk::Viewport) cmd_set_viewport_with_count |state|
        state.dynamic.viewport = slice(viewports, count).first().copied();
    cmd_set_scissor(first: u32, count: u32, scissors: *const vk::Rect2D) cmd_set_scissor |state|
        if first == 0 { state.dynamic.scissor = slice(scissors, count).first().copied() };
    cmd_set_scissor_with_count(count: u32, scissors: *const vk::Rect2D) cmd_set_scissor_with_count |state|
        state.dynamic.scissor = slice(scissors, count).first().copied();
    cmd_set_topology(topology: vk::PrimitiveTopology) cmd_set_topology |state|
        state.dynamic.topology = Some(topology);
    cmd_set_depth_test(enable: vk::Bool32) cmd_set_depth_test |state|
        state.dynamic.depth_test = Some(enable != 0);
    cmd_set_depth_write(enable: vk::Bool32) cmd_set_depth_write |state|
        state.dynamic.depth_write = Some(enable != 0);
    cmd_set_depth_compare(compare: vk::CompareOp) cmd_set_depth_compare |state|
        state.dynamic.depth_compare = Some(compare);
    cmd_set_stencil_test(enable: vk::Bool32) cmd_set_stencil_test |state|
        state.dynamic.stencil_test = Some(enable != 0);
    cmd_set_stencil_op(faces: vk::StencilFaceFlags, fail: vk::StencilOp, pass: vk::StencilOp, depth_fail: vk::StencilOp, compare: vk::CompareOp) cmd_set_stencil_op |state| {
        state.dynamic.stencil_ops.retain(|op| op.0 != faces);
        state.dynamic.stencil_ops.push((faces, fail, pass, depth_fail, compare));
    };
    cmd_set_stencil_write_mask(faces: vk::StencilFaceFlags, mask: u32) cmd_set_stencil_write_mask |state| {
        state.dynamic.stencil_write_masks.retain(|of| of.0 != faces);
        state.dynamic.stencil_write_masks.push((faces, mask));
    };
    cmd_set_color_write_mask(first: u32, count: u32, masks: *const vk::ColorComponentFlags) cmd_set_color_write_mask |state|
        state.dynamic.color_masks = Some((first, slice(masks, count).to_vec()));
    cmd_set_color_write_enable(count: u32, enables: *const vk::Bool32) cmd_set_color_write_enable |state|
        state.dynamic.color_enables = Some(slice(enables, count).to_vec());
    cmd_set_event(event: vk::Event, stages: vk::PipelineStageFlags) cmd_set_event |state|
        state.effects.set_event(event);
    cmd_set_event2(event: vk::Event, info: *const vk::DependencyInfo<'_>) cmd_set_event2 |state|
        state.effects.set_event(event);
    cmd_wait_events(count: u32, events: *const vk::Event, from: vk::PipelineStageFlags, to: vk::PipelineStageFlags, memory_count: u32, memory: *const vk::MemoryBarrier<'_>, buffer_count: u32, buffers: *const vk::BufferMemoryBarrier<'_>, image_count: u32, images: *const vk::ImageMemoryBarrier<'_>) cmd_wait_events |state|
        state.effects.await_events(slice(events, count));
    cmd_wait_events2(count: u32, events: *const vk::Event, infos: *const vk::DependencyInfo<'_>) cmd_wait_events2 |state|
        state.effects.await_events(slice(events, count));
    cmd_begin_query(pool: vk::QueryPool, query: u32, flags: vk::QueryControlFlags) cmd_begin_query |state|
        state.active_queries += 1;
    cmd_end_query(pool: vk::QueryPool, query: u32) cmd_end_query |state|
        state.active_queries = state.active_queries.saturating_sub(1);
    cmd_begin_query_indexed(pool: vk::QueryPool, query: u32, flags: vk::QueryControlFlags, index: u32) cmd_begin_query_indexed |state|
        state.active_queries += 1;
    cmd_end_query_indexed(pool: vk::QueryPool, query: u32, index: u32) cmd_end_query_indexed |state|
        state.active_queries = state.active_queries.saturating_sub(1);
    cmd_begin_transform_feedback(first: u32, count: u32, buffers: *const vk::Buffer, offsets: *const vk::DeviceSize) cmd_begin_transform_feedback |state|
        state.active_queries += 1;
    cmd_end_transform_feedback(first: u32, count: u32, buffers: *const vk::Buffer, offsets: *const vk::DeviceSize) cmd_end_transform_feedback |state|
        state.active_queries = state.active_queries.saturating_sub(1);
}

/// Hooks of commands that copy images: what is noted, and the next function.
macro_rules! copies {
    ($($hook:ident ($($argument:ident: $kind:ty),*) $note:ident ($($image:expr),*);)*) => { $(
        pub(super) unsafe extern "system" fn $hook(buffer: vk::CommandBuffer, $($argument: $kind),*) {
            // SAFETY: a valid call of the command.
            unsafe {
                let known = Device::of(buffer);
                known.tracker().$note(buffer, $($image),*);
                (known.next.$hook)(buffer, $($argument),*);
            }
        }
    )* };
}

copies! {
    cmd_copy_image(from: vk::Image, from_layout: vk::ImageLayout, to: vk::Image, to_layout: vk::ImageLayout, count: u32, regions: *const vk::ImageCopy)
        note_copy(from, to);
    cmd_copy_image2(info: *const vk::CopyImageInfo2<'_>) note_copy((*info).src_image, (*info).dst_image);
    cmd_blit_image(from: vk::Image, from_layout: vk::ImageLayout, to: vk::Image, to_layout: vk::ImageLayout, count: u32, regions: *const vk::ImageBlit, filter: vk::Filter)
        note_copy(from, to);
    cmd_blit_image2(info: *const vk::BlitImageInfo2<'_>) note_copy((*info).src_image, (*info).dst_image);
    cmd_resolve_image(from: vk::Image, from_layout: vk::ImageLayout, to: vk::Image, to_layout: vk::ImageLayout, count: u32, regions: *const vk::ImageResolve)
        note_copy(from, to);
    cmd_resolve_image2(info: *const vk::ResolveImageInfo2<'_>) note_copy((*info).src_image, (*info).dst_image);
    cmd_copy_image_to_buffer(image: vk::Image, layout: vk::ImageLayout, to: vk::Buffer, count: u32, regions: *const vk::BufferImageCopy)
        note_read_back(image, slice(regions, count).iter().map(|region| region.image_extent));
    cmd_copy_image_to_buffer2(info: *const vk::CopyImageToBufferInfo2<'_>) note_read_back(
        (*info).src_image,
        slice((*info).p_regions, (*info).region_count).iter().map(|region| region.image_extent)
    );
}
