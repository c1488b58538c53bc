//! Instances, their properties, and events.

use crate::actions::Actions;
use crate::chain::{elements, input, output, put, structures, taken};
use crate::extensions::EXTENSIONS;
use crate::negotiate::NEWEST;
use crate::paths::Paths;
use crate::state::{BEGUN, Code, DONE, Event, INVALID, Instance, locked};
use crate::vulkan::Vulkan;
use openxr_sys as xr;
use spool::FOLDER_VARIABLE;
use spool::openxr::RuntimeSettings;
use std::collections::{HashMap, HashSet, VecDeque};
use std::ffi::{CStr, c_char};
use std::path::Path;
use xr::{Handle, StructureType};

/// The settings of the capture that the process belongs to.
fn settings() -> std::io::Result<RuntimeSettings> {
    let folder = std::env::var_os(FOLDER_VARIABLE);
    let folder = folder.ok_or_else(|| {
        std::io::Error::other("only `tracegen xr` starts programs with this runtime")
    })?;
    RuntimeSettings::load(Path::new(&folder))
}

api! {
    fn enumerate_api_layer_properties(capacity: u32, count: *mut u32, properties: *mut xr::ApiLayerProperties) |_state| {
        structures(0, StructureType::API_LAYER_PROPERTIES, capacity, count, properties, |_, _| ())
    }

    fn enumerate_instance_extension_properties(
        layer: *const c_char, capacity: u32, count: *mut u32, properties: *mut xr::ExtensionProperties,
    ) |_state| {
        if !layer.is_null() && *layer != 0 {
            return Err(Code::ERROR_API_LAYER_NOT_PRESENT);
        }
        let ty = StructureType::EXTENSION_PROPERTIES;
        structures(EXTENSIONS.len(), ty, capacity, count, properties, |place, of| {
            let (name, version) = EXTENSIONS[place];
            put(&mut of.extension_name, name);
            of.extension_version = version;
        })
    }

    fn create_instance(info: *const xr::InstanceCreateInfo, instance: *mut xr::Instance) |state| {
        let info = input(info, StructureType::INSTANCE_CREATE_INFO)?;
        let instance = instance.as_mut().ok_or(INVALID)?;
        if info.create_flags != xr::InstanceCreateFlags::EMPTY {
            return Err(INVALID);
        }
        let application = &info.application_info;
        if taken(&application.application_name)?.is_empty() {
            return Err(Code::ERROR_NAME_INVALID);
        }
        taken(&application.engine_name)?;
        let asked = application.api_version;
        let newest = xr::Version::new(NEWEST.major(), NEWEST.minor(), u32::MAX);
        if asked.major() != NEWEST.major() || asked > newest {
            return Err(Code::ERROR_API_VERSION_UNSUPPORTED);
        }
        let mut extensions = HashSet::new();
        for name in elements(info.enabled_extension_names, info.enabled_extension_count)? {
            if name.is_null() {
                return Err(INVALID);
            }
            let name = CStr::from_ptr(*name).to_str().unwrap_or_default();
            let known = EXTENSIONS.iter().find(|(known, _)| *known == name);
            extensions.insert(known.ok_or(Code::ERROR_EXTENSION_NOT_PRESENT)?.0);
        }
        if state.instance.is_some() {
            return Err(Code::ERROR_LIMIT_REACHED);
        }
        let settings = settings().map_err(|error| {
            eprintln!("parallax: no settings of a capture: {error}");
            Code::ERROR_RUNTIME_FAILURE
        })?;
        let handle = state.handle();
        state.instance = Some(Instance {
            handle,
            settings,
            version: asked,
            extensions,
            events: VecDeque::new(),
            paths: Paths::default(),
            vulkan: Vulkan::default(),
            asked_for_opengl: false,
            session: None,
            spaces: HashMap::new(),
            swapchains: HashMap::new(),
            actions: Actions::default(),
            messengers: HashSet::new(),
        });
        *instance = xr::Instance::from_raw(handle);
        DONE
    }

    fn get_instance_properties(instance: xr::Instance, properties: *mut xr::InstanceProperties) |state| {
        state.instance(instance)?;
        let properties = output(properties, StructureType::INSTANCE_PROPERTIES)?;
        properties.runtime_version = xr::Version::new(0, 1, 0);
        put(&mut properties.runtime_name, "Parallax");
        DONE
    }

    fn poll_event(instance: xr::Instance, buffer: *mut xr::EventDataBuffer) |state| {
        let instance = state.instance(instance)?;
        output(buffer, StructureType::EVENT_DATA_BUFFER)?;
        let next = std::ptr::null();
        match instance.events.pop_front() {
            None => return Ok(Code::EVENT_UNAVAILABLE),
            Some(Event::State(session, state, time)) => {
                let ty = StructureType::EVENT_DATA_SESSION_STATE_CHANGED;
                buffer.cast::<xr::EventDataSessionStateChanged>().write(xr::EventDataSessionStateChanged { ty, next, session, state, time });
            }
            Some(Event::Profile(session)) => {
                let ty = StructureType::EVENT_DATA_INTERACTION_PROFILE_CHANGED;
                buffer.cast::<xr::EventDataInteractionProfileChanged>().write(xr::EventDataInteractionProfileChanged { ty, next, session });
            }
        }
        DONE
    }

    fn result_to_string(instance: xr::Instance, value: xr::Result, buffer: *mut c_char) |state| {
        state.instance(instance)?;
        let name = format!("{value:?}");
        let raw = value.into_raw();
        let text = match name.parse::<i32>() {
            Ok(_) if raw < 0 => format!("XR_UNKNOWN_FAILURE_{}", -i64::from(raw)),
            Ok(_) => format!("XR_UNKNOWN_SUCCESS_{raw}"),
            Err(_) => format!("XR_{name}"),
        };
        let buffer = buffer.cast::<[c_char; xr::MAX_RESULT_STRING_SIZE]>();
        put(buffer.as_mut().ok_or(INVALID)?, &text);
        DONE
    }

    fn structure_type_to_string(instance: xr::Instance, value: xr::StructureType, buffer: *mut c_char) |state| {
        state.instance(instance)?;
        let name = format!("{value:?}");
        let text = match name.parse::<i32>() {
            Ok(raw) => format!("XR_UNKNOWN_STRUCTURE_TYPE_{raw}"),
            Err(_) => format!("XR_TYPE_{name}"),
        };
        let buffer = buffer.cast::<[c_char; xr::MAX_STRUCTURE_NAME_SIZE]>();
        put(buffer.as_mut().ok_or(INVALID)?, &text);
        DONE
    }
}

pub(crate) unsafe extern "system" fn destroy_instance(instance: xr::Instance) -> Code {
    let mut state = locked();
    let state = state.get_or_insert_default();
    if let Err(error) = state.instance(instance) {
        return error;
    }
    state.instance = None;
    BEGUN.notify_all();
    Code::SUCCESS
}
