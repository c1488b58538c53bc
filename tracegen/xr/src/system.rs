//! The system: a head-mounted display with two views.

use crate::chain::{input, output, put, structures, values};
use crate::extensions::deny_hand_tracking;
use crate::state::{Code, DONE, INVALID};
use openxr_sys as xr;
use xr::{StructureType, ViewConfigurationType};

/// The one system.
pub(crate) const SYSTEM: u64 = 1;
pub(crate) const MOST_SIZE_PX: u32 = 16384;
pub(crate) const MOST_LAYERS: u32 = xr::MIN_COMPOSITION_LAYERS_SUPPORTED as u32;
/// Samples per pixel that lavapipe has besides 1.
pub(crate) const MOST_SAMPLES: u32 = 4;

pub(crate) fn check_system(system: xr::SystemId) -> Result<(), Code> {
    match system.into_raw() {
        SYSTEM => Ok(()),
        _ => Err(Code::ERROR_SYSTEM_INVALID),
    }
}

pub(crate) fn check_views(views: ViewConfigurationType) -> Result<(), Code> {
    // The name of an unknown value is a number.
    match views {
        ViewConfigurationType::PRIMARY_STEREO => Ok(()),
        other if format!("{other:?}").parse::<i32>().is_ok() => Err(INVALID),
        _ => Err(Code::ERROR_VIEW_CONFIGURATION_TYPE_UNSUPPORTED),
    }
}

api! {
    fn get_system(instance: xr::Instance, info: *const xr::SystemGetInfo, system: *mut xr::SystemId) |state| {
        state.instance(instance)?;
        let info = input(info, StructureType::SYSTEM_GET_INFO)?;
        let system = system.as_mut().ok_or(INVALID)?;
        match info.form_factor {
            xr::FormFactor::HEAD_MOUNTED_DISPLAY => *system = xr::SystemId::from_raw(SYSTEM),
            xr::FormFactor::HANDHELD_DISPLAY => return Err(Code::ERROR_FORM_FACTOR_UNSUPPORTED),
            _ => return Err(INVALID),
        }
        DONE
    }

    fn get_system_properties(instance: xr::Instance, system: xr::SystemId, properties: *mut xr::SystemProperties) |state| {
        let instance = state.instance(instance)?;
        check_system(system)?;
        let properties = output(properties, StructureType::SYSTEM_PROPERTIES)?;
        properties.system_id = system;
        properties.vendor_id = 0;
        put(&mut properties.system_name, &instance.settings.system);
        properties.graphics_properties = xr::SystemGraphicsProperties {
            max_swapchain_image_height: MOST_SIZE_PX,
            max_swapchain_image_width: MOST_SIZE_PX,
            max_layer_count: MOST_LAYERS,
        };
        properties.tracking_properties.orientation_tracking = xr::TRUE;
        properties.tracking_properties.position_tracking = xr::TRUE;
        deny_hand_tracking(properties.next);
        DONE
    }

    fn enumerate_view_configurations(
        instance: xr::Instance, system: xr::SystemId, capacity: u32, count: *mut u32, into: *mut ViewConfigurationType,
    ) |state| {
        state.instance(instance)?;
        check_system(system)?;
        values(&[ViewConfigurationType::PRIMARY_STEREO], capacity, count, into)
    }

    fn get_view_configuration_properties(
        instance: xr::Instance, system: xr::SystemId, views: ViewConfigurationType,
        properties: *mut xr::ViewConfigurationProperties,
    ) |state| {
        state.instance(instance)?;
        check_system(system)?;
        check_views(views)?;
        let properties = output(properties, StructureType::VIEW_CONFIGURATION_PROPERTIES)?;
        properties.view_configuration_type = views;
        properties.fov_mutable = xr::TRUE;
        DONE
    }

    fn enumerate_view_configuration_views(
        instance: xr::Instance, system: xr::SystemId, views: ViewConfigurationType, capacity: u32, count: *mut u32,
        into: *mut xr::ViewConfigurationView,
    ) |state| {
        let [width, height] = state.instance(instance)?.settings.eye_size_px;
        check_system(system)?;
        check_views(views)?;
        structures(2, StructureType::VIEW_CONFIGURATION_VIEW, capacity, count, into, |_, view| {
            view.recommended_image_rect_width = width;
            view.recommended_image_rect_height = height;
            (view.max_image_rect_width, view.max_image_rect_height) = (MOST_SIZE_PX, MOST_SIZE_PX);
            view.recommended_swapchain_sample_count = 1;
            view.max_swapchain_sample_count = MOST_SAMPLES;
        })
    }

    fn enumerate_environment_blend_modes(
        instance: xr::Instance, system: xr::SystemId, views: ViewConfigurationType, capacity: u32, count: *mut u32,
        into: *mut xr::EnvironmentBlendMode,
    ) |state| {
        state.instance(instance)?;
        check_system(system)?;
        check_views(views)?;
        values(&[xr::EnvironmentBlendMode::OPAQUE], capacity, count, into)
    }
}
