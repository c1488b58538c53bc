//! Wrong calls, and calls in two steps, each with the code that the specification asks for.

use crate::api::{Api, Result, of, put};
use crate::session::{Opened, instance};
use crate::targets::swapchain_info;
use crate::{xr_call, xr_do};
use openxr_sys as xr;
use std::ffi::CString;
use std::ptr::{null, null_mut};
use xr::{Handle, Result as Code, SessionState, StructureType as Type};

/// Answers that were not as expected, and the number of all.
#[derive(Default)]
struct Checks {
    count: u32,
    wrong: Vec<String>,
}

impl Checks {
    fn expect<T: PartialEq + std::fmt::Debug>(&mut self, what: &str, found: T, expected: T) {
        self.count += 1;
        if found != expected {
            self.wrong
                .push(format!("{what}: expected {expected:?}, found {found:?}"));
        }
    }
}

const INVALID: Code = Code::ERROR_VALIDATION_FAILURE;
const HANDLE: Code = Code::ERROR_HANDLE_INVALID;
const ORDER: Code = Code::ERROR_CALL_ORDER_INVALID;
const SIZE: Code = Code::ERROR_SIZE_INSUFFICIENT;
const DONE: Code = Code::SUCCESS;

/// Makes all calls; writes their number to a file.
pub fn run(file: &str) -> Result<()> {
    let mut checks = Checks::default();
    without_session(&mut checks)?;
    with_session(&mut checks)?;
    std::fs::write(file, checks.count.to_string()).map_err(|error| error.to_string())?;
    match checks.wrong.is_empty() {
        true => Ok(()),
        false => Err(checks.wrong.join("\n")),
    }
}

fn path(api: &Api, text: &str) -> (Code, xr::Path) {
    let text = CString::new(text).unwrap_or_default();
    let mut path = xr::Path::NULL;
    (
        xr_call!(api, StringToPath(api.instance, text.as_ptr(), &mut path)),
        path,
    )
}

fn without_session(checks: &mut Checks) -> Result<()> {
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

fn with_session(checks: &mut Checks) -> Result<()> {
    let opened = Opened::new(2, &[c"XR_KHR_visibility_mask"])?;
    let (api, session) = (&opened.api, opened.session);
    let nothing = xr::Session::from_raw(999);
    checks.expect(
        "events at the start",
        opened.poll()?,
        vec![SessionState::IDLE, SessionState::READY],
    );
    let mut frame: xr::FrameState = of(Type::FRAME_STATE);
    let stereo = xr::ViewConfigurationType::PRIMARY_STEREO;
    checks.expect(
        "a frame before the start",
        xr_call!(api, WaitFrame(session, null(), &mut frame)),
        Code::ERROR_SESSION_NOT_RUNNING,
    );
    checks.expect(
        "a start before the start",
        xr_call!(api, BeginFrame(session, null())),
        Code::ERROR_SESSION_NOT_RUNNING,
    );
    checks.expect(
        "an end before the start",
        xr_call!(api, EndSession(session)),
        Code::ERROR_SESSION_NOT_RUNNING,
    );
    checks.expect(
        "an exit before the start",
        xr_call!(api, RequestExitSession(session)),
        Code::ERROR_SESSION_NOT_RUNNING,
    );
    let mut begin: xr::SessionBeginInfo = of(Type::SESSION_BEGIN_INFO);
    begin.primary_view_configuration_type = xr::ViewConfigurationType::PRIMARY_MONO;
    checks.expect(
        "a session of one view",
        xr_call!(api, BeginSession(session, &begin)),
        Code::ERROR_VIEW_CONFIGURATION_TYPE_UNSUPPORTED,
    );
    checks.expect(
        "no session",
        xr_call!(api, BeginSession(nothing, &begin)),
        HANDLE,
    );
    begin.primary_view_configuration_type = stereo;
    checks.expect(
        "a start",
        xr_call!(api, BeginSession(session, &begin)),
        DONE,
    );
    checks.expect(
        "a second start",
        xr_call!(api, BeginSession(session, &begin)),
        Code::ERROR_SESSION_RUNNING,
    );
    checks.expect(
        "an end without request",
        xr_call!(api, EndSession(session)),
        Code::ERROR_SESSION_NOT_STOPPING,
    );
    spaces(checks, &opened)?;
    let (chain, space) = (
        swapchains(checks, &opened)?,
        opened.space(xr::ReferenceSpaceType::LOCAL)?,
    );
    checks.expect(
        "a frame that was not waited for",
        xr_call!(api, BeginFrame(session, null())),
        ORDER,
    );
    let now = xr::Time::from_nanos(1);
    checks.expect(
        "an end of no frame",
        opened.end_frame(now, space, &[]),
        ORDER,
    );
    let first = opened.begin_frame()?;
    checks.expect(
        "the first frame is not rendered",
        first.should_render,
        xr::FALSE,
    );
    let time = first.predicted_display_time;
    let mut info: xr::FrameEndInfo = of(Type::FRAME_END_INFO);
    info.environment_blend_mode = xr::EnvironmentBlendMode::OPAQUE;
    checks.expect(
        "an end at no time",
        xr_call!(api, EndFrame(session, &info)),
        Code::ERROR_TIME_INVALID,
    );
    info.display_time = time;
    info.environment_blend_mode = xr::EnvironmentBlendMode::ADDITIVE;
    checks.expect(
        "an additive end",
        xr_call!(api, EndFrame(session, &info)),
        Code::ERROR_ENVIRONMENT_BLEND_MODE_UNSUPPORTED,
    );
    info.environment_blend_mode = xr::EnvironmentBlendMode::OPAQUE;
    info.layer_count = 1000;
    checks.expect(
        "a thousand layers",
        xr_call!(api, EndFrame(session, &info)),
        Code::ERROR_LAYER_LIMIT_EXCEEDED,
    );
    let empty = [null()];
    (info.layer_count, info.layers) = (1, empty.as_ptr());
    checks.expect(
        "a null layer",
        xr_call!(api, EndFrame(session, &info)),
        Code::ERROR_LAYER_INVALID,
    );
    let mut view: xr::CompositionLayerProjectionView = of(Type::COMPOSITION_LAYER_PROJECTION_VIEW);
    view.pose = xr::Posef::IDENTITY;
    view.sub_image.swapchain = chain;
    view.sub_image.image_rect.extent = xr::Extent2Di {
        width: 64,
        height: 64,
    };
    checks.expect(
        "one view of two",
        opened.end_frame(time, space, &[view]),
        INVALID,
    );
    checks.expect(
        "an image never released",
        opened.end_frame(time, space, &[view, view]),
        Code::ERROR_LAYER_INVALID,
    );
    release(api, chain)?;
    let with = |change: &dyn Fn(&mut xr::CompositionLayerProjectionView)| {
        let mut changed = view;
        change(&mut changed);
        opened.end_frame(time, space, &[view, changed])
    };
    let rect = Code::ERROR_SWAPCHAIN_RECT_INVALID;
    checks.expect(
        "a wide rectangle",
        with(&|v| v.sub_image.image_rect.extent.width = 65),
        rect,
    );
    checks.expect(
        "an empty rectangle",
        with(&|v| v.sub_image.image_rect.extent.height = 0),
        rect,
    );
    checks.expect(
        "a rectangle outside",
        with(&|v| v.sub_image.image_rect.offset.x = -1),
        rect,
    );
    checks.expect(
        "a layer too far",
        with(&|v| v.sub_image.image_array_index = 1),
        INVALID,
    );
    checks.expect(
        "no swapchain",
        with(&|v| v.sub_image.swapchain = xr::Swapchain::from_raw(999)),
        HANDLE,
    );
    checks.expect(
        "a long quaternion",
        with(&|v| v.pose.orientation.w = 2.0),
        Code::ERROR_POSE_INVALID,
    );
    checks.expect(
        "a view of another type",
        with(&|v| v.ty = Type::VIEW),
        INVALID,
    );
    checks.expect(
        "no space",
        opened.end_frame(time, xr::Space::from_raw(999), &[view, view]),
        HANDLE,
    );
    checks.expect("an end", opened.end_frame(time, space, &[]), DONE);
    let up = vec![
        SessionState::SYNCHRONIZED,
        SessionState::VISIBLE,
        SessionState::FOCUSED,
    ];
    checks.expect("events after the first frame", opened.poll()?, up);
    let second = opened.begin_frame()?;
    checks.expect(
        "the second frame is rendered",
        second.should_render,
        xr::TRUE,
    );
    let period = second.predicted_display_time.as_nanos() - time.as_nanos();
    checks.expect(
        "the clock",
        period,
        second.predicted_display_period.as_nanos(),
    );
    xr_do!(api, WaitFrame(session, null(), &mut frame));
    checks.expect(
        "a frame begun twice",
        xr_call!(api, BeginFrame(session, null())),
        Code::FRAME_DISCARDED,
    );
    checks.expect(
        "its end",
        opened.end_frame(frame.predicted_display_time, space, &[view, view]),
        DONE,
    );
    actions(checks, &opened)?;
    masks(checks, &opened);
    checks.expect("an exit", xr_call!(api, RequestExitSession(session)), DONE);
    let down = vec![
        SessionState::VISIBLE,
        SessionState::SYNCHRONIZED,
        SessionState::STOPPING,
    ];
    checks.expect("events before the end", opened.poll()?, down);
    checks.expect("the end", xr_call!(api, EndSession(session)), DONE);
    checks.expect(
        "events after the end",
        opened.poll()?,
        vec![SessionState::IDLE, SessionState::EXITING],
    );
    checks.expect(
        "a start after the end",
        xr_call!(api, BeginSession(session, &begin)),
        Code::ERROR_SESSION_NOT_READY,
    );
    checks.expect(
        "destroyed session",
        xr_call!(api, DestroySession(session)),
        DONE,
    );
    checks.expect(
        "its swapchain",
        xr_call!(api, DestroySwapchain(chain)),
        HANDLE,
    );
    checks.expect("its space", xr_call!(api, DestroySpace(space)), HANDLE);
    checks.expect(
        "destroyed twice",
        xr_call!(api, DestroySession(session)),
        HANDLE,
    );
    xr_do!(api, DestroyInstance(api.instance));
    Ok(())
}

fn spaces(checks: &mut Checks, opened: &Opened) -> Result<()> {
    let (api, session) = (&opened.api, opened.session);
    let (local, head) = (
        opened.space(xr::ReferenceSpaceType::LOCAL)?,
        opened.space(xr::ReferenceSpaceType::VIEW)?,
    );
    let mut space = xr::Space::default();
    let mut info: xr::ReferenceSpaceCreateInfo = of(Type::REFERENCE_SPACE_CREATE_INFO);
    info.reference_space_type = xr::ReferenceSpaceType::LOCAL;
    checks.expect(
        "a quaternion of zeros",
        xr_call!(api, CreateReferenceSpace(session, &info, &mut space)),
        Code::ERROR_POSE_INVALID,
    );
    info.pose_in_reference_space = xr::Posef::IDENTITY;
    info.reference_space_type = xr::ReferenceSpaceType::LOCAL_FLOOR;
    checks.expect(
        "a space of 1.1",
        xr_call!(api, CreateReferenceSpace(session, &info, &mut space)),
        Code::ERROR_REFERENCE_SPACE_UNSUPPORTED,
    );
    let mut kinds = [xr::ReferenceSpaceType::VIEW; 3];
    let mut count = 0;
    checks.expect(
        "two kinds of spaces",
        xr_call!(
            api,
            EnumerateReferenceSpaces(session, 2, &mut count, kinds.as_mut_ptr())
        ),
        SIZE,
    );
    checks.expect(
        "three kinds of spaces",
        (
            xr_call!(
                api,
                EnumerateReferenceSpaces(session, 3, &mut count, kinds.as_mut_ptr())
            ),
            count,
        ),
        (DONE, 3),
    );
    let mut bounds = xr::Extent2Df {
        width: 1.0,
        height: 1.0,
    };
    checks.expect(
        "bounds",
        xr_call!(
            api,
            GetReferenceSpaceBoundsRect(session, xr::ReferenceSpaceType::STAGE, &mut bounds)
        ),
        Code::SPACE_BOUNDS_UNAVAILABLE,
    );
    checks.expect("no bounds", (bounds.width, bounds.height), (0.0, 0.0));
    let (time, mut location): (_, xr::SpaceLocation) = (
        xr::Time::from_nanos(2_000_000_000),
        of(Type::SPACE_LOCATION),
    );
    let none = xr::Space::from_raw(999);
    checks.expect(
        "nothing located",
        xr_call!(api, LocateSpace(none, local, time, &mut location)),
        HANDLE,
    );
    checks.expect(
        "located in nothing",
        xr_call!(api, LocateSpace(local, none, time, &mut location)),
        HANDLE,
    );
    checks.expect(
        "located at no time",
        xr_call!(
            api,
            LocateSpace(head, local, xr::Time::from_nanos(0), &mut location)
        ),
        Code::ERROR_TIME_INVALID,
    );
    checks.expect(
        "located",
        xr_call!(api, LocateSpace(head, local, time, &mut location)),
        DONE,
    );
    checks.expect("known and tracked", location.location_flags.into_raw(), 15);
    let mut view_info: xr::ViewLocateInfo = of(Type::VIEW_LOCATE_INFO);
    view_info.view_configuration_type = xr::ViewConfigurationType::PRIMARY_STEREO;
    (view_info.display_time, view_info.space) = (time, local);
    let mut state: xr::ViewState = of(Type::VIEW_STATE);
    let mut views: [xr::View; 2] = [of(Type::VIEW), of(Type::UNKNOWN)];
    let mut locate = |info: &xr::ViewLocateInfo, capacity, views: &mut [xr::View; 2]| {
        let code = xr_call!(
            api,
            LocateViews(
                session,
                info,
                &mut state,
                capacity,
                &mut count,
                views.as_mut_ptr()
            )
        );
        (code, count)
    };
    checks.expect(
        "views counted",
        locate(&view_info, 0, &mut views),
        (DONE, 2),
    );
    checks.expect(
        "one view located",
        locate(&view_info, 1, &mut views),
        (SIZE, 2),
    );
    checks.expect(
        "a view of no type",
        locate(&view_info, 2, &mut views).0,
        INVALID,
    );
    views[1].ty = Type::VIEW;
    checks.expect(
        "views located",
        locate(&view_info, 2, &mut views),
        (DONE, 2),
    );
    view_info.display_time = xr::Time::from_nanos(-1);
    checks.expect(
        "views at no time",
        locate(&view_info, 2, &mut views).0,
        Code::ERROR_TIME_INVALID,
    );
    (view_info.display_time, view_info.space) = (time, none);
    checks.expect(
        "views in nothing",
        locate(&view_info, 2, &mut views).0,
        HANDLE,
    );
    checks.expect("a destroyed space", xr_call!(api, DestroySpace(head)), DONE);
    checks.expect("destroyed twice", xr_call!(api, DestroySpace(head)), HANDLE);
    Ok(())
}

fn release(api: &Api, chain: xr::Swapchain) -> Result<()> {
    let mut image = 0;
    let wait: xr::SwapchainImageWaitInfo = of(Type::SWAPCHAIN_IMAGE_WAIT_INFO);
    xr_do!(api, AcquireSwapchainImage(chain, null(), &mut image));
    xr_do!(api, WaitSwapchainImage(chain, &wait));
    xr_do!(api, ReleaseSwapchainImage(chain, null()));
    Ok(())
}

/// Returns a swapchain of which no image was released.
fn swapchains(checks: &mut Checks, opened: &Opened) -> Result<xr::Swapchain> {
    let (api, session) = (&opened.api, opened.session);
    let good = swapchain_info([64, 64], 1);
    let with = |change: &dyn Fn(&mut xr::SwapchainCreateInfo)| {
        let (mut info, mut chain) = (good, xr::Swapchain::default());
        change(&mut info);
        let code = xr_call!(api, CreateSwapchain(session, &info, &mut chain));
        (code, chain)
    };
    checks.expect(
        "an unknown format",
        with(&|i| i.format = 9999).0,
        Code::ERROR_SWAPCHAIN_FORMAT_UNSUPPORTED,
    );
    checks.expect("no width", with(&|i| i.width = 0).0, INVALID);
    checks.expect("a large height", with(&|i| i.height = 1 << 20).0, INVALID);
    checks.expect("two faces", with(&|i| i.face_count = 2).0, INVALID);
    checks.expect("no layers", with(&|i| i.array_size = 0).0, INVALID);
    checks.expect("no levels", with(&|i| i.mip_count = 0).0, INVALID);
    checks.expect(
        "three samples",
        with(&|i| i.sample_count = 3).0,
        Code::ERROR_FEATURE_UNSUPPORTED,
    );
    checks.expect(
        "protected",
        with(&|i| i.create_flags = xr::SwapchainCreateFlags::PROTECTED_CONTENT).0,
        Code::ERROR_FEATURE_UNSUPPORTED,
    );
    checks.expect(
        "a swapchain of another type",
        with(&|i| i.ty = Type::UNKNOWN).0,
        INVALID,
    );
    let (code, fixed) = with(&|i| i.create_flags = xr::SwapchainCreateFlags::STATIC_IMAGE);
    checks.expect("a static image", code, DONE);
    let mut index = 0;
    release(api, fixed)?;
    checks.expect(
        "a static image again",
        xr_call!(api, AcquireSwapchainImage(fixed, null(), &mut index)),
        ORDER,
    );
    checks.expect(
        "a destroyed swapchain",
        xr_call!(api, DestroySwapchain(fixed)),
        DONE,
    );
    let (code, samples) = with(&|i| i.sample_count = 4);
    checks.expect(
        "four samples",
        (code, xr_call!(api, DestroySwapchain(samples))),
        (DONE, DONE),
    );
    let (code, chain) = with(&|_| ());
    checks.expect("a swapchain", code, DONE);
    let mut images: [xr::SwapchainImageVulkanKHR; 3] = [
        Type::SWAPCHAIN_IMAGE_VULKAN_KHR,
        Type::UNKNOWN,
        Type::SWAPCHAIN_IMAGE_VULKAN_KHR,
    ]
    .map(of);
    let mut count = 0;
    let mut list = |capacity, images: &mut [xr::SwapchainImageVulkanKHR; 3]| {
        let code = xr_call!(
            api,
            EnumerateSwapchainImages(chain, capacity, &mut count, images.as_mut_ptr().cast())
        );
        (code, count)
    };
    checks.expect("two images", list(2, &mut images), (SIZE, 3));
    checks.expect("an image of another type", list(3, &mut images).0, INVALID);
    images[1].ty = Type::SWAPCHAIN_IMAGE_VULKAN_KHR;
    checks.expect("three images", list(3, &mut images), (DONE, 3));
    checks.expect(
        "different images",
        images[0].image != images[1].image && images[1].image != images[2].image,
        true,
    );
    let mut wait: xr::SwapchainImageWaitInfo = of(Type::SWAPCHAIN_IMAGE_WAIT_INFO);
    checks.expect(
        "a wait for nothing",
        xr_call!(api, WaitSwapchainImage(chain, &wait)),
        ORDER,
    );
    checks.expect(
        "a release of nothing",
        xr_call!(api, ReleaseSwapchainImage(chain, null())),
        ORDER,
    );
    let (_, other) = with(&|_| ());
    for number in 0..3 {
        checks.expect(
            "an image",
            (
                xr_call!(api, AcquireSwapchainImage(other, null(), &mut index)),
                index,
            ),
            (DONE, number),
        );
    }
    checks.expect(
        "a fourth image",
        xr_call!(api, AcquireSwapchainImage(other, null(), &mut index)),
        ORDER,
    );
    checks.expect(
        "a release without a wait",
        xr_call!(api, ReleaseSwapchainImage(other, null())),
        ORDER,
    );
    wait.ty = Type::UNKNOWN;
    checks.expect(
        "a wait of another type",
        xr_call!(api, WaitSwapchainImage(other, &wait)),
        INVALID,
    );
    wait.ty = Type::SWAPCHAIN_IMAGE_WAIT_INFO;
    checks.expect(
        "a wait",
        xr_call!(api, WaitSwapchainImage(other, &wait)),
        DONE,
    );
    checks.expect(
        "a second wait",
        xr_call!(api, WaitSwapchainImage(other, &wait)),
        ORDER,
    );
    checks.expect(
        "a release",
        xr_call!(api, ReleaseSwapchainImage(other, null())),
        DONE,
    );
    Ok(chain)
}

fn actions(checks: &mut Checks, opened: &Opened) -> Result<()> {
    let (api, session) = (&opened.api, opened.session);
    let sync: xr::ActionsSyncInfo = of(Type::ACTIONS_SYNC_INFO);
    let mut set = xr::ActionSet::default();
    let mut info: xr::ActionSetCreateInfo = of(Type::ACTION_SET_CREATE_INFO);
    put(&mut info.action_set_name, "set");
    put(&mut info.localized_action_set_name, "set");
    xr_do!(api, CreateActionSet(api.instance, &info, &mut set));
    let make = |name: &str, kind| -> Result<xr::Action> {
        let mut info: xr::ActionCreateInfo = of(Type::ACTION_CREATE_INFO);
        put(&mut info.action_name, name);
        put(&mut info.localized_action_name, name);
        info.action_type = kind;
        let mut action = xr::Action::default();
        xr_do!(api, CreateAction(set, &info, &mut action));
        Ok(action)
    };
    let (click, grip) = (
        make("click", xr::ActionType::BOOLEAN_INPUT)?,
        make("grip", xr::ActionType::POSE_INPUT)?,
    );
    let bindings = [
        (click, "/user/hand/left/input/select/click"),
        (grip, "/user/hand/right/input/grip/pose"),
    ]
    .map(|(action, text)| xr::ActionSuggestedBinding {
        action,
        binding: path(api, text).1,
    });
    let mut suggest: xr::InteractionProfileSuggestedBinding =
        of(Type::INTERACTION_PROFILE_SUGGESTED_BINDING);
    suggest.interaction_profile = path(api, "/interaction_profiles/khr/simple_controller").1;
    (suggest.count_suggested_bindings, suggest.suggested_bindings) = (2, bindings.as_ptr());
    xr_do!(
        api,
        SuggestInteractionProfileBindings(api.instance, &suggest)
    );
    let mut get: xr::ActionStateGetInfo = of(Type::ACTION_STATE_GET_INFO);
    get.action = click;
    let mut state: xr::ActionStateBoolean = of(Type::ACTION_STATE_BOOLEAN);
    checks.expect(
        "a set that is not attached",
        xr_call!(api, GetActionStateBoolean(session, &get, &mut state)),
        Code::ERROR_ACTIONSET_NOT_ATTACHED,
    );
    let mut attach: xr::SessionActionSetsAttachInfo = of(Type::SESSION_ACTION_SETS_ATTACH_INFO);
    checks.expect(
        "no sets",
        xr_call!(api, AttachSessionActionSets(session, &attach)),
        INVALID,
    );
    (attach.count_action_sets, attach.action_sets) = (1, &raw const set);
    checks.expect(
        "attached",
        xr_call!(api, AttachSessionActionSets(session, &attach)),
        DONE,
    );
    let attached = Code::ERROR_ACTIONSETS_ALREADY_ATTACHED;
    checks.expect(
        "attached twice",
        xr_call!(api, AttachSessionActionSets(session, &attach)),
        attached,
    );
    checks.expect(
        "suggested too late",
        xr_call!(
            api,
            SuggestInteractionProfileBindings(api.instance, &suggest)
        ),
        attached,
    );
    checks.expect(
        "created too late",
        make("late", xr::ActionType::BOOLEAN_INPUT).is_err(),
        true,
    );
    checks.expect(
        "synchronised",
        xr_call!(api, SyncActions(session, &sync)),
        DONE,
    );
    checks.expect(
        "a state",
        (
            xr_call!(api, GetActionStateBoolean(session, &get, &mut state)),
            state.is_active,
            state.current_state,
        ),
        (DONE, xr::TRUE, xr::FALSE),
    );
    get.action = grip;
    checks.expect(
        "a state of another type",
        xr_call!(api, GetActionStateBoolean(session, &get, &mut state)),
        Code::ERROR_ACTION_TYPE_MISMATCH,
    );
    get.subaction_path = path(api, "/user/hand/left").1;
    let mut pose: xr::ActionStatePose = of(Type::ACTION_STATE_POSE);
    checks.expect(
        "a hand that the action has not",
        xr_call!(api, GetActionStatePose(session, &get, &mut pose)),
        Code::ERROR_PATH_UNSUPPORTED,
    );
    get.subaction_path = xr::Path::NULL;
    checks.expect(
        "a pose",
        (
            xr_call!(api, GetActionStatePose(session, &get, &mut pose)),
            pose.is_active,
        ),
        (DONE, xr::TRUE),
    );
    let mut info: xr::ActionSpaceCreateInfo = of(Type::ACTION_SPACE_CREATE_INFO);
    (info.action, info.pose_in_action_space) = (click, xr::Posef::IDENTITY);
    let mut space = xr::Space::default();
    checks.expect(
        "a place of a click",
        xr_call!(api, CreateActionSpace(session, &info, &mut space)),
        Code::ERROR_ACTION_TYPE_MISMATCH,
    );
    info.action = grip;
    checks.expect(
        "a place of a hand",
        xr_call!(api, CreateActionSpace(session, &info, &mut space)),
        DONE,
    );
    let mut profile: xr::InteractionProfileState = of(Type::INTERACTION_PROFILE_STATE);
    let left = path(api, "/user/hand/left").1;
    checks.expect(
        "a profile",
        xr_call!(
            api,
            GetCurrentInteractionProfile(session, left, &mut profile)
        ),
        DONE,
    );
    checks.expect(
        "the simple one",
        profile.interaction_profile,
        suggest.interaction_profile,
    );
    let nose = path(api, "/user/nose").1;
    checks.expect(
        "a profile of no hand",
        xr_call!(
            api,
            GetCurrentInteractionProfile(session, nose, &mut profile)
        ),
        Code::ERROR_PATH_UNSUPPORTED,
    );
    Ok(())
}

fn masks(checks: &mut Checks, opened: &Opened) {
    let stereo = xr::ViewConfigurationType::PRIMARY_STEREO;
    let hidden = xr::VisibilityMaskTypeKHR::HIDDEN_TRIANGLE_MESH;
    let mut mask: xr::VisibilityMaskKHR = of(Type::VISIBILITY_MASK_KHR);
    let get = |view, kind, mask: &mut xr::VisibilityMaskKHR| {
        xr_call!(
            opened.api,
            GetVisibilityMaskKHR(opened.session, stereo, view, kind, mask)
        )
    };
    checks.expect("a third eye", get(2, hidden, &mut mask), INVALID);
    checks.expect(
        "a mask of no kind",
        get(0, xr::VisibilityMaskTypeKHR::from_raw(9), &mut mask),
        INVALID,
    );
    checks.expect("a mask counted", get(0, hidden, &mut mask), DONE);
    checks.expect(
        "triangles",
        mask.index_count_output >= 3 && mask.index_count_output.is_multiple_of(3),
        true,
    );
    let mut vertices = vec![xr::Vector2f { x: 0.0, y: 0.0 }; mask.vertex_count_output as usize];
    let mut indices = vec![0; mask.index_count_output as usize];
    (mask.vertex_capacity_input, mask.index_capacity_input) = (1, 1);
    (mask.vertices, mask.indices) = (vertices.as_mut_ptr(), indices.as_mut_ptr());
    checks.expect("a short mask", get(0, hidden, &mut mask), SIZE);
    (mask.vertex_capacity_input, mask.index_capacity_input) =
        (vertices.len() as u32, indices.len() as u32);
    checks.expect("a mask", get(0, hidden, &mut mask), DONE);
    checks.expect(
        "its indices",
        indices
            .iter()
            .all(|index| (*index as usize) < vertices.len()),
        true,
    );
}
