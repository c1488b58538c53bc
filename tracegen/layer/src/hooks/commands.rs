//! Hooks of command buffers for bound objects, dynamic state and queries.

use super::api::slice;
use super::device::Device;
use ash::vk::{self, Handle};

before! {
    begin_command_buffer(buffer: vk::CommandBuffer, info: *const vk::CommandBufferBeginInfo<'_>) -> vk::Result |device| {
        let one_time = (*info).flags.contains(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        device.tracker().commands.begin(buffer.as_raw(), one_time);
    };
    free_command_buffers(handle: vk::Device, pool: vk::CommandPool, count: u32, buffers: *const vk::CommandBuffer) |device|
        for buffer in slice(buffers, count) {
            device.tracker().commands.free(buffer.as_raw());
        };
    cmd_execute_commands(buffer: vk::CommandBuffer, count: u32, secondaries: *const vk::CommandBuffer) |device|
        for secondary in slice(secondaries, count) {
            device.tracker().commands.execute(buffer.as_raw(), secondary.as_raw());
        };
}

pub(super) unsafe extern "system" fn cmd_bind_pipeline(
    buffer: vk::CommandBuffer,
    point: vk::PipelineBindPoint,
    pipeline: vk::Pipeline,
) {
    // SAFETY: a valid call of vkCmdBindPipeline. The recording pipeline has the same dynamic states.
    unsafe {
        let device = Device::of(buffer);
        let mut bound = pipeline;
        if point == vk::PipelineBindPoint::GRAPHICS {
            let tracker = &mut *device.tracker();
            let of = tracker.pipelines.get(pipeline).cloned();
            let state = tracker.commands.get_mut(buffer.as_raw());
            let twin = of.as_ref().and_then(|of| of.recorded.as_ref());
            if let Some(twin) = twin
                && !twin.twice
                && super::draws::records(&device, state)
            {
                bound = twin.handle;
            }
            state.bind(pipeline, of);
        } else if point == vk::PipelineBindPoint::COMPUTE {
            let tracker = &mut *device.tracker();
            let of = tracker.pipelines.compute(pipeline);
            tracker.commands.get_mut(buffer.as_raw()).compute = of;
        }
        (device.next.cmd_bind_pipeline)(buffer, point, bound);
    }
}

/// Hooks of commands that set a state of the command buffer.
macro_rules! setters {
    ($($hook:ident ($($argument:ident: $kind:ty),*) |$state:ident| $change:expr;)*) => { before! { $(
        $hook(buffer: vk::CommandBuffer $(, $argument: $kind)*) |device| {
            let mut tracker = device.tracker();
            let $state = tracker.commands.get_mut(buffer.as_raw());
            $change;
        };
    )* } };
}

setters! {
    cmd_set_viewport(first: u32, count: u32, viewports: *const vk::Viewport) |state|
        if first == 0 { state.dynamic.viewport = slice(viewports, count).first().copied() };
    cmd_set_viewport_with_count(count: u32, viewports: *const vk::Viewport) |state|
        state.dynamic.viewport = slice(viewports, count).first().copied();
    cmd_set_scissor(first: u32, count: u32, scissors: *const vk::Rect2D) |state|
        if first == 0 { state.dynamic.scissor = slice(scissors, count).first().copied() };
    cmd_set_scissor_with_count(count: u32, scissors: *const vk::Rect2D) |state|
        state.dynamic.scissor = slice(scissors, count).first().copied();
    cmd_set_topology(topology: vk::PrimitiveTopology) |state|
        state.dynamic.topology = Some(topology);
    cmd_set_depth_test(enable: vk::Bool32) |state|
        state.dynamic.depth_test = Some(enable != 0);
    cmd_set_depth_write(enable: vk::Bool32) |state|
        state.dynamic.depth_write = Some(enable != 0);
    cmd_set_depth_compare(compare: vk::CompareOp) |state|
        state.dynamic.depth_compare = Some(compare);
    cmd_set_stencil_test(enable: vk::Bool32) |state|
        state.dynamic.stencil_test = Some(enable != 0);
    cmd_set_stencil_op(faces: vk::StencilFaceFlags, fail: vk::StencilOp, pass: vk::StencilOp, depth_fail: vk::StencilOp, compare: vk::CompareOp) |state| {
        state.dynamic.stencil_ops.retain(|op| op.0 != faces);
        state.dynamic.stencil_ops.push((faces, fail, pass, depth_fail, compare));
    };
    cmd_set_stencil_write_mask(faces: vk::StencilFaceFlags, mask: u32) |state| {
        state.dynamic.stencil_write_masks.retain(|of| of.0 != faces);
        state.dynamic.stencil_write_masks.push((faces, mask));
    };
    cmd_set_color_write_mask(first: u32, count: u32, masks: *const vk::ColorComponentFlags) |state|
        state.dynamic.color_masks = Some((first, slice(masks, count).to_vec()));
    cmd_set_color_write_enable(count: u32, enables: *const vk::Bool32) |state|
        state.dynamic.color_enables = Some(slice(enables, count).to_vec());
    cmd_set_event(event: vk::Event, stages: vk::PipelineStageFlags) |state|
        state.effects.set_event(event);
    cmd_set_event2(event: vk::Event, info: *const vk::DependencyInfo<'_>) |state|
        state.effects.set_event(event);
    cmd_wait_events(count: u32, events: *const vk::Event, from: vk::PipelineStageFlags, to: vk::PipelineStageFlags, memory_count: u32, memory: *const vk::MemoryBarrier<'_>, buffer_count: u32, buffers: *const vk::BufferMemoryBarrier<'_>, image_count: u32, images: *const vk::ImageMemoryBarrier<'_>) |state|
        state.effects.await_events(slice(events, count));
    cmd_wait_events2(count: u32, events: *const vk::Event, infos: *const vk::DependencyInfo<'_>) |state|
        state.effects.await_events(slice(events, count));
    cmd_begin_query(pool: vk::QueryPool, query: u32, flags: vk::QueryControlFlags) |state|
        state.active_queries += 1;
    cmd_end_query(pool: vk::QueryPool, query: u32) |state|
        state.active_queries = state.active_queries.saturating_sub(1);
    cmd_begin_query_indexed(pool: vk::QueryPool, query: u32, flags: vk::QueryControlFlags, index: u32) |state|
        state.active_queries += 1;
    cmd_end_query_indexed(pool: vk::QueryPool, query: u32, index: u32) |state|
        state.active_queries = state.active_queries.saturating_sub(1);
    cmd_begin_transform_feedback(first: u32, count: u32, buffers: *const vk::Buffer, offsets: *const vk::DeviceSize) |state|
        state.active_queries += 1;
    cmd_end_transform_feedback(first: u32, count: u32, buffers: *const vk::Buffer, offsets: *const vk::DeviceSize) |state|
        state.active_queries = state.active_queries.saturating_sub(1);
}

before! {
    cmd_copy_image(buffer: vk::CommandBuffer, from: vk::Image, from_layout: vk::ImageLayout, to: vk::Image, to_layout: vk::ImageLayout, count: u32, regions: *const vk::ImageCopy) |device|
        device.tracker().note_copy(buffer, from, to, slice(regions, count).iter().map(|region| [region.src_subresource, region.dst_subresource]));
    cmd_copy_image2(buffer: vk::CommandBuffer, info: *const vk::CopyImageInfo2<'_>) |device|
        device.tracker().note_copy(buffer, (*info).src_image, (*info).dst_image, slice((*info).p_regions, (*info).region_count).iter().map(|region| [region.src_subresource, region.dst_subresource]));
    cmd_blit_image(buffer: vk::CommandBuffer, from: vk::Image, from_layout: vk::ImageLayout, to: vk::Image, to_layout: vk::ImageLayout, count: u32, regions: *const vk::ImageBlit, filter: vk::Filter) |device|
        device.tracker().note_copy(buffer, from, to, slice(regions, count).iter().map(|region| [region.src_subresource, region.dst_subresource]));
    cmd_blit_image2(buffer: vk::CommandBuffer, info: *const vk::BlitImageInfo2<'_>) |device|
        device.tracker().note_copy(buffer, (*info).src_image, (*info).dst_image, slice((*info).p_regions, (*info).region_count).iter().map(|region| [region.src_subresource, region.dst_subresource]));
    cmd_resolve_image(buffer: vk::CommandBuffer, from: vk::Image, from_layout: vk::ImageLayout, to: vk::Image, to_layout: vk::ImageLayout, count: u32, regions: *const vk::ImageResolve) |device|
        device.tracker().note_copy(buffer, from, to, slice(regions, count).iter().map(|region| [region.src_subresource, region.dst_subresource]));
    cmd_resolve_image2(buffer: vk::CommandBuffer, info: *const vk::ResolveImageInfo2<'_>) |device|
        device.tracker().note_copy(buffer, (*info).src_image, (*info).dst_image, slice((*info).p_regions, (*info).region_count).iter().map(|region| [region.src_subresource, region.dst_subresource]));
    cmd_copy_image_to_buffer(buffer: vk::CommandBuffer, image: vk::Image, layout: vk::ImageLayout, to: vk::Buffer, count: u32, regions: *const vk::BufferImageCopy) |device|
        device.tracker().note_read_back(buffer, image, slice(regions, count).iter().map(|region| region.image_extent));
    cmd_copy_image_to_buffer2(buffer: vk::CommandBuffer, info: *const vk::CopyImageToBufferInfo2<'_>) |device|
        device.tracker().note_read_back(buffer, (*info).src_image, slice((*info).p_regions, (*info).region_count).iter().map(|region| region.image_extent));
}
