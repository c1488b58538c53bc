//! The functions by name.

use crate::extensions::extension_of;
use crate::negotiate::NEWEST;
use crate::state::{Code, INVALID, locked};
use crate::{
    actions, extensions, frames, instance, opengl, paths, session, spaces, swapchains, system,
    views, vulkan,
};
use openxr_sys as xr;
use std::ffi::{CStr, c_char};
use xr::Handle;
use xr::pfn::VoidFunction;

/// Lists functions: name, type, and the function.
macro_rules! functions {
    ($($name:literal $kind:ident => $function:path;)*) => {
        fn function(name: &CStr) -> Option<VoidFunction> {
            match name.to_bytes() {
                $($name => {
                    let typed: xr::pfn::$kind = $function;
                    // SAFETY: the program casts the function to the type of its name.
                    Some(unsafe { std::mem::transmute::<xr::pfn::$kind, VoidFunction>(typed) })
                })*
                _ => None,
            }
        }
    };
}

functions! {
    b"xrGetInstanceProcAddr" GetInstanceProcAddr => get_instance_proc_addr;
    b"xrEnumerateApiLayerProperties" EnumerateApiLayerProperties => instance::enumerate_api_layer_properties;
    b"xrEnumerateInstanceExtensionProperties" EnumerateInstanceExtensionProperties =>
        instance::enumerate_instance_extension_properties;
    b"xrCreateInstance" CreateInstance => instance::create_instance;
    b"xrDestroyInstance" DestroyInstance => instance::destroy_instance;
    b"xrGetInstanceProperties" GetInstanceProperties => instance::get_instance_properties;
    b"xrPollEvent" PollEvent => instance::poll_event;
    b"xrResultToString" ResultToString => instance::result_to_string;
    b"xrStructureTypeToString" StructureTypeToString => instance::structure_type_to_string;
    b"xrStringToPath" StringToPath => paths::string_to_path;
    b"xrPathToString" PathToString => paths::path_to_string;
    b"xrGetSystem" GetSystem => system::get_system;
    b"xrGetSystemProperties" GetSystemProperties => system::get_system_properties;
    b"xrEnumerateViewConfigurations" EnumerateViewConfigurations => system::enumerate_view_configurations;
    b"xrGetViewConfigurationProperties" GetViewConfigurationProperties => system::get_view_configuration_properties;
    b"xrEnumerateViewConfigurationViews" EnumerateViewConfigurationViews => system::enumerate_view_configuration_views;
    b"xrEnumerateEnvironmentBlendModes" EnumerateEnvironmentBlendModes => system::enumerate_environment_blend_modes;
    b"xrCreateSession" CreateSession => session::create_session;
    b"xrDestroySession" DestroySession => session::destroy_session;
    b"xrBeginSession" BeginSession => session::begin_session;
    b"xrEndSession" EndSession => session::end_session;
    b"xrRequestExitSession" RequestExitSession => session::request_exit_session;
    b"xrWaitFrame" WaitFrame => frames::wait_frame;
    b"xrBeginFrame" BeginFrame => frames::begin_frame;
    b"xrEndFrame" EndFrame => frames::end_frame;
    b"xrEnumerateReferenceSpaces" EnumerateReferenceSpaces => spaces::enumerate_reference_spaces;
    b"xrCreateReferenceSpace" CreateReferenceSpace => spaces::create_reference_space;
    b"xrGetReferenceSpaceBoundsRect" GetReferenceSpaceBoundsRect => spaces::get_reference_space_bounds_rect;
    b"xrCreateActionSpace" CreateActionSpace => spaces::create_action_space;
    b"xrDestroySpace" DestroySpace => spaces::destroy_space;
    b"xrLocateSpace" LocateSpace => spaces::locate_space;
    b"xrLocateSpaces" LocateSpaces => spaces::locate_spaces;
    b"xrLocateViews" LocateViews => views::locate_views;
    b"xrEnumerateSwapchainFormats" EnumerateSwapchainFormats => swapchains::enumerate_swapchain_formats;
    b"xrCreateSwapchain" CreateSwapchain => swapchains::create_swapchain;
    b"xrDestroySwapchain" DestroySwapchain => swapchains::destroy_swapchain;
    b"xrEnumerateSwapchainImages" EnumerateSwapchainImages => swapchains::enumerate_swapchain_images;
    b"xrAcquireSwapchainImage" AcquireSwapchainImage => swapchains::acquire_swapchain_image;
    b"xrWaitSwapchainImage" WaitSwapchainImage => swapchains::wait_swapchain_image;
    b"xrReleaseSwapchainImage" ReleaseSwapchainImage => swapchains::release_swapchain_image;
    b"xrCreateActionSet" CreateActionSet => actions::create_action_set;
    b"xrDestroyActionSet" DestroyActionSet => actions::destroy_action_set;
    b"xrCreateAction" CreateAction => actions::create_action;
    b"xrDestroyAction" DestroyAction => actions::destroy_action;
    b"xrSuggestInteractionProfileBindings" SuggestInteractionProfileBindings =>
        actions::suggest_interaction_profile_bindings;
    b"xrAttachSessionActionSets" AttachSessionActionSets => actions::attach_session_action_sets;
    b"xrGetCurrentInteractionProfile" GetCurrentInteractionProfile => actions::get_current_interaction_profile;
    b"xrGetActionStateBoolean" GetActionStateBoolean => actions::get_action_state_boolean;
    b"xrGetActionStateFloat" GetActionStateFloat => actions::get_action_state_float;
    b"xrGetActionStateVector2f" GetActionStateVector2f => actions::get_action_state_vector2f;
    b"xrGetActionStatePose" GetActionStatePose => actions::get_action_state_pose;
    b"xrSyncActions" SyncActions => actions::sync_actions;
    b"xrEnumerateBoundSourcesForAction" EnumerateBoundSourcesForAction => actions::enumerate_bound_sources_for_action;
    b"xrGetInputSourceLocalizedName" GetInputSourceLocalizedName => actions::get_input_source_localized_name;
    b"xrApplyHapticFeedback" ApplyHapticFeedback => actions::apply_haptic_feedback;
    b"xrStopHapticFeedback" StopHapticFeedback => actions::stop_haptic_feedback;
    b"xrGetVulkanGraphicsRequirements2KHR" GetVulkanGraphicsRequirements2KHR => vulkan::get_requirements;
    b"xrCreateVulkanInstanceKHR" CreateVulkanInstanceKHR => vulkan::create_vulkan_instance;
    b"xrGetVulkanGraphicsDevice2KHR" GetVulkanGraphicsDevice2KHR => vulkan::get_graphics_device2;
    b"xrCreateVulkanDeviceKHR" CreateVulkanDeviceKHR => vulkan::create_vulkan_device;
    b"xrGetVulkanGraphicsRequirementsKHR" GetVulkanGraphicsRequirementsKHR => vulkan::get_requirements;
    b"xrGetVulkanInstanceExtensionsKHR" GetVulkanInstanceExtensionsKHR => vulkan::get_instance_extensions;
    b"xrGetVulkanDeviceExtensionsKHR" GetVulkanDeviceExtensionsKHR => vulkan::get_device_extensions;
    b"xrGetVulkanGraphicsDeviceKHR" GetVulkanGraphicsDeviceKHR => vulkan::get_graphics_device;
    b"xrGetOpenGLGraphicsRequirementsKHR" GetOpenGLGraphicsRequirementsKHR => opengl::get_requirements;
    b"xrGetVisibilityMaskKHR" GetVisibilityMaskKHR => extensions::get_visibility_mask;
    b"xrConvertTimespecTimeToTimeKHR" ConvertTimespecTimeToTimeKHR => extensions::convert_timespec_time_to_time;
    b"xrConvertTimeToTimespecTimeKHR" ConvertTimeToTimespecTimeKHR => extensions::convert_time_to_timespec_time;
    b"xrSetDebugUtilsObjectNameEXT" SetDebugUtilsObjectNameEXT => extensions::set_debug_utils_object_name;
    b"xrCreateDebugUtilsMessengerEXT" CreateDebugUtilsMessengerEXT => extensions::create_debug_utils_messenger;
    b"xrDestroyDebugUtilsMessengerEXT" DestroyDebugUtilsMessengerEXT => extensions::destroy_debug_utils_messenger;
    b"xrSubmitDebugUtilsMessageEXT" SubmitDebugUtilsMessageEXT => extensions::submit_debug_utils_message;
    b"xrSessionBeginDebugUtilsLabelRegionEXT" SessionBeginDebugUtilsLabelRegionEXT =>
        extensions::session_begin_debug_utils_label_region;
    b"xrSessionEndDebugUtilsLabelRegionEXT" SessionEndDebugUtilsLabelRegionEXT =>
        extensions::session_end_debug_utils_label_region;
    b"xrSessionInsertDebugUtilsLabelEXT" SessionInsertDebugUtilsLabelEXT =>
        extensions::session_insert_debug_utils_label;
}

/// Functions that need no instance.
const WITHOUT_INSTANCE: [&CStr; 3] = [
    c"xrEnumerateInstanceExtensionProperties",
    c"xrEnumerateApiLayerProperties",
    c"xrCreateInstance",
];

pub(crate) unsafe extern "system" fn get_instance_proc_addr(
    handle: xr::Instance,
    name: *const c_char,
    found: *mut Option<VoidFunction>,
) -> Code {
    // SAFETY: a valid call of xrGetInstanceProcAddr, whose pointers are checked for null.
    let (name, found) = unsafe {
        let (false, Some(found)) = (name.is_null(), found.as_mut()) else {
            return INVALID;
        };
        (CStr::from_ptr(name), found)
    };
    *found = None;
    let mut state = locked();
    let state = state.get_or_insert_default();
    let allowed = match (handle == xr::Instance::NULL, state.instance(handle)) {
        (true, _) if WITHOUT_INSTANCE.contains(&name) => true,
        (true, _) => return Code::ERROR_HANDLE_INVALID,
        (_, Err(error)) => return error,
        (_, Ok(instance)) => match extension_of(name) {
            Some(any) => any.iter().any(|extension| instance.has(extension, None)),
            None => name != c"xrLocateSpaces" || instance.version >= NEWEST,
        },
    };
    *found = function(name).filter(|_| allowed);
    match found {
        Some(_) => Code::SUCCESS,
        None => Code::ERROR_FUNCTION_UNSUPPORTED,
    }
}
