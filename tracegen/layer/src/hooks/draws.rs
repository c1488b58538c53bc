//! Hooks of draws. Each draw gets a number and is recorded if requested.

use super::api::slice;
use super::device::Device;
use crate::track::{Call, CommandState, Dynamic, Pipeline};
use ash::vk::{self, Handle};
use spool::INDIRECT;
use std::sync::Arc;

/// Whether draws of a command buffer may belong to a requested frame. A command buffer that may be submitted
/// several times can be executed in any later frame.
pub(super) fn is_wanted(device: &Device, state: &mut CommandState) -> bool {
    let capture = device.capture;
    let one_time = state.one_time();
    *(state.wanted)
        .get_or_insert_with(|| !capture.is_over() && (!one_time || capture.may_want_commands()))
}

/// Whether draws of a command buffer are recorded.
pub(super) fn records(device: &Device, state: &mut CommandState) -> bool {
    device.recorder.is_some() && is_wanted(device, state)
}

/// How a draw is recorded and counted.
struct Plan {
    number: u32,
    /// Pipeline that the program has bound, and its handle.
    pipeline: Arc<Pipeline>,
    handle: vk::Pipeline,
    dynamic: Dynamic,
    /// Whether an additional draw before the program's records it.
    twice: bool,
    /// Whether the program's own draw records it.
    once: bool,
    /// Whether a query counts its samples.
    counted: bool,
}

/// Tracks the draw; `None` if it is not recorded or listed.
fn plan(device: &Device, buffer: vk::CommandBuffer, call: &Call) -> Option<Plan> {
    if device.capture.is_over() {
        return None;
    }
    let tracker = &mut *device.tracker();
    let state = tracker.commands.get_mut(buffer.as_raw());
    if !is_wanted(device, state) {
        return None;
    }
    let pipeline = Arc::clone(state.pipeline()?);
    let handle = state.pipeline_handle();
    let dynamic = state.dynamic.clone();
    // The program's own query would also count the additional draw.
    let counts_itself = state.active_queries > 0;
    let mut info = tracker.draw(buffer.as_raw(), call)?;
    let twin = pipeline.recorded.as_ref();
    let twice = twin.is_some_and(|twin| twin.twice);
    if twice && counts_itself {
        info.shader = None;
        info.twice = false;
        info.vertex_shader = None;
        info.vertex_textures.clear();
        info.reads = pipeline.unrecorded_reads(false);
        info.unrecorded = Some("a query of the program counts the draw".to_owned());
    }
    let plan = Plan {
        number: info.draw,
        handle,
        dynamic,
        twice: twice && !counts_itself,
        once: twin.is_some() && !twice,
        counted: device.queries.is_some() && !counts_itself,
        pipeline,
    };
    tracker.commands.add(buffer.as_raw(), info);
    Some(plan)
}

/// Submits a draw, with an additional one if needed.
///
/// # Safety
/// The command buffer is being recorded, and `draw` records the draw into it.
unsafe fn submit_draw(buffer: vk::CommandBuffer, call: &Call, draw: impl Fn(&Device)) {
    // SAFETY: as the caller promises.
    let device = &*unsafe { Device::of(buffer) };
    let Some(plan) = plan(device, buffer, call) else {
        draw(device);
        return;
    };
    let next = &device.next;
    // SAFETY: the program's draw is valid at this point. The recording pipeline differs only in its fragment
    // shader and its writes. Afterwards the program's pipeline is bound again, with the dynamic states that
    // the recording pipeline fixed.
    unsafe {
        let begin = || {
            if let Some(queries) = device.queries.as_ref().filter(|_| plan.counted) {
                queries.begin(buffer, plan.number, next);
            }
        };
        let end = || {
            if let Some(queries) = device.queries.as_ref().filter(|_| plan.counted) {
                queries.end(buffer, plan.number, next);
            }
        };
        let graphics = vk::PipelineBindPoint::GRAPHICS;
        if plan.once || plan.twice {
            push_number(device, buffer, &plan);
        }
        let twin = plan.pipeline.recorded.as_ref();
        if let (true, Some(twin)) = (plan.twice, twin) {
            (next.cmd_bind_pipeline)(buffer, graphics, twin.handle);
            begin();
            draw(device);
            end();
            (next.cmd_bind_pipeline)(buffer, graphics, plan.handle);
            restore(device, buffer, &plan.dynamic, &twin.fixed);
            draw(device);
        } else {
            begin();
            draw(device);
            end();
        }
    }
}

/// Sets the push constant with the draw's number.
///
/// # Safety
/// The command buffer is being recorded.
unsafe fn push_number(device: &Device, buffer: vk::CommandBuffer, plan: &Plan) {
    let Some(recorder) = &device.recorder else {
        return;
    };
    // SAFETY: the layout has room for the number at this offset and lives as long as its pipelines.
    unsafe {
        (device.next.cmd_push_constants)(
            buffer,
            plan.pipeline.layout,
            plan.pipeline.stages,
            recorder.push_constant_bytes,
            size_of::<u32>() as u32,
            (&raw const plan.number).cast(),
        );
    }
}

/// Sets the dynamic states that the recording pipeline fixed.
///
/// # Safety
/// The command buffer is being recorded.
unsafe fn restore(
    device: &Device,
    buffer: vk::CommandBuffer,
    dynamic: &Dynamic,
    fixed: &[vk::DynamicState],
) {
    let next = &device.next;
    // SAFETY: the program has set these states with the same values.
    unsafe {
        for state in fixed {
            match *state {
                vk::DynamicState::DEPTH_WRITE_ENABLE => {
                    if let Some(enable) = dynamic.depth_write {
                        (next.cmd_set_depth_write)(buffer, enable.into());
                    }
                }
                vk::DynamicState::STENCIL_OP => {
                    for &(faces, fail, pass, depth_fail, compare) in &dynamic.stencil_ops {
                        let set = next.cmd_set_stencil_op;
                        set(buffer, faces, fail, pass, depth_fail, compare);
                    }
                }
                vk::DynamicState::STENCIL_WRITE_MASK => {
                    for &(faces, mask) in &dynamic.stencil_write_masks {
                        (next.cmd_set_stencil_write_mask)(buffer, faces, mask);
                    }
                }
                vk::DynamicState::COLOR_WRITE_MASK_EXT => {
                    if let Some((first, masks)) = &dynamic.color_masks {
                        let count = masks.len() as u32;
                        (next.cmd_set_color_write_mask)(buffer, *first, count, masks.as_ptr());
                    }
                }
                vk::DynamicState::COLOR_WRITE_ENABLE_EXT => {
                    if let Some(enables) = &dynamic.color_enables {
                        let count = enables.len() as u32;
                        (next.cmd_set_color_write_enable)(buffer, count, enables.as_ptr());
                    }
                }
                _ => {}
            }
        }
    }
}

fn direct(vertices: u32, instances: u32) -> Call {
    Call {
        vertices,
        instances,
        caveats: Vec::new(),
    }
}

fn indirect() -> Call {
    Call {
        vertices: 0,
        instances: 0,
        caveats: vec![INDIRECT.to_owned()],
    }
}

/// Hooks of draw commands.
macro_rules! draws {
    ($($hook:ident ($($argument:ident: $kind:ty),*) $call:expr;)*) => { $(
        pub(super) unsafe extern "system" fn $hook(buffer: vk::CommandBuffer, $($argument: $kind),*) {
            // SAFETY: a valid call of the draw command.
            unsafe {
                submit_draw(buffer, &$call, |device| (device.next.$hook)(buffer, $($argument),*));
            }
        }
    )* };
}

draws! {
    cmd_draw(vertices: u32, instances: u32, first_vertex: u32, first_instance: u32)
        direct(vertices, instances);
    cmd_draw_indexed(indices: u32, instances: u32, first_index: u32, offset: i32, first_instance: u32)
        direct(indices, instances);
    cmd_draw_indirect(from: vk::Buffer, at: vk::DeviceSize, count: u32, stride: u32) indirect();
    cmd_draw_indexed_indirect(from: vk::Buffer, at: vk::DeviceSize, count: u32, stride: u32) indirect();
    cmd_draw_indirect_count(from: vk::Buffer, at: vk::DeviceSize, counts: vk::Buffer, count_at: vk::DeviceSize, most: u32, stride: u32) indirect();
    cmd_draw_indexed_indirect_count(from: vk::Buffer, at: vk::DeviceSize, counts: vk::Buffer, count_at: vk::DeviceSize, most: u32, stride: u32) indirect();
    cmd_draw_indirect_byte_count(instances: u32, first_instance: u32, counts: vk::Buffer, count_at: vk::DeviceSize, counter_offset: u32, stride: u32) indirect();
}

/// Reads entry `number` of a list with a stride.
///
/// # Safety
/// The list has this entry.
unsafe fn entry<T: Copy>(first: *const T, number: u32, stride: u32) -> T {
    let at = number as usize * stride as usize;
    // SAFETY: as the caller promises; entries need not be aligned.
    unsafe { first.cast::<u8>().add(at).cast::<T>().read_unaligned() }
}

pub(super) unsafe extern "system" fn cmd_draw_multi(
    buffer: vk::CommandBuffer,
    count: u32,
    draws: *const vk::MultiDrawInfoEXT,
    instances: u32,
    first_instance: u32,
    stride: u32,
) {
    // SAFETY: a valid call of vkCmdDrawMultiEXT.
    unsafe {
        let multi = Device::of(buffer).next.cmd_draw_multi;
        // One draw per entry, so that each has a number. Shaders therefore see 0 as the number of the draw in
        // the command.
        for number in 0..count {
            let draw = entry(draws, number, stride);
            let call = direct(draw.vertex_count, instances);
            submit_draw(buffer, &call, |_| {
                multi(buffer, 1, &draw, instances, first_instance, stride);
            });
        }
    }
}

pub(super) unsafe extern "system" fn cmd_draw_multi_indexed(
    buffer: vk::CommandBuffer,
    count: u32,
    draws: *const vk::MultiDrawIndexedInfoEXT,
    instances: u32,
    first_instance: u32,
    stride: u32,
    offset: *const i32,
) {
    // SAFETY: a valid call of vkCmdDrawMultiIndexedEXT.
    unsafe {
        let multi = Device::of(buffer).next.cmd_draw_multi_indexed;
        for number in 0..count {
            let draw = entry(draws, number, stride);
            let call = direct(draw.index_count, instances);
            submit_draw(buffer, &call, |_| {
                multi(buffer, 1, &draw, instances, first_instance, stride, offset);
            });
        }
    }
}

/// The command buffers of submissions.
///
/// # Safety
/// Valid submissions.
pub(super) unsafe fn buffers_of(submits: &[vk::SubmitInfo<'_>]) -> Vec<vk::CommandBuffer> {
    let buffers = submits.iter().flat_map(|submit| {
        // SAFETY: as the caller promises.
        unsafe { slice(submit.p_command_buffers, submit.command_buffer_count) }
    });
    buffers.copied().collect()
}
