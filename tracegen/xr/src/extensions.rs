//! The extensions, and the functions of the small ones.

use crate::chain::{find, input, output};
use crate::state::{Answer, Code, DONE, INVALID};
use crate::system::check_views;
use openxr_sys as xr;
use std::ffi::CStr;
use xr::{Handle, StructureType};

pub(crate) const DEBUG_UTILS: &str = "XR_EXT_debug_utils";
pub(crate) const DEPTH: &str = "XR_KHR_composition_layer_depth";
pub(crate) const HEADLESS: &str = "XR_MND_headless";
pub(crate) const LOCAL_FLOOR: &str = "XR_EXT_local_floor";
pub(crate) const OPENGL: &str = "XR_KHR_opengl_enable";
pub(crate) const TIMESPEC: &str = "XR_KHR_convert_timespec_time";
pub(crate) const VISIBILITY_MASK: &str = "XR_KHR_visibility_mask";
pub(crate) const VULKAN: &str = "XR_KHR_vulkan_enable";
pub(crate) const VULKAN2: &str = "XR_KHR_vulkan_enable2";

/// The extensions and their versions.
pub(crate) const EXTENSIONS: [(&str, u32); 9] = [
    (VULKAN, 8),
    (VULKAN2, 2),
    (OPENGL, 10),
    (DEPTH, 6),
    (TIMESPEC, 1),
    (VISIBILITY_MASK, 2),
    (DEBUG_UTILS, 5),
    (LOCAL_FLOOR, 1),
    (HEADLESS, 2),
];

/// The vertices and indices of a mesh of triangles.
type Mesh = (Vec<[f32; 2]>, Vec<u32>);

/// The hidden triangles, each with corners of its own.
fn hidden(triangles: &[[[f32; 2]; 3]]) -> Mesh {
    let vertices: Vec<[f32; 2]> = triangles.as_flattened().to_vec();
    let indices = (0..vertices.len() as u32).collect();
    (vertices, indices)
}

/// Answers for a mesh. The two arrays are asked for in one call.
unsafe fn write_mesh(mask: &mut xr::VisibilityMaskKHR, (vertices, indices): &Mesh) -> Answer {
    let counts = [vertices.len() as u32, indices.len() as u32];
    [mask.vertex_count_output, mask.index_count_output] = counts;
    let capacities = [mask.vertex_capacity_input, mask.index_capacity_input];
    if capacities == [0; 2] {
        return DONE;
    }
    let missing = [mask.vertices.is_null(), mask.indices.is_null()];
    for place in 0..2 {
        if capacities[place] < counts[place] {
            return Err(Code::ERROR_SIZE_INSUFFICIENT);
        }
        if counts[place] > 0 && missing[place] {
            return Err(INVALID);
        }
    }
    for (place, &[x, y]) in vertices.iter().enumerate() {
        // SAFETY: the capacity was checked.
        unsafe { mask.vertices.add(place).write(xr::Vector2f { x, y }) };
    }
    for (place, index) in indices.iter().enumerate() {
        // SAFETY: the capacity was checked.
        unsafe { mask.indices.add(place).write(*index) };
    }
    DONE
}

const NANOSECONDS: i64 = 1_000_000_000;

api! {
    fn get_visibility_mask(
        session: xr::Session, views: xr::ViewConfigurationType, view: u32, kind: xr::VisibilityMaskTypeKHR,
        mask: *mut xr::VisibilityMaskKHR,
    ) |state| {
        let instance = state.of_session(session)?;
        check_views(views)?;
        let mask = output(mask, StructureType::VISIBILITY_MASK_KHR)?;
        let eye = instance.settings.eyes.get(view as usize).ok_or(INVALID)?;
        let [left, right, up, down] = eye.tangents;
        let corners = vec![[-left, -down], [right, -down], [right, up], [-left, up]];
        match kind {
            xr::VisibilityMaskTypeKHR::HIDDEN_TRIANGLE_MESH => write_mesh(mask, &hidden(&eye.hidden)),
            // A display without a hidden area shows the whole picture. Of others, only the hidden triangles are known.
            xr::VisibilityMaskTypeKHR::VISIBLE_TRIANGLE_MESH if eye.hidden.is_empty() => {
                write_mesh(mask, &(corners, vec![0, 1, 2, 0, 2, 3]))
            }
            xr::VisibilityMaskTypeKHR::LINE_LOOP if eye.hidden.is_empty() => {
                write_mesh(mask, &(corners, vec![0, 1, 2, 3]))
            }
            xr::VisibilityMaskTypeKHR::VISIBLE_TRIANGLE_MESH | xr::VisibilityMaskTypeKHR::LINE_LOOP => {
                write_mesh(mask, &Mesh::default())
            }
            _ => Err(INVALID),
        }
    }

    fn convert_timespec_time_to_time(instance: xr::Instance, from: *const libc::timespec, time: *mut xr::Time) |state| {
        state.instance(instance)?;
        let (from, time) = (from.as_ref().ok_or(INVALID)?, time.as_mut().ok_or(INVALID)?);
        let (seconds, rest) = (from.tv_sec, from.tv_nsec);
        let total = seconds.checked_mul(NANOSECONDS).and_then(|ns| ns.checked_add(rest));
        let total = total.filter(|ns| *ns > 0 && (0..NANOSECONDS).contains(&rest));
        *time = xr::Time::from_nanos(total.ok_or(Code::ERROR_TIME_INVALID)?);
        DONE
    }

    fn convert_time_to_timespec_time(instance: xr::Instance, time: xr::Time, to: *mut libc::timespec) |state| {
        state.instance(instance)?;
        let to = to.as_mut().ok_or(INVALID)?;
        let ns = time.as_nanos();
        if ns <= 0 {
            return Err(Code::ERROR_TIME_INVALID);
        }
        (to.tv_sec, to.tv_nsec) = (ns / NANOSECONDS, ns % NANOSECONDS);
        DONE
    }

    fn set_debug_utils_object_name(instance: xr::Instance, info: *const xr::DebugUtilsObjectNameInfoEXT) |state| {
        state.instance(instance)?;
        input(info, StructureType::DEBUG_UTILS_OBJECT_NAME_INFO_EXT)?;
        DONE
    }

    fn create_debug_utils_messenger(
        instance: xr::Instance, info: *const xr::DebugUtilsMessengerCreateInfoEXT, messenger: *mut xr::DebugUtilsMessengerEXT,
    ) |state| {
        state.instance(instance)?;
        let info = input(info, StructureType::DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT)?;
        if info.user_callback.is_none() || info.message_types.is_empty() || info.message_severities.is_empty() {
            return Err(INVALID);
        }
        let messenger = messenger.as_mut().ok_or(INVALID)?;
        let handle = state.handle();
        state.any_instance()?.messengers.insert(handle);
        *messenger = xr::DebugUtilsMessengerEXT::from_raw(handle);
        DONE
    }

    fn destroy_debug_utils_messenger(messenger: xr::DebugUtilsMessengerEXT) |state| {
        match state.any_instance()?.messengers.remove(&messenger.into_raw()) {
            true => DONE,
            false => Err(Code::ERROR_HANDLE_INVALID),
        }
    }

    fn submit_debug_utils_message(
        instance: xr::Instance, _severity: xr::DebugUtilsMessageSeverityFlagsEXT, _types: xr::DebugUtilsMessageTypeFlagsEXT,
        data: *const xr::DebugUtilsMessengerCallbackDataEXT,
    ) |state| {
        state.instance(instance)?;
        input(data, StructureType::DEBUG_UTILS_MESSENGER_CALLBACK_DATA_EXT)?;
        DONE
    }

    fn session_begin_debug_utils_label_region(session: xr::Session, label: *const xr::DebugUtilsLabelEXT) |state| {
        state.session(session)?;
        input(label, StructureType::DEBUG_UTILS_LABEL_EXT)?;
        DONE
    }

    fn session_end_debug_utils_label_region(session: xr::Session) |state| {
        state.session(session)?;
        DONE
    }

    fn session_insert_debug_utils_label(session: xr::Session, label: *const xr::DebugUtilsLabelEXT) |state| {
        state.session(session)?;
        input(label, StructureType::DEBUG_UTILS_LABEL_EXT)?;
        DONE
    }
}

/// Answers that a system has no hand tracking, where a program asks through a chain.
///
/// # Safety
/// A valid chain.
pub(crate) unsafe fn deny_hand_tracking(chain: *const std::ffi::c_void) {
    // SAFETY: as the caller promises.
    unsafe {
        if let Some(of) = find(chain, StructureType::SYSTEM_HAND_TRACKING_PROPERTIES_EXT) {
            (*of.cast::<xr::SystemHandTrackingPropertiesEXT>()).supports_hand_tracking = xr::FALSE;
        }
    }
}

/// Name of the extension that a program has to enable for a function; `None` for functions of the core.
pub(crate) fn extension_of(function: &CStr) -> Option<&'static [&'static str]> {
    Some(match function.to_bytes() {
        b"xrGetVulkanGraphicsRequirements2KHR"
        | b"xrCreateVulkanInstanceKHR"
        | b"xrGetVulkanGraphicsDevice2KHR"
        | b"xrCreateVulkanDeviceKHR" => &[VULKAN2],
        b"xrGetVulkanGraphicsRequirementsKHR"
        | b"xrGetVulkanInstanceExtensionsKHR"
        | b"xrGetVulkanDeviceExtensionsKHR"
        | b"xrGetVulkanGraphicsDeviceKHR" => &[VULKAN],
        b"xrGetOpenGLGraphicsRequirementsKHR" => &[OPENGL],
        b"xrGetVisibilityMaskKHR" => &[VISIBILITY_MASK],
        b"xrConvertTimespecTimeToTimeKHR" | b"xrConvertTimeToTimespecTimeKHR" => &[TIMESPEC],
        name if name.ends_with(b"EXT") => &[DEBUG_UTILS],
        _ => return None,
    })
}
