//! The functions that a program calls instead of the driver's.
//!
//! Each hook calls the function of the same name in the next layer or the driver, and reports the call to the
//! tracker.

mod api;
mod commands;
mod device;
mod draws;
mod instance;
mod libraries;
mod next;
mod passes;
mod pending;
mod pictures;
mod pipeline_state;
mod pipelines;
mod queries;
mod recording_pipelines;
mod recording_shaders;
mod resources;
mod sets;
mod stage_reads;
mod submit;
mod waits;

use crate::capture::capture;
use api::NegotiateLayerInterface;
use ash::vk::{self, Handle};
use std::ffi::{CStr, c_char};

/// Pointer that the loader stores in the object of a dispatchable handle.
///
/// # Safety
/// A valid dispatchable handle.
unsafe fn dispatch_key<H: Handle>(handle: H) -> usize {
    // SAFETY: such a handle points to an object that starts with the loader's pointer.
    unsafe { *(handle.as_raw() as *const usize) }
}

/// Version of the interface between loader and layers that this layer supports.
const INTERFACE_VERSION: u32 = 2;

/// Called by the loader to get the layer's entry points.
///
/// # Safety
/// The loader makes the call.
#[unsafe(no_mangle)]
pub unsafe extern "system" fn vkNegotiateLoaderLayerInterfaceVersion(
    negotiate: *mut NegotiateLayerInterface,
) -> vk::Result {
    // SAFETY: as the caller promises.
    let Some(negotiate) = (unsafe { negotiate.as_mut() }) else {
        return vk::Result::ERROR_INITIALIZATION_FAILED;
    };
    if negotiate.version < INTERFACE_VERSION {
        return vk::Result::ERROR_INITIALIZATION_FAILED;
    }
    negotiate.version = INTERFACE_VERSION;
    negotiate.get_instance_proc_addr = Some(get_instance_proc_addr);
    negotiate.get_device_proc_addr = Some(get_device_proc_addr);
    negotiate.get_physical_device_proc_addr = None;
    vk::Result::SUCCESS
}

macro_rules! hooks {
    ($name:ident: $($function:literal => $hook:path;)*) => {
        fn $name(function: &CStr) -> vk::PFN_vkVoidFunction {
            let hook: *const () = match function.to_bytes() {
                $($function => $hook as *const (),)*
                _ => return None,
            };
            // SAFETY: the caller casts the function to the type of its name.
            Some(unsafe { std::mem::transmute::<*const (), unsafe extern "system" fn()>(hook) })
        }
    };
}

hooks! { instance_hook:
    b"vkGetInstanceProcAddr" => get_instance_proc_addr;
    b"vkGetDeviceProcAddr" => get_device_proc_addr;
    b"vkCreateInstance" => instance::create_instance;
    b"vkDestroyInstance" => instance::destroy_instance;
    b"vkCreateDevice" => device::create_device;
}

// Properties of devices are changed only during a capture.
hooks! { physical_device_hook:
    b"vkEnumerateDeviceExtensionProperties" => instance::enumerate_device_extension_properties;
    b"vkGetPhysicalDeviceProperties" => instance::get_physical_device_properties;
    b"vkGetPhysicalDeviceProperties2" => instance::get_physical_device_properties2;
    b"vkGetPhysicalDeviceProperties2KHR" => instance::get_physical_device_properties2;
}

hooks! { device_hook:
    b"vkGetDeviceProcAddr" => get_device_proc_addr;
    b"vkDestroyDevice" => device::destroy_device;
    b"vkCreateImage" => resources::create_image;
    b"vkDestroyImage" => resources::destroy_image;
    b"vkCreateImageView" => resources::create_image_view;
    b"vkDestroyImageView" => resources::destroy_image_view;
    b"vkCreateSampler" => resources::create_sampler;
    b"vkDestroySampler" => resources::destroy_sampler;
    b"vkCreateSwapchainKHR" => resources::create_swapchain;
    b"vkGetSwapchainImagesKHR" => resources::get_swapchain_images;
    b"vkCreateDescriptorSetLayout" => sets::create_set_layout;
    b"vkDestroyDescriptorSetLayout" => sets::destroy_set_layout;
    b"vkAllocateDescriptorSets" => sets::allocate_sets;
    b"vkFreeDescriptorSets" => sets::free_sets;
    b"vkResetDescriptorPool" => sets::reset_pool;
    b"vkDestroyDescriptorPool" => sets::destroy_pool;
    b"vkUpdateDescriptorSets" => sets::update_sets;
    b"vkCreateDescriptorUpdateTemplate" => sets::create_template;
    b"vkCreateDescriptorUpdateTemplateKHR" => sets::create_template;
    b"vkDestroyDescriptorUpdateTemplate" => sets::destroy_template;
    b"vkDestroyDescriptorUpdateTemplateKHR" => sets::destroy_template;
    b"vkUpdateDescriptorSetWithTemplate" => sets::update_with_template;
    b"vkUpdateDescriptorSetWithTemplateKHR" => sets::update_with_template;
    b"vkCreateShaderModule" => pipelines::create_shader_module;
    b"vkDestroyShaderModule" => pipelines::destroy_shader_module;
    b"vkCreatePipelineLayout" => pipelines::create_pipeline_layout;
    b"vkDestroyPipelineLayout" => pipelines::destroy_pipeline_layout;
    b"vkCreateGraphicsPipelines" => pipelines::create_graphics_pipelines;
    b"vkCreateComputePipelines" => stage_reads::create_compute_pipelines;
    b"vkDestroyPipeline" => pipelines::destroy_pipeline;
    b"vkCreateRenderPass" => passes::create_render_pass;
    b"vkCreateRenderPass2" => passes::create_render_pass2;
    b"vkCreateRenderPass2KHR" => passes::create_render_pass2;
    b"vkDestroyRenderPass" => passes::destroy_render_pass;
    b"vkCreateFramebuffer" => passes::create_framebuffer;
    b"vkDestroyFramebuffer" => passes::destroy_framebuffer;
    b"vkBeginCommandBuffer" => commands::begin_command_buffer;
    b"vkFreeCommandBuffers" => commands::free_command_buffers;
    b"vkCmdBindPipeline" => commands::cmd_bind_pipeline;
    b"vkCmdBindDescriptorSets" => sets::cmd_bind_sets;
    b"vkCmdPushDescriptorSetKHR" => sets::cmd_push_set;
    b"vkCmdPushDescriptorSetWithTemplateKHR" => sets::cmd_push_set_with_template;
    b"vkCmdBeginRenderPass" => passes::cmd_begin_render_pass;
    b"vkCmdBeginRenderPass2" => passes::cmd_begin_render_pass2;
    b"vkCmdBeginRenderPass2KHR" => passes::cmd_begin_render_pass2;
    b"vkCmdNextSubpass" => passes::cmd_next_subpass;
    b"vkCmdNextSubpass2" => passes::cmd_next_subpass2;
    b"vkCmdNextSubpass2KHR" => passes::cmd_next_subpass2;
    b"vkCmdEndRenderPass" => passes::cmd_end_render_pass;
    b"vkCmdEndRenderPass2" => passes::cmd_end_render_pass2;
    b"vkCmdEndRenderPass2KHR" => passes::cmd_end_render_pass2;
    b"vkCmdBeginRendering" => passes::cmd_begin_rendering;
    b"vkCmdBeginRenderingKHR" => passes::cmd_begin_rendering;
    b"vkCmdEndRendering" => passes::cmd_end_rendering;
    b"vkCmdEndRenderingKHR" => passes::cmd_end_rendering;
    b"vkCmdExecuteCommands" => commands::cmd_execute_commands;
    b"vkCmdSetViewport" => commands::cmd_set_viewport;
    b"vkCmdSetViewportWithCount" => commands::cmd_set_viewport_with_count;
    b"vkCmdSetViewportWithCountEXT" => commands::cmd_set_viewport_with_count;
    b"vkCmdSetScissor" => commands::cmd_set_scissor;
    b"vkCmdSetScissorWithCount" => commands::cmd_set_scissor_with_count;
    b"vkCmdSetScissorWithCountEXT" => commands::cmd_set_scissor_with_count;
    b"vkCmdSetPrimitiveTopology" => commands::cmd_set_topology;
    b"vkCmdSetPrimitiveTopologyEXT" => commands::cmd_set_topology;
    b"vkCmdSetDepthTestEnable" => commands::cmd_set_depth_test;
    b"vkCmdSetDepthTestEnableEXT" => commands::cmd_set_depth_test;
    b"vkCmdSetDepthWriteEnable" => commands::cmd_set_depth_write;
    b"vkCmdSetDepthWriteEnableEXT" => commands::cmd_set_depth_write;
    b"vkCmdSetDepthCompareOp" => commands::cmd_set_depth_compare;
    b"vkCmdSetDepthCompareOpEXT" => commands::cmd_set_depth_compare;
    b"vkCmdSetStencilTestEnable" => commands::cmd_set_stencil_test;
    b"vkCmdSetStencilTestEnableEXT" => commands::cmd_set_stencil_test;
    b"vkCmdSetStencilOp" => commands::cmd_set_stencil_op;
    b"vkCmdSetStencilOpEXT" => commands::cmd_set_stencil_op;
    b"vkCmdSetStencilWriteMask" => commands::cmd_set_stencil_write_mask;
    b"vkCmdSetColorWriteMaskEXT" => commands::cmd_set_color_write_mask;
    b"vkCmdSetColorWriteEnableEXT" => commands::cmd_set_color_write_enable;
    b"vkCmdCopyImage" => commands::cmd_copy_image;
    b"vkCmdCopyImage2" => commands::cmd_copy_image2;
    b"vkCmdCopyImage2KHR" => commands::cmd_copy_image2;
    b"vkCmdBlitImage" => commands::cmd_blit_image;
    b"vkCmdBlitImage2" => commands::cmd_blit_image2;
    b"vkCmdBlitImage2KHR" => commands::cmd_blit_image2;
    b"vkCmdResolveImage" => commands::cmd_resolve_image;
    b"vkCmdResolveImage2" => commands::cmd_resolve_image2;
    b"vkCmdResolveImage2KHR" => commands::cmd_resolve_image2;
    b"vkCmdCopyImageToBuffer" => commands::cmd_copy_image_to_buffer;
    b"vkCmdCopyImageToBuffer2" => commands::cmd_copy_image_to_buffer2;
    b"vkCmdCopyImageToBuffer2KHR" => commands::cmd_copy_image_to_buffer2;
    b"vkCmdSetEvent" => commands::cmd_set_event;
    b"vkCmdSetEvent2" => commands::cmd_set_event2;
    b"vkCmdSetEvent2KHR" => commands::cmd_set_event2;
    b"vkCmdWaitEvents" => commands::cmd_wait_events;
    b"vkCmdWaitEvents2" => commands::cmd_wait_events2;
    b"vkCmdWaitEvents2KHR" => commands::cmd_wait_events2;
    b"vkCmdBeginQuery" => commands::cmd_begin_query;
    b"vkCmdEndQuery" => commands::cmd_end_query;
    b"vkCmdBeginQueryIndexedEXT" => commands::cmd_begin_query_indexed;
    b"vkCmdEndQueryIndexedEXT" => commands::cmd_end_query_indexed;
    b"vkCmdBeginTransformFeedbackEXT" => commands::cmd_begin_transform_feedback;
    b"vkCmdEndTransformFeedbackEXT" => commands::cmd_end_transform_feedback;
    b"vkCmdDraw" => draws::cmd_draw;
    b"vkCmdDrawIndexed" => draws::cmd_draw_indexed;
    b"vkCmdDrawIndirect" => draws::cmd_draw_indirect;
    b"vkCmdDrawIndexedIndirect" => draws::cmd_draw_indexed_indirect;
    b"vkCmdDrawIndirectCount" => draws::cmd_draw_indirect_count;
    b"vkCmdDrawIndirectCountKHR" => draws::cmd_draw_indirect_count;
    b"vkCmdDrawIndirectCountAMD" => draws::cmd_draw_indirect_count;
    b"vkCmdDrawIndexedIndirectCount" => draws::cmd_draw_indexed_indirect_count;
    b"vkCmdDrawIndexedIndirectCountKHR" => draws::cmd_draw_indexed_indirect_count;
    b"vkCmdDrawIndexedIndirectCountAMD" => draws::cmd_draw_indexed_indirect_count;
    b"vkCmdDrawMultiEXT" => draws::cmd_draw_multi;
    b"vkCmdDrawMultiIndexedEXT" => draws::cmd_draw_multi_indexed;
    b"vkCmdDrawIndirectByteCountEXT" => draws::cmd_draw_indirect_byte_count;
    b"vkCmdDispatch" => stage_reads::cmd_dispatch;
    b"vkCmdDispatchBase" => stage_reads::cmd_dispatch_base;
    b"vkCmdDispatchBaseKHR" => stage_reads::cmd_dispatch_base;
    b"vkCmdDispatchIndirect" => stage_reads::cmd_dispatch_indirect;
    b"vkQueueSubmit" => submit::queue_submit;
    b"vkQueueSubmit2" => submit::queue_submit2;
    b"vkQueueSubmit2KHR" => submit::queue_submit2;
    b"vkCreateSemaphore" => waits::create_semaphore;
    b"vkDestroySemaphore" => waits::destroy_semaphore;
    b"vkWaitForFences" => waits::wait_for_fences;
    b"vkGetFenceStatus" => waits::get_fence_status;
    b"vkWaitSemaphores" => waits::wait_semaphores;
    b"vkWaitSemaphoresKHR" => waits::wait_semaphores;
    b"vkGetSemaphoreCounterValue" => waits::get_semaphore_counter_value;
    b"vkGetSemaphoreCounterValueKHR" => waits::get_semaphore_counter_value;
    b"vkQueueWaitIdle" => waits::queue_wait_idle;
    b"vkDeviceWaitIdle" => waits::device_wait_idle;
    b"vkCopyImageToMemoryEXT" => waits::copy_image_to_memory;
    b"vkQueuePresentKHR" => submit::queue_present;
}

unsafe extern "system" fn get_instance_proc_addr(
    instance: vk::Instance,
    name: *const c_char,
) -> vk::PFN_vkVoidFunction {
    // SAFETY: a valid call of vkGetInstanceProcAddr.
    unsafe {
        let function = CStr::from_ptr(name);
        if let Some(hook) = instance_hook(function) {
            return Some(hook);
        }
        if instance == vk::Instance::null() {
            return None;
        }
        let known = instance::Instance::of(instance)?;
        let next = (known.get_instance_proc_addr)(instance, name);
        if capture().is_none() {
            return next;
        }
        // A function that the next layer does not have has no hook.
        let hook = physical_device_hook(function).or_else(|| device_hook(function));
        next.and(hook).or(next)
    }
}

unsafe extern "system" fn get_device_proc_addr(
    handle: vk::Device,
    name: *const c_char,
) -> vk::PFN_vkVoidFunction {
    // SAFETY: a valid call of vkGetDeviceProcAddr.
    unsafe {
        if let Some(known) = device::Device::find(handle) {
            let next = (known.get_device_proc_addr)(handle, name);
            return next.and(device_hook(CStr::from_ptr(name))).or(next);
        }
        device::other(handle)?(handle, name)
    }
}
