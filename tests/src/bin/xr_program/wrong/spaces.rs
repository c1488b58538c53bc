//! Reference spaces and views.

use super::*;

pub(super) fn spaces(checks: &mut Checks, opened: &Opened) -> Result<()> {
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
