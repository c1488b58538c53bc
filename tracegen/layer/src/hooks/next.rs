//! Functions of the next layer or the driver.

use ash::vk;
use std::ffi::CStr;

/// Placeholder for a function that the next layer or driver does not have. It is never called, because such a
/// function has no hook.
unsafe extern "system" fn missing() {
    eprintln!("parallax: a Vulkan function is missing");
    std::process::abort();
}

/// Names of a function, each with a zero at its end: that in the name of its type, and those with the suffixes of
/// extensions.
macro_rules! names {
    ($kind:ident [$($suffix:literal)*]) => {
        [concat!(stringify!($kind), "\0") $(, concat!(stringify!($kind), $suffix, "\0"))*]
            .map(|name| &name.as_bytes()["PFN_".len()..])
    };
}

/// Lists functions: the field, the type, suffixes of other names, and the module with the hook of the same name as
/// the field.
macro_rules! functions {
    ($($field:ident: $kind:ident $suffixes:tt $(in $hooks:ident)?;)*) => {
        /// The functions that hooks call.
        #[derive(Clone)]
        pub(super) struct Next { $(pub $field: vk::$kind),* }

        impl Next {
            /// Looks up the functions, each by the first of its names that exists.
            ///
            /// # Safety
            /// `get` returns the function of a name.
            pub unsafe fn load(get: impl Fn(&CStr) -> vk::PFN_vkVoidFunction) -> Self {
                $(let $field = {
                    let mut names = names!($kind $suffixes).into_iter();
                    let found = names.find_map(|name| get(CStr::from_bytes_with_nul(name).ok()?));
                    // SAFETY: the name determines the function's type.
                    unsafe {
                        std::mem::transmute::<unsafe extern "system" fn(), vk::$kind>(
                            found.unwrap_or(missing),
                        )
                    }
                };)*
                Self { $($field),* }
            }
        }

        /// The hook of a function of a device.
        pub(super) fn hook(function: &CStr) -> Option<*const ()> {
            let function = function.to_bytes_with_nul();
            $($(
                if names!($kind $suffixes).contains(&function) {
                    return Some(super::$hooks::$field as *const ());
                }
            )?)*
            None
        }
    };
}

functions! {
    destroy_device: PFN_vkDestroyDevice [] in device;
    create_image: PFN_vkCreateImage [] in resources;
    destroy_image: PFN_vkDestroyImage [] in resources;
    create_image_view: PFN_vkCreateImageView [] in resources;
    destroy_image_view: PFN_vkDestroyImageView [] in resources;
    create_sampler: PFN_vkCreateSampler [] in resources;
    destroy_sampler: PFN_vkDestroySampler [] in resources;
    create_swapchain: PFN_vkCreateSwapchainKHR [] in resources;
    get_swapchain_images: PFN_vkGetSwapchainImagesKHR [] in resources;
    create_set_layout: PFN_vkCreateDescriptorSetLayout [] in sets;
    destroy_set_layout: PFN_vkDestroyDescriptorSetLayout [] in sets;
    allocate_sets: PFN_vkAllocateDescriptorSets [] in sets;
    free_sets: PFN_vkFreeDescriptorSets [] in sets;
    reset_pool: PFN_vkResetDescriptorPool [] in sets;
    destroy_pool: PFN_vkDestroyDescriptorPool [] in sets;
    update_sets: PFN_vkUpdateDescriptorSets [] in sets;
    create_template: PFN_vkCreateDescriptorUpdateTemplate ["KHR"] in sets;
    destroy_template: PFN_vkDestroyDescriptorUpdateTemplate ["KHR"] in sets;
    update_with_template: PFN_vkUpdateDescriptorSetWithTemplate ["KHR"] in sets;
    create_shader_module: PFN_vkCreateShaderModule [] in pipelines;
    destroy_shader_module: PFN_vkDestroyShaderModule [] in pipelines;
    create_pipeline_layout: PFN_vkCreatePipelineLayout [] in pipelines;
    destroy_pipeline_layout: PFN_vkDestroyPipelineLayout [] in pipelines;
    create_graphics_pipelines: PFN_vkCreateGraphicsPipelines [] in pipelines;
    create_compute_pipelines: PFN_vkCreateComputePipelines [] in stage_reads;
    destroy_pipeline: PFN_vkDestroyPipeline [] in pipelines;
    create_render_pass: PFN_vkCreateRenderPass [] in passes;
    create_render_pass2: PFN_vkCreateRenderPass2 ["KHR"] in passes;
    destroy_render_pass: PFN_vkDestroyRenderPass [] in passes;
    create_framebuffer: PFN_vkCreateFramebuffer [] in passes;
    destroy_framebuffer: PFN_vkDestroyFramebuffer [] in passes;
    begin_command_buffer: PFN_vkBeginCommandBuffer [] in commands;
    free_command_buffers: PFN_vkFreeCommandBuffers [] in commands;
    cmd_bind_pipeline: PFN_vkCmdBindPipeline [] in commands;
    cmd_bind_sets: PFN_vkCmdBindDescriptorSets [] in sets;
    cmd_push_set: PFN_vkCmdPushDescriptorSetKHR [] in sets;
    cmd_push_set_with_template: PFN_vkCmdPushDescriptorSetWithTemplateKHR [] in sets;
    cmd_begin_render_pass: PFN_vkCmdBeginRenderPass [] in passes;
    cmd_begin_render_pass2: PFN_vkCmdBeginRenderPass2 ["KHR"] in passes;
    cmd_next_subpass: PFN_vkCmdNextSubpass [] in passes;
    cmd_next_subpass2: PFN_vkCmdNextSubpass2 ["KHR"] in passes;
    cmd_end_render_pass: PFN_vkCmdEndRenderPass [] in passes;
    cmd_end_render_pass2: PFN_vkCmdEndRenderPass2 ["KHR"] in passes;
    cmd_begin_rendering: PFN_vkCmdBeginRendering ["KHR"] in passes;
    cmd_end_rendering: PFN_vkCmdEndRendering ["KHR"] in passes;
    cmd_execute_commands: PFN_vkCmdExecuteCommands [] in commands;
    cmd_set_viewport: PFN_vkCmdSetViewport [] in commands;
    cmd_set_viewport_with_count: PFN_vkCmdSetViewportWithCount ["EXT"] in commands;
    cmd_set_scissor: PFN_vkCmdSetScissor [] in commands;
    cmd_set_scissor_with_count: PFN_vkCmdSetScissorWithCount ["EXT"] in commands;
    cmd_set_topology: PFN_vkCmdSetPrimitiveTopology ["EXT"] in commands;
    cmd_set_depth_test: PFN_vkCmdSetDepthTestEnable ["EXT"] in commands;
    cmd_set_depth_write: PFN_vkCmdSetDepthWriteEnable ["EXT"] in commands;
    cmd_set_depth_compare: PFN_vkCmdSetDepthCompareOp ["EXT"] in commands;
    cmd_set_stencil_test: PFN_vkCmdSetStencilTestEnable ["EXT"] in commands;
    cmd_set_stencil_op: PFN_vkCmdSetStencilOp ["EXT"] in commands;
    cmd_set_stencil_write_mask: PFN_vkCmdSetStencilWriteMask [] in commands;
    cmd_set_color_write_mask: PFN_vkCmdSetColorWriteMaskEXT [] in commands;
    cmd_set_color_write_enable: PFN_vkCmdSetColorWriteEnableEXT [] in commands;
    cmd_begin_query: PFN_vkCmdBeginQuery [] in commands;
    cmd_end_query: PFN_vkCmdEndQuery [] in commands;
    cmd_begin_query_indexed: PFN_vkCmdBeginQueryIndexedEXT [] in commands;
    cmd_end_query_indexed: PFN_vkCmdEndQueryIndexedEXT [] in commands;
    cmd_begin_transform_feedback: PFN_vkCmdBeginTransformFeedbackEXT [] in commands;
    cmd_end_transform_feedback: PFN_vkCmdEndTransformFeedbackEXT [] in commands;
    cmd_draw: PFN_vkCmdDraw [] in draws;
    cmd_draw_indexed: PFN_vkCmdDrawIndexed [] in draws;
    cmd_draw_indirect: PFN_vkCmdDrawIndirect [] in draws;
    cmd_draw_indexed_indirect: PFN_vkCmdDrawIndexedIndirect [] in draws;
    cmd_draw_indirect_count: PFN_vkCmdDrawIndirectCount ["KHR" "AMD"] in draws;
    cmd_draw_indexed_indirect_count: PFN_vkCmdDrawIndexedIndirectCount ["KHR" "AMD"] in draws;
    cmd_draw_multi: PFN_vkCmdDrawMultiEXT [] in draws;
    cmd_draw_multi_indexed: PFN_vkCmdDrawMultiIndexedEXT [] in draws;
    cmd_draw_indirect_byte_count: PFN_vkCmdDrawIndirectByteCountEXT [] in draws;
    cmd_dispatch: PFN_vkCmdDispatch [] in stage_reads;
    cmd_dispatch_base: PFN_vkCmdDispatchBase ["KHR"] in stage_reads;
    cmd_dispatch_indirect: PFN_vkCmdDispatchIndirect [] in stage_reads;
    cmd_copy_image_to_buffer: PFN_vkCmdCopyImageToBuffer [] in commands;
    cmd_copy_image_to_buffer2: PFN_vkCmdCopyImageToBuffer2 ["KHR"] in commands;
    cmd_copy_image: PFN_vkCmdCopyImage [] in commands;
    cmd_copy_image2: PFN_vkCmdCopyImage2 ["KHR"] in commands;
    cmd_blit_image2: PFN_vkCmdBlitImage2 ["KHR"] in commands;
    cmd_resolve_image: PFN_vkCmdResolveImage [] in commands;
    cmd_resolve_image2: PFN_vkCmdResolveImage2 ["KHR"] in commands;
    cmd_set_event: PFN_vkCmdSetEvent [] in commands;
    cmd_set_event2: PFN_vkCmdSetEvent2 ["KHR"] in commands;
    cmd_wait_events: PFN_vkCmdWaitEvents [] in commands;
    cmd_wait_events2: PFN_vkCmdWaitEvents2 ["KHR"] in commands;
    cmd_blit_image: PFN_vkCmdBlitImage [] in commands;
    queue_submit: PFN_vkQueueSubmit [] in submit;
    queue_submit2: PFN_vkQueueSubmit2 ["KHR"] in submit;
    queue_wait_idle: PFN_vkQueueWaitIdle [] in waits;
    queue_present: PFN_vkQueuePresentKHR [] in submit;
    wait_for_fences: PFN_vkWaitForFences [] in waits;
    get_fence_status: PFN_vkGetFenceStatus [] in waits;
    create_semaphore: PFN_vkCreateSemaphore [] in waits;
    destroy_semaphore: PFN_vkDestroySemaphore [] in waits;
    wait_semaphores: PFN_vkWaitSemaphores ["KHR"] in waits;
    get_semaphore_counter_value: PFN_vkGetSemaphoreCounterValue ["KHR"] in waits;
    device_wait_idle: PFN_vkDeviceWaitIdle [] in waits;
    copy_image_to_memory: PFN_vkCopyImageToMemoryEXT [] in waits;

    // Without a hook.
    cmd_push_constants: PFN_vkCmdPushConstants [];
    cmd_pipeline_barrier: PFN_vkCmdPipelineBarrier [];
    create_buffer: PFN_vkCreateBuffer [];
    destroy_buffer: PFN_vkDestroyBuffer [];
    allocate_memory: PFN_vkAllocateMemory [];
    free_memory: PFN_vkFreeMemory [];
    map_memory: PFN_vkMapMemory [];
    bind_image_memory: PFN_vkBindImageMemory [];
    bind_buffer_memory: PFN_vkBindBufferMemory [];
    image_requirements: PFN_vkGetImageMemoryRequirements [];
    buffer_requirements: PFN_vkGetBufferMemoryRequirements [];
    create_fence: PFN_vkCreateFence [];
    destroy_fence: PFN_vkDestroyFence [];
    get_event_status: PFN_vkGetEventStatus [];
    create_query_pool: PFN_vkCreateQueryPool [];
    destroy_query_pool: PFN_vkDestroyQueryPool [];
    reset_query_pool: PFN_vkResetQueryPool ["EXT"];
    get_query_results: PFN_vkGetQueryPoolResults [];
}
