//! Functions of the next layer or the driver.

use ash::vk;
use std::ffi::CStr;

/// Placeholder for a function that the next layer or driver does not have. It is never called, because such a
/// function has no hook.
unsafe extern "system" fn missing() {
    eprintln!("parallax: a Vulkan function is missing");
    std::process::abort();
}

macro_rules! next_functions {
    ($($field:ident: $kind:ident [$($name:literal),+];)*) => {
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
                    let names: &[&CStr] = &[$($name),+];
                    let found = names.iter().find_map(|name| get(name)).unwrap_or(missing);
                    // SAFETY: the name determines the function's type.
                    unsafe { std::mem::transmute::<unsafe extern "system" fn(), vk::$kind>(found) }
                };)*
                Self { $($field),* }
            }
        }
    };
}

next_functions! {
    destroy_device: PFN_vkDestroyDevice [c"vkDestroyDevice"];
    create_image: PFN_vkCreateImage [c"vkCreateImage"];
    destroy_image: PFN_vkDestroyImage [c"vkDestroyImage"];
    create_image_view: PFN_vkCreateImageView [c"vkCreateImageView"];
    destroy_image_view: PFN_vkDestroyImageView [c"vkDestroyImageView"];
    create_sampler: PFN_vkCreateSampler [c"vkCreateSampler"];
    destroy_sampler: PFN_vkDestroySampler [c"vkDestroySampler"];
    create_swapchain: PFN_vkCreateSwapchainKHR [c"vkCreateSwapchainKHR"];
    get_swapchain_images: PFN_vkGetSwapchainImagesKHR [c"vkGetSwapchainImagesKHR"];
    create_set_layout: PFN_vkCreateDescriptorSetLayout [c"vkCreateDescriptorSetLayout"];
    destroy_set_layout: PFN_vkDestroyDescriptorSetLayout [c"vkDestroyDescriptorSetLayout"];
    allocate_sets: PFN_vkAllocateDescriptorSets [c"vkAllocateDescriptorSets"];
    free_sets: PFN_vkFreeDescriptorSets [c"vkFreeDescriptorSets"];
    reset_pool: PFN_vkResetDescriptorPool [c"vkResetDescriptorPool"];
    destroy_pool: PFN_vkDestroyDescriptorPool [c"vkDestroyDescriptorPool"];
    update_sets: PFN_vkUpdateDescriptorSets [c"vkUpdateDescriptorSets"];
    create_template: PFN_vkCreateDescriptorUpdateTemplate [c"vkCreateDescriptorUpdateTemplate", c"vkCreateDescriptorUpdateTemplateKHR"];
    destroy_template: PFN_vkDestroyDescriptorUpdateTemplate [c"vkDestroyDescriptorUpdateTemplate", c"vkDestroyDescriptorUpdateTemplateKHR"];
    update_with_template: PFN_vkUpdateDescriptorSetWithTemplate [c"vkUpdateDescriptorSetWithTemplate", c"vkUpdateDescriptorSetWithTemplateKHR"];
    create_shader_module: PFN_vkCreateShaderModule [c"vkCreateShaderModule"];
    destroy_shader_module: PFN_vkDestroyShaderModule [c"vkDestroyShaderModule"];
    create_pipeline_layout: PFN_vkCreatePipelineLayout [c"vkCreatePipelineLayout"];
    destroy_pipeline_layout: PFN_vkDestroyPipelineLayout [c"vkDestroyPipelineLayout"];
    create_graphics_pipelines: PFN_vkCreateGraphicsPipelines [c"vkCreateGraphicsPipelines"];
    create_compute_pipelines: PFN_vkCreateComputePipelines [c"vkCreateComputePipelines"];
    destroy_pipeline: PFN_vkDestroyPipeline [c"vkDestroyPipeline"];
    create_render_pass: PFN_vkCreateRenderPass [c"vkCreateRenderPass"];
    create_render_pass2: PFN_vkCreateRenderPass2 [c"vkCreateRenderPass2", c"vkCreateRenderPass2KHR"];
    destroy_render_pass: PFN_vkDestroyRenderPass [c"vkDestroyRenderPass"];
    create_framebuffer: PFN_vkCreateFramebuffer [c"vkCreateFramebuffer"];
    destroy_framebuffer: PFN_vkDestroyFramebuffer [c"vkDestroyFramebuffer"];
    begin_command_buffer: PFN_vkBeginCommandBuffer [c"vkBeginCommandBuffer"];
    free_command_buffers: PFN_vkFreeCommandBuffers [c"vkFreeCommandBuffers"];
    cmd_bind_pipeline: PFN_vkCmdBindPipeline [c"vkCmdBindPipeline"];
    cmd_bind_sets: PFN_vkCmdBindDescriptorSets [c"vkCmdBindDescriptorSets"];
    cmd_push_set: PFN_vkCmdPushDescriptorSetKHR [c"vkCmdPushDescriptorSetKHR"];
    cmd_push_set_with_template: PFN_vkCmdPushDescriptorSetWithTemplateKHR [c"vkCmdPushDescriptorSetWithTemplateKHR"];
    cmd_push_constants: PFN_vkCmdPushConstants [c"vkCmdPushConstants"];
    cmd_begin_render_pass: PFN_vkCmdBeginRenderPass [c"vkCmdBeginRenderPass"];
    cmd_begin_render_pass2: PFN_vkCmdBeginRenderPass2 [c"vkCmdBeginRenderPass2", c"vkCmdBeginRenderPass2KHR"];
    cmd_next_subpass: PFN_vkCmdNextSubpass [c"vkCmdNextSubpass"];
    cmd_next_subpass2: PFN_vkCmdNextSubpass2 [c"vkCmdNextSubpass2", c"vkCmdNextSubpass2KHR"];
    cmd_end_render_pass: PFN_vkCmdEndRenderPass [c"vkCmdEndRenderPass"];
    cmd_end_render_pass2: PFN_vkCmdEndRenderPass2 [c"vkCmdEndRenderPass2", c"vkCmdEndRenderPass2KHR"];
    cmd_begin_rendering: PFN_vkCmdBeginRendering [c"vkCmdBeginRendering", c"vkCmdBeginRenderingKHR"];
    cmd_end_rendering: PFN_vkCmdEndRendering [c"vkCmdEndRendering", c"vkCmdEndRenderingKHR"];
    cmd_execute_commands: PFN_vkCmdExecuteCommands [c"vkCmdExecuteCommands"];
    cmd_set_viewport: PFN_vkCmdSetViewport [c"vkCmdSetViewport"];
    cmd_set_viewport_with_count: PFN_vkCmdSetViewportWithCount [c"vkCmdSetViewportWithCount", c"vkCmdSetViewportWithCountEXT"];
    cmd_set_scissor: PFN_vkCmdSetScissor [c"vkCmdSetScissor"];
    cmd_set_scissor_with_count: PFN_vkCmdSetScissorWithCount [c"vkCmdSetScissorWithCount", c"vkCmdSetScissorWithCountEXT"];
    cmd_set_topology: PFN_vkCmdSetPrimitiveTopology [c"vkCmdSetPrimitiveTopology", c"vkCmdSetPrimitiveTopologyEXT"];
    cmd_set_depth_test: PFN_vkCmdSetDepthTestEnable [c"vkCmdSetDepthTestEnable", c"vkCmdSetDepthTestEnableEXT"];
    cmd_set_depth_write: PFN_vkCmdSetDepthWriteEnable [c"vkCmdSetDepthWriteEnable", c"vkCmdSetDepthWriteEnableEXT"];
    cmd_set_depth_compare: PFN_vkCmdSetDepthCompareOp [c"vkCmdSetDepthCompareOp", c"vkCmdSetDepthCompareOpEXT"];
    cmd_set_stencil_test: PFN_vkCmdSetStencilTestEnable [c"vkCmdSetStencilTestEnable", c"vkCmdSetStencilTestEnableEXT"];
    cmd_set_stencil_op: PFN_vkCmdSetStencilOp [c"vkCmdSetStencilOp", c"vkCmdSetStencilOpEXT"];
    cmd_set_stencil_write_mask: PFN_vkCmdSetStencilWriteMask [c"vkCmdSetStencilWriteMask"];
    cmd_set_color_write_mask: PFN_vkCmdSetColorWriteMaskEXT [c"vkCmdSetColorWriteMaskEXT"];
    cmd_set_color_write_enable: PFN_vkCmdSetColorWriteEnableEXT [c"vkCmdSetColorWriteEnableEXT"];
    cmd_begin_query: PFN_vkCmdBeginQuery [c"vkCmdBeginQuery"];
    cmd_end_query: PFN_vkCmdEndQuery [c"vkCmdEndQuery"];
    cmd_begin_query_indexed: PFN_vkCmdBeginQueryIndexedEXT [c"vkCmdBeginQueryIndexedEXT"];
    cmd_end_query_indexed: PFN_vkCmdEndQueryIndexedEXT [c"vkCmdEndQueryIndexedEXT"];
    cmd_begin_transform_feedback: PFN_vkCmdBeginTransformFeedbackEXT [c"vkCmdBeginTransformFeedbackEXT"];
    cmd_end_transform_feedback: PFN_vkCmdEndTransformFeedbackEXT [c"vkCmdEndTransformFeedbackEXT"];
    cmd_draw: PFN_vkCmdDraw [c"vkCmdDraw"];
    cmd_draw_indexed: PFN_vkCmdDrawIndexed [c"vkCmdDrawIndexed"];
    cmd_draw_indirect: PFN_vkCmdDrawIndirect [c"vkCmdDrawIndirect"];
    cmd_draw_indexed_indirect: PFN_vkCmdDrawIndexedIndirect [c"vkCmdDrawIndexedIndirect"];
    cmd_draw_indirect_count: PFN_vkCmdDrawIndirectCount [c"vkCmdDrawIndirectCount", c"vkCmdDrawIndirectCountKHR", c"vkCmdDrawIndirectCountAMD"];
    cmd_draw_indexed_indirect_count: PFN_vkCmdDrawIndexedIndirectCount [c"vkCmdDrawIndexedIndirectCount", c"vkCmdDrawIndexedIndirectCountKHR", c"vkCmdDrawIndexedIndirectCountAMD"];
    cmd_draw_multi: PFN_vkCmdDrawMultiEXT [c"vkCmdDrawMultiEXT"];
    cmd_draw_multi_indexed: PFN_vkCmdDrawMultiIndexedEXT [c"vkCmdDrawMultiIndexedEXT"];
    cmd_draw_indirect_byte_count: PFN_vkCmdDrawIndirectByteCountEXT [c"vkCmdDrawIndirectByteCountEXT"];
    cmd_dispatch: PFN_vkCmdDispatch [c"vkCmdDispatch"];
    cmd_dispatch_base: PFN_vkCmdDispatchBase [c"vkCmdDispatchBase", c"vkCmdDispatchBaseKHR"];
    cmd_dispatch_indirect: PFN_vkCmdDispatchIndirect [c"vkCmdDispatchIndirect"];
    cmd_copy_image_to_buffer: PFN_vkCmdCopyImageToBuffer [c"vkCmdCopyImageToBuffer"];
    cmd_copy_image_to_buffer2: PFN_vkCmdCopyImageToBuffer2 [c"vkCmdCopyImageToBuffer2", c"vkCmdCopyImageToBuffer2KHR"];
    cmd_copy_image: PFN_vkCmdCopyImage [c"vkCmdCopyImage"];
    cmd_copy_image2: PFN_vkCmdCopyImage2 [c"vkCmdCopyImage2", c"vkCmdCopyImage2KHR"];
    cmd_blit_image2: PFN_vkCmdBlitImage2 [c"vkCmdBlitImage2", c"vkCmdBlitImage2KHR"];
    cmd_resolve_image: PFN_vkCmdResolveImage [c"vkCmdResolveImage"];
    cmd_resolve_image2: PFN_vkCmdResolveImage2 [c"vkCmdResolveImage2", c"vkCmdResolveImage2KHR"];
    cmd_set_event: PFN_vkCmdSetEvent [c"vkCmdSetEvent"];
    cmd_set_event2: PFN_vkCmdSetEvent2 [c"vkCmdSetEvent2", c"vkCmdSetEvent2KHR"];
    cmd_wait_events: PFN_vkCmdWaitEvents [c"vkCmdWaitEvents"];
    cmd_wait_events2: PFN_vkCmdWaitEvents2 [c"vkCmdWaitEvents2", c"vkCmdWaitEvents2KHR"];
    cmd_blit_image: PFN_vkCmdBlitImage [c"vkCmdBlitImage"];
    cmd_pipeline_barrier: PFN_vkCmdPipelineBarrier [c"vkCmdPipelineBarrier"];
    create_buffer: PFN_vkCreateBuffer [c"vkCreateBuffer"];
    destroy_buffer: PFN_vkDestroyBuffer [c"vkDestroyBuffer"];
    allocate_memory: PFN_vkAllocateMemory [c"vkAllocateMemory"];
    free_memory: PFN_vkFreeMemory [c"vkFreeMemory"];
    map_memory: PFN_vkMapMemory [c"vkMapMemory"];
    bind_image_memory: PFN_vkBindImageMemory [c"vkBindImageMemory"];
    bind_buffer_memory: PFN_vkBindBufferMemory [c"vkBindBufferMemory"];
    image_requirements: PFN_vkGetImageMemoryRequirements [c"vkGetImageMemoryRequirements"];
    buffer_requirements: PFN_vkGetBufferMemoryRequirements [c"vkGetBufferMemoryRequirements"];
    queue_submit: PFN_vkQueueSubmit [c"vkQueueSubmit"];
    queue_submit2: PFN_vkQueueSubmit2 [c"vkQueueSubmit2", c"vkQueueSubmit2KHR"];
    queue_wait_idle: PFN_vkQueueWaitIdle [c"vkQueueWaitIdle"];
    queue_present: PFN_vkQueuePresentKHR [c"vkQueuePresentKHR"];
    create_fence: PFN_vkCreateFence [c"vkCreateFence"];
    destroy_fence: PFN_vkDestroyFence [c"vkDestroyFence"];
    wait_for_fences: PFN_vkWaitForFences [c"vkWaitForFences"];
    get_fence_status: PFN_vkGetFenceStatus [c"vkGetFenceStatus"];
    get_event_status: PFN_vkGetEventStatus [c"vkGetEventStatus"];
    create_semaphore: PFN_vkCreateSemaphore [c"vkCreateSemaphore"];
    destroy_semaphore: PFN_vkDestroySemaphore [c"vkDestroySemaphore"];
    wait_semaphores: PFN_vkWaitSemaphores [c"vkWaitSemaphores", c"vkWaitSemaphoresKHR"];
    get_semaphore_counter_value: PFN_vkGetSemaphoreCounterValue [c"vkGetSemaphoreCounterValue", c"vkGetSemaphoreCounterValueKHR"];
    device_wait_idle: PFN_vkDeviceWaitIdle [c"vkDeviceWaitIdle"];
    copy_image_to_memory: PFN_vkCopyImageToMemoryEXT [c"vkCopyImageToMemoryEXT"];
    create_query_pool: PFN_vkCreateQueryPool [c"vkCreateQueryPool"];
    destroy_query_pool: PFN_vkDestroyQueryPool [c"vkDestroyQueryPool"];
    reset_query_pool: PFN_vkResetQueryPool [c"vkResetQueryPool", c"vkResetQueryPoolEXT"];
    get_query_results: PFN_vkGetQueryPoolResults [c"vkGetQueryPoolResults"];
}
