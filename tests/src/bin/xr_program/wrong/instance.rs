//! Calls without a session: instances, systems, and what a session needs.

use super::*;

pub(super) fn without_session(checks: &mut Checks) -> Result<()> {
    let api = Api::open()?;
    let none: [*const std::ffi::c_char; 0] = [];
    let mut made = xr::Instance::default();
    let unknown = [c"XR_EXT_nothing".as_ptr()];
    let info = Api::info(&unknown);
    checks.expect(
        "an unknown extension",
        xr_call!(api, CreateInstance(&info, &mut made)),
        Code::ERROR_EXTENSION_NOT_PRESENT,
    );
    let mut info = Api::info(&none);
    info.application_info.api_version = xr::Version::new(2, 0, 0);
    checks.expect(
        "version 2",
        xr_call!(api, CreateInstance(&info, &mut made)),
        Code::ERROR_API_VERSION_UNSUPPORTED,
    );
    let mut info = Api::info(&none);
    put(&mut info.application_info.application_name, "");
    checks.expect(
        "no name",
        xr_call!(api, CreateInstance(&info, &mut made)),
        Code::ERROR_NAME_INVALID,
    );
    let mut count = 0;
    checks.expect(
        "extensions",
        xr_call!(
            api,
            EnumerateInstanceExtensionProperties(null(), 0, &mut count, null_mut())
        ),
        DONE,
    );
    let mut few: [xr::ExtensionProperties; 1] = [of(Type::EXTENSION_PROPERTIES)];
    checks.expect(
        "few extensions",
        xr_call!(
            api,
            EnumerateInstanceExtensionProperties(null(), 1, &mut count, few.as_mut_ptr())
        ),
        SIZE,
    );
    checks.expect("number of extensions", count >= 7, true);

    let (api, system) = instance(&[c"XR_KHR_vulkan_enable2", c"XR_KHR_convert_timespec_time"])?;
    let the = api.instance;
    checks.expect(
        "a disabled extension",
        api.find("xrGetVisibilityMaskKHR").0,
        Code::ERROR_FUNCTION_UNSUPPORTED,
    );
    checks.expect(
        "an unknown function",
        api.find("xrNothing").0,
        Code::ERROR_FUNCTION_UNSUPPORTED,
    );
    checks.expect(
        "a function of 1.1",
        api.find("xrLocateSpaces").0,
        Code::ERROR_FUNCTION_UNSUPPORTED,
    );
    let mut another = xr::Instance::default();
    let info = Api::info(&none);
    checks.expect(
        "a second instance",
        xr_call!(api, CreateInstance(&info, &mut another)),
        Code::ERROR_LIMIT_REACHED,
    );
    let mut event: xr::EventDataBuffer = of(Type::SYSTEM_GET_INFO);
    checks.expect(
        "a buffer of another type",
        xr_call!(api, PollEvent(the, &mut event)),
        INVALID,
    );
    event.ty = Type::EVENT_DATA_BUFFER;
    checks.expect(
        "no event",
        xr_call!(api, PollEvent(the, &mut event)),
        Code::EVENT_UNAVAILABLE,
    );
    let mut get: xr::SystemGetInfo = of(Type::SYSTEM_GET_INFO);
    let mut found = xr::SystemId::default();
    get.form_factor = xr::FormFactor::HANDHELD_DISPLAY;
    checks.expect(
        "a handheld",
        xr_call!(api, GetSystem(the, &get, &mut found)),
        Code::ERROR_FORM_FACTOR_UNSUPPORTED,
    );
    get.form_factor = xr::FormFactor::from_raw(99);
    checks.expect(
        "no form",
        xr_call!(api, GetSystem(the, &get, &mut found)),
        INVALID,
    );
    get.ty = Type::UNKNOWN;
    checks.expect(
        "no type",
        xr_call!(api, GetSystem(the, &get, &mut found)),
        INVALID,
    );
    let nowhere = xr::SystemId::from_raw(77);
    let mut properties: xr::SystemProperties = of(Type::SYSTEM_PROPERTIES);
    checks.expect(
        "no system",
        xr_call!(api, GetSystemProperties(the, nowhere, &mut properties)),
        Code::ERROR_SYSTEM_INVALID,
    );
    let mut hands: xr::SystemHandTrackingPropertiesEXT =
        of(Type::SYSTEM_HAND_TRACKING_PROPERTIES_EXT);
    hands.supports_hand_tracking = xr::TRUE;
    properties.next = (&raw mut hands).cast();
    checks.expect(
        "properties",
        xr_call!(api, GetSystemProperties(the, system, &mut properties)),
        DONE,
    );
    checks.expect("no hands", hands.supports_hand_tracking, xr::FALSE);
    let stereo = xr::ViewConfigurationType::PRIMARY_STEREO;
    let mut kinds = [stereo; 4];
    checks.expect(
        "kinds of views",
        xr_call!(
            api,
            EnumerateViewConfigurations(the, system, 4, &mut count, kinds.as_mut_ptr())
        ),
        DONE,
    );
    checks.expect("one kind", (count, kinds[0]), (1, stereo));
    checks.expect(
        "no count",
        xr_call!(
            api,
            EnumerateViewConfigurations(the, system, 4, null_mut(), kinds.as_mut_ptr())
        ),
        INVALID,
    );
    checks.expect(
        "no array",
        xr_call!(
            api,
            EnumerateViewConfigurations(the, system, 4, &mut count, null_mut())
        ),
        INVALID,
    );
    let mut views: [xr::ViewConfigurationView; 3] = [
        Type::VIEW_CONFIGURATION_VIEW,
        Type::UNKNOWN,
        Type::VIEW_CONFIGURATION_VIEW,
    ]
    .map(of);
    let list = |kind, capacity, count: &mut u32, views: &mut [xr::ViewConfigurationView; 3]| {
        xr_call!(
            api,
            EnumerateViewConfigurationViews(the, system, kind, capacity, count, views.as_mut_ptr())
        )
    };
    checks.expect(
        "mono",
        list(
            xr::ViewConfigurationType::PRIMARY_MONO,
            3,
            &mut count,
            &mut views,
        ),
        Code::ERROR_VIEW_CONFIGURATION_TYPE_UNSUPPORTED,
    );
    checks.expect(
        "no kind",
        list(
            xr::ViewConfigurationType::from_raw(99),
            3,
            &mut count,
            &mut views,
        ),
        INVALID,
    );
    checks.expect("one view", list(stereo, 1, &mut count, &mut views), SIZE);
    checks.expect("needed views", count, 2);
    checks.expect(
        "a view of another type",
        list(stereo, 2, &mut count, &mut views),
        INVALID,
    );
    views[1].ty = Type::VIEW_CONFIGURATION_VIEW;
    views[0].next = (&raw mut hands).cast();
    checks.expect("two views", list(stereo, 3, &mut count, &mut views), DONE);
    checks.expect("the chain", views[0].next, (&raw mut hands).cast());
    let mut modes = [xr::EnvironmentBlendMode::ADDITIVE];
    checks.expect(
        "blend modes",
        xr_call!(
            api,
            EnumerateEnvironmentBlendModes(the, system, stereo, 1, &mut count, modes.as_mut_ptr())
        ),
        DONE,
    );
    checks.expect("opaque", modes[0], xr::EnvironmentBlendMode::OPAQUE);

    for bad in ["", "user", "/user/", "/User", "/a//b", "/..", "/a b"] {
        checks.expect(bad, path(&api, bad).0, Code::ERROR_PATH_FORMAT_INVALID);
    }
    let (code, hand) = path(&api, "/user/hand/left");
    checks.expect("a path", code, DONE);
    let mut text = [0; 64];
    checks.expect(
        "a short text",
        xr_call!(
            api,
            PathToString(the, hand, 3, &mut count, text.as_mut_ptr())
        ),
        SIZE,
    );
    checks.expect("its length", count, 16);
    checks.expect(
        "no path",
        xr_call!(
            api,
            PathToString(the, xr::Path::NULL, 64, &mut count, text.as_mut_ptr())
        ),
        Code::ERROR_PATH_INVALID,
    );
    checks.expect(
        "an unknown path",
        xr_call!(
            api,
            PathToString(
                the,
                xr::Path::from_raw(999),
                64,
                &mut count,
                text.as_mut_ptr()
            )
        ),
        Code::ERROR_PATH_INVALID,
    );

    let mut set = xr::ActionSet::default();
    let set_of = |name: &str, localized: &str, set: &mut xr::ActionSet| {
        let mut info: xr::ActionSetCreateInfo = of(Type::ACTION_SET_CREATE_INFO);
        put(&mut info.action_set_name, name);
        put(&mut info.localized_action_set_name, localized);
        xr_call!(api, CreateActionSet(the, &info, set))
    };
    checks.expect(
        "a set without name",
        set_of("", "a", &mut set),
        Code::ERROR_NAME_INVALID,
    );
    checks.expect(
        "a set without text",
        set_of("a", "", &mut set),
        Code::ERROR_LOCALIZED_NAME_INVALID,
    );
    checks.expect(
        "a set in capitals",
        set_of("A", "a", &mut set),
        Code::ERROR_PATH_FORMAT_INVALID,
    );
    checks.expect("a set", set_of("a", "a", &mut set), DONE);
    let mut other = xr::ActionSet::default();
    checks.expect(
        "the same set",
        set_of("a", "b", &mut other),
        Code::ERROR_NAME_DUPLICATED,
    );
    checks.expect(
        "the same text",
        set_of("b", "a", &mut other),
        Code::ERROR_LOCALIZED_NAME_DUPLICATED,
    );
    let action_of = |set, name: &str, kind, paths: &[xr::Path], action: &mut xr::Action| {
        let mut info: xr::ActionCreateInfo = of(Type::ACTION_CREATE_INFO);
        put(&mut info.action_name, name);
        put(&mut info.localized_action_name, name);
        info.action_type = kind;
        (info.count_subaction_paths, info.subaction_paths) = (paths.len() as u32, paths.as_ptr());
        xr_call!(api, CreateAction(set, &info, action))
    };
    let (mut action, click) = (xr::Action::default(), xr::ActionType::BOOLEAN_INPUT);
    checks.expect(
        "an action of no set",
        action_of(xr::ActionSet::from_raw(999), "x", click, &[], &mut action),
        HANDLE,
    );
    checks.expect(
        "an action of no type",
        action_of(set, "x", xr::ActionType::from_raw(50), &[], &mut action),
        INVALID,
    );
    checks.expect(
        "an action of no hand",
        action_of(set, "x", click, &[xr::Path::NULL], &mut action),
        Code::ERROR_PATH_INVALID,
    );
    checks.expect(
        "one hand twice",
        action_of(set, "x", click, &[hand, hand], &mut action),
        Code::ERROR_PATH_UNSUPPORTED,
    );
    checks.expect(
        "an action",
        action_of(set, "x", click, &[hand], &mut action),
        DONE,
    );
    checks.expect(
        "the same action",
        action_of(set, "x", click, &[hand], &mut action),
        Code::ERROR_NAME_DUPLICATED,
    );
    let suggest = |profile: &str, binding: &str, action| {
        let binding = [xr::ActionSuggestedBinding {
            action,
            binding: path(&api, binding).1,
        }];
        let mut info: xr::InteractionProfileSuggestedBinding =
            of(Type::INTERACTION_PROFILE_SUGGESTED_BINDING);
        info.interaction_profile = path(&api, profile).1;
        (info.count_suggested_bindings, info.suggested_bindings) = (1, binding.as_ptr());
        xr_call!(api, SuggestInteractionProfileBindings(the, &info))
    };
    let (simple, select) = (
        "/interaction_profiles/khr/simple_controller",
        "/user/hand/left/input/select/click",
    );
    checks.expect(
        "an unknown profile",
        suggest("/interaction_profiles/no/such", select, action),
        Code::ERROR_PATH_UNSUPPORTED,
    );
    checks.expect(
        "an unknown input",
        suggest(simple, "/user/hand/left/input/nose", action),
        Code::ERROR_PATH_UNSUPPORTED,
    );
    checks.expect(
        "an unknown action",
        suggest(simple, select, xr::Action::from_raw(999)),
        HANDLE,
    );
    checks.expect("a binding", suggest(simple, select, action), DONE);

    let at = libc::timespec {
        tv_sec: 3,
        tv_nsec: 7,
    };
    let (mut time, mut back) = (
        xr::Time::from_nanos(0),
        libc::timespec {
            tv_sec: 0,
            tv_nsec: 0,
        },
    );
    checks.expect(
        "a time",
        xr_call!(api, ConvertTimespecTimeToTimeKHR(the, &at, &mut time)),
        DONE,
    );
    checks.expect(
        "back",
        xr_call!(api, ConvertTimeToTimespecTimeKHR(the, time, &mut back)),
        DONE,
    );
    checks.expect("the same time", (back.tv_sec, back.tv_nsec), (3, 7));
    checks.expect(
        "no time",
        xr_call!(
            api,
            ConvertTimeToTimespecTimeKHR(the, xr::Time::from_nanos(0), &mut back)
        ),
        Code::ERROR_TIME_INVALID,
    );

    let mut info: xr::SessionCreateInfo = of(Type::SESSION_CREATE_INFO);
    let mut session = xr::Session::default();
    info.system_id = nowhere;
    checks.expect(
        "a session of no system",
        xr_call!(api, CreateSession(the, &info, &mut session)),
        Code::ERROR_SYSTEM_INVALID,
    );
    info.system_id = system;
    checks.expect(
        "a session without graphics",
        xr_call!(api, CreateSession(the, &info, &mut session)),
        Code::ERROR_GRAPHICS_DEVICE_INVALID,
    );
    let binding: xr::GraphicsBindingVulkanKHR = of(Type::GRAPHICS_BINDING_VULKAN_KHR);
    let mut first: xr::BaseInStructure = of(Type::from_raw(123_456));
    first.next = (&raw const binding).cast();
    info.next = (&raw const first).cast();
    checks.expect(
        "no requirements",
        xr_call!(api, CreateSession(the, &info, &mut session)),
        Code::ERROR_GRAPHICS_REQUIREMENTS_CALL_MISSING,
    );
    let mut requirements: xr::GraphicsRequirementsVulkanKHR =
        of(Type::GRAPHICS_REQUIREMENTS_VULKAN_KHR);
    checks.expect(
        "requirements of no system",
        xr_call!(
            api,
            GetVulkanGraphicsRequirements2KHR(the, nowhere, &mut requirements)
        ),
        Code::ERROR_SYSTEM_INVALID,
    );
    checks.expect(
        "requirements",
        xr_call!(
            api,
            GetVulkanGraphicsRequirements2KHR(the, system, &mut requirements)
        ),
        DONE,
    );
    checks.expect(
        "no device",
        xr_call!(api, CreateSession(the, &info, &mut session)),
        Code::ERROR_GRAPHICS_DEVICE_INVALID,
    );
    checks.expect("destroyed", xr_call!(api, DestroyInstance(the)), DONE);
    Ok(())
}
