//! Actions and visibility masks.

use super::*;

pub(super) fn actions(checks: &mut Checks, opened: &Opened) -> Result<()> {
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

pub(super) fn masks(checks: &mut Checks, opened: &Opened) {
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
