//! Calls with a session: its states and frames.

use super::actions::{actions, masks};
use super::spaces::spaces;
use super::swapchains::{release, swapchains};
use super::*;

pub(super) fn with_session(checks: &mut Checks) -> Result<()> {
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
