//! Actions: one controller in each hand, at rest.

use crate::chain::{elements, input, output, taken, text, values};
use crate::paths::{Paths, is_component};
use crate::state::{Answer, Code, DONE, Event, INVALID, State};
use openxr_sys as xr;
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::ffi::c_char;
use xr::{ActionType, Handle, SessionState, StructureType};

/// The controllers that are there.
const PROFILE: &str = "/interaction_profiles/khr/simple_controller";
const HANDS: [&str; 2] = ["/user/hand/left", "/user/hand/right"];
/// Inputs and outputs of a controller, with their names.
const PARTS: [(&str, &str); 8] = [
    ("/input/select/click", "Select"),
    ("/input/select", "Select"),
    ("/input/menu/click", "Menu"),
    ("/input/menu", "Menu"),
    ("/input/grip/pose", "Grip"),
    ("/input/aim/pose", "Aim"),
    ("/input/grip_surface/pose", "Palm"),
    ("/output/haptic", "Haptic"),
];
/// Interaction profiles of the specification for which programs may suggest bindings.
const PROFILES: [&str; 24] = [
    "bytedance/pico4_controller",
    "bytedance/pico_g3_controller",
    "bytedance/pico_neo3_controller",
    "google/daydream_controller",
    "hp/mixed_reality_controller",
    "htc/vive_controller",
    "htc/vive_cosmos_controller",
    "htc/vive_focus3_controller",
    "htc/vive_pro",
    "khr/simple_controller",
    "meta/touch_controller_quest_1_rift_s",
    "meta/touch_controller_quest_2",
    "meta/touch_controller_rift_cv1",
    "meta/touch_plus_controller",
    "meta/touch_pro_controller",
    "microsoft/motion_controller",
    "microsoft/xbox_controller",
    "ml/ml2_controller",
    "oculus/go_controller",
    "oculus/touch_controller",
    "samsung/odyssey_controller",
    "valve/index_controller",
    "facebook/touch_controller_pro",
    "ext/hand_interaction_ext",
];

const TYPES: [ActionType; 5] = [
    ActionType::BOOLEAN_INPUT,
    ActionType::FLOAT_INPUT,
    ActionType::VECTOR2F_INPUT,
    ActionType::POSE_INPUT,
    ActionType::VIBRATION_OUTPUT,
];

struct ActionSet {
    name: String,
    localized: String,
    attached: bool,
}

/// An action.
pub(crate) struct Action {
    set: u64,
    name: String,
    localized: String,
    kind: ActionType,
    subactions: Vec<xr::Path>,
}

/// Sets of actions, actions and bindings.
#[derive(Default)]
pub(crate) struct Actions {
    sets: HashMap<u64, ActionSet>,
    actions: HashMap<u64, Action>,
    /// Action, hand and part of the controller of each suggested binding.
    bindings: Vec<(u64, usize, &'static str)>,
    /// Whether the session has its action sets.
    attached: bool,
    /// Whether the program has synchronised them once, and whether it last had the focus.
    synchronised: bool,
    active: bool,
}

/// The hand and the part of a controller that a path names.
fn part(path: &str) -> Option<(usize, &'static str)> {
    let (hand, rest) = (HANDS.iter().enumerate())
        .find_map(|(hand, user)| Some((hand, path.strip_prefix(user)?)))?;
    let found = PARTS.iter().find(|(part, _)| *part == rest)?;
    Some((hand, found.0))
}

impl Actions {
    /// Forgets what belonged to the session.
    pub fn detach(&mut self) {
        (self.attached, self.synchronised, self.active) = (false, false, false);
        self.sets.values_mut().for_each(|set| set.attached = false);
    }

    fn of(&self, action: xr::Action) -> Result<&Action, Code> {
        self.actions
            .get(&action.into_raw())
            .ok_or(Code::ERROR_HANDLE_INVALID)
    }

    /// An action of a type.
    pub fn typed(&self, action: xr::Action, kind: ActionType) -> Result<&Action, Code> {
        let found = self.of(action)?;
        match found.kind == kind {
            true => Ok(found),
            false => Err(Code::ERROR_ACTION_TYPE_MISMATCH),
        }
    }

    /// The hand that a path names, which must be one of the action's; `None` for no path.
    pub fn hand(
        &self,
        action: &Action,
        path: xr::Path,
        paths: &Paths,
    ) -> Result<Option<usize>, Code> {
        if path == xr::Path::NULL {
            return Ok(None);
        }
        let text = paths.text(path)?;
        match action.subactions.contains(&path) {
            true => Ok(HANDS.iter().position(|hand| *hand == text)),
            false => Err(Code::ERROR_PATH_UNSUPPORTED),
        }
    }

    /// Bindings of an action, of one hand or of any.
    fn bound(
        &self,
        action: u64,
        hand: Option<usize>,
    ) -> impl Iterator<Item = &(u64, usize, &'static str)> {
        let of = move |(of, on, _): &&(u64, usize, &'static str)| {
            *of == action && hand.is_none_or(|hand| hand == *on)
        };
        self.bindings.iter().filter(of)
    }

    fn is_active(&self, action: u64, hand: Option<usize>) -> bool {
        let set = self
            .actions
            .get(&action)
            .and_then(|action| self.sets.get(&action.set));
        let attached = set.is_some_and(|set| set.attached);
        attached && self.active && self.bound(action, hand).next().is_some()
    }

    /// The hand whose pose an action has, if it is active.
    pub fn pose_hand(&self, action: u64, hand: Option<usize>) -> Option<usize> {
        let found = self.bound(action, hand).map(|(_, hand, _)| *hand).min();
        found.filter(|_| self.is_active(action, hand))
    }
}

/// Checks a name and its text for users.
fn check_names(name: &str, localized: &str) -> Result<(), Code> {
    match (name.is_empty(), localized.is_empty()) {
        (true, _) => Err(Code::ERROR_NAME_INVALID),
        (_, true) => Err(Code::ERROR_LOCALIZED_NAME_INVALID),
        _ if !is_component(name) => Err(Code::ERROR_PATH_FORMAT_INVALID),
        _ => Ok(()),
    }
}

/// Whether an action of a type is active, after all checks of a query.
unsafe fn query(
    state: &mut State,
    session: xr::Session,
    info: *const xr::ActionStateGetInfo,
    kind: ActionType,
) -> Result<bool, Code> {
    let instance = state.of_session(session)?;
    // SAFETY: a valid call of a query.
    let info = unsafe { input(info, StructureType::ACTION_STATE_GET_INFO) }?;
    let action = instance.actions.typed(info.action, kind)?;
    let hand = instance
        .actions
        .hand(action, info.subaction_path, &instance.paths)?;
    let attached = instance
        .actions
        .sets
        .get(&action.set)
        .is_some_and(|set| set.attached);
    match attached {
        true => Ok(instance.actions.is_active(info.action.into_raw(), hand)),
        false => Err(Code::ERROR_ACTIONSET_NOT_ATTACHED),
    }
}

/// Checks a vibration.
unsafe fn haptic(
    state: &mut State,
    session: xr::Session,
    info: *const xr::HapticActionInfo,
) -> Answer {
    let instance = state.of_session(session)?;
    // SAFETY: a valid call of a function for vibrations.
    let info = unsafe { input(info, StructureType::HAPTIC_ACTION_INFO) }?;
    let action = instance
        .actions
        .typed(info.action, ActionType::VIBRATION_OUTPUT)?;
    instance
        .actions
        .hand(action, info.subaction_path, &instance.paths)?;
    match instance.actions.sets.get(&action.set) {
        Some(set) if set.attached => {}
        _ => return Err(Code::ERROR_ACTIONSET_NOT_ATTACHED),
    }
    let focused = instance
        .session
        .as_ref()
        .is_some_and(|session| session.state == SessionState::FOCUSED);
    Ok(if focused {
        Code::SUCCESS
    } else {
        Code::SESSION_NOT_FOCUSED
    })
}

/// Time of the last change of something that never changes.
fn never() -> xr::Time {
    xr::Time::from_nanos(0)
}

api! {
    fn create_action_set(instance: xr::Instance, info: *const xr::ActionSetCreateInfo, set: *mut xr::ActionSet) |state| {
        let actions = &state.instance(instance)?.actions;
        let info = input(info, StructureType::ACTION_SET_CREATE_INFO)?;
        let set = set.as_mut().ok_or(INVALID)?;
        let (name, localized) = (taken(&info.action_set_name)?, taken(&info.localized_action_set_name)?);
        check_names(&name, &localized)?;
        if actions.sets.values().any(|of| of.name == name) {
            return Err(Code::ERROR_NAME_DUPLICATED);
        }
        if actions.sets.values().any(|of| of.localized == localized) {
            return Err(Code::ERROR_LOCALIZED_NAME_DUPLICATED);
        }
        let handle = state.handle();
        let made = ActionSet { name, localized, attached: false };
        state.any_instance()?.actions.sets.insert(handle, made);
        *set = xr::ActionSet::from_raw(handle);
        DONE
    }

    fn destroy_action_set(set: xr::ActionSet) |state| {
        let actions = &mut state.any_instance()?.actions;
        actions.sets.remove(&set.into_raw()).ok_or(Code::ERROR_HANDLE_INVALID)?;
        actions.actions.retain(|_, action| action.set != set.into_raw());
        DONE
    }

    fn create_action(set: xr::ActionSet, info: *const xr::ActionCreateInfo, action: *mut xr::Action) |state| {
        let instance = state.any_instance()?;
        let of = instance.actions.sets.get(&set.into_raw()).ok_or(Code::ERROR_HANDLE_INVALID)?;
        let info = input(info, StructureType::ACTION_CREATE_INFO)?;
        let action = action.as_mut().ok_or(INVALID)?;
        if of.attached {
            return Err(Code::ERROR_ACTIONSETS_ALREADY_ATTACHED);
        }
        let (name, localized) = (taken(&info.action_name)?, taken(&info.localized_action_name)?);
        check_names(&name, &localized)?;
        if !TYPES.contains(&info.action_type) {
            return Err(INVALID);
        }
        let subactions = elements(info.subaction_paths, info.count_subaction_paths)?.to_vec();
        for (place, path) in subactions.iter().enumerate() {
            let text = instance.paths.text(*path)?;
            let known = HANDS.contains(&text) || ["/user/head", "/user/gamepad", "/user/treadmill"].contains(&text);
            if !known || subactions[..place].contains(path) {
                return Err(Code::ERROR_PATH_UNSUPPORTED);
            }
        }
        let mut others = instance.actions.actions.values().filter(|of| of.set == set.into_raw());
        match others.find(|of| of.name == name || of.localized == localized) {
            Some(of) if of.name == name => return Err(Code::ERROR_NAME_DUPLICATED),
            Some(_) => return Err(Code::ERROR_LOCALIZED_NAME_DUPLICATED),
            None => {}
        }
        let made = Action { set: set.into_raw(), name, localized, kind: info.action_type, subactions };
        let handle = state.handle();
        state.any_instance()?.actions.actions.insert(handle, made);
        *action = xr::Action::from_raw(handle);
        DONE
    }

    fn destroy_action(action: xr::Action) |state| {
        match state.any_instance()?.actions.actions.entry(action.into_raw()) {
            Entry::Occupied(found) => drop(found.remove()),
            Entry::Vacant(_) => return Err(Code::ERROR_HANDLE_INVALID),
        }
        DONE
    }

    fn suggest_interaction_profile_bindings(instance: xr::Instance, info: *const xr::InteractionProfileSuggestedBinding) |state| {
        let instance = state.instance(instance)?;
        let info = input(info, StructureType::INTERACTION_PROFILE_SUGGESTED_BINDING)?;
        let profile = instance.paths.text(info.interaction_profile)?;
        let known = profile.strip_prefix("/interaction_profiles/").is_some_and(|rest| PROFILES.contains(&rest));
        if !known {
            return Err(Code::ERROR_PATH_UNSUPPORTED);
        }
        let suggested = elements(info.suggested_bindings, info.count_suggested_bindings)?;
        if suggested.is_empty() {
            return Err(INVALID);
        }
        let is_ours = profile == PROFILE;
        let mut bindings = Vec::new();
        for binding in suggested {
            let action = instance.actions.of(binding.action)?;
            if instance.actions.sets.get(&action.set).is_none_or(|set| set.attached) {
                return Err(Code::ERROR_ACTIONSETS_ALREADY_ATTACHED);
            }
            let path = instance.paths.text(binding.binding)?;
            match part(path) {
                Some((hand, part)) if is_ours => bindings.push((binding.action.into_raw(), hand, part)),
                _ if is_ours || !path.starts_with("/user/") => return Err(Code::ERROR_PATH_UNSUPPORTED),
                _ => {}
            }
        }
        if is_ours {
            instance.actions.bindings = bindings;
        }
        DONE
    }

    fn attach_session_action_sets(session: xr::Session, info: *const xr::SessionActionSetsAttachInfo) |state| {
        let actions = &mut state.of_session(session)?.actions;
        let info = input(info, StructureType::SESSION_ACTION_SETS_ATTACH_INFO)?;
        let sets = elements(info.action_sets, info.count_action_sets)?;
        if sets.is_empty() {
            return Err(INVALID);
        }
        if sets.iter().any(|set| !actions.sets.contains_key(&set.into_raw())) {
            return Err(Code::ERROR_HANDLE_INVALID);
        }
        if std::mem::replace(&mut actions.attached, true) {
            return Err(Code::ERROR_ACTIONSETS_ALREADY_ATTACHED);
        }
        for set in sets {
            if let Some(of) = actions.sets.get_mut(&set.into_raw()) {
                of.attached = true;
            }
        }
        DONE
    }

    fn get_current_interaction_profile(session: xr::Session, user: xr::Path, profile: *mut xr::InteractionProfileState) |state| {
        let instance = state.of_session(session)?;
        let profile = output(profile, StructureType::INTERACTION_PROFILE_STATE)?;
        let text = instance.paths.text(user)?;
        if !instance.actions.attached {
            return Err(Code::ERROR_ACTIONSET_NOT_ATTACHED);
        }
        let hand = HANDS.iter().position(|hand| *hand == text);
        let others = ["/user/head", "/user/gamepad", "/user/treadmill"];
        if hand.is_none() && !others.contains(&text) {
            return Err(Code::ERROR_PATH_UNSUPPORTED);
        }
        let bound = hand.is_some() && instance.actions.synchronised && !instance.actions.bindings.is_empty();
        profile.interaction_profile = if bound { instance.paths.of(PROFILE) } else { xr::Path::NULL };
        DONE
    }

    fn get_action_state_boolean(session: xr::Session, info: *const xr::ActionStateGetInfo, of: *mut xr::ActionStateBoolean) |state| {
        let active = query(state, session, info, ActionType::BOOLEAN_INPUT)?;
        let of = output(of, StructureType::ACTION_STATE_BOOLEAN)?;
        (of.current_state, of.changed_since_last_sync, of.last_change_time) = (xr::FALSE, xr::FALSE, never());
        of.is_active = active.into();
        DONE
    }

    fn get_action_state_float(session: xr::Session, info: *const xr::ActionStateGetInfo, of: *mut xr::ActionStateFloat) |state| {
        let active = query(state, session, info, ActionType::FLOAT_INPUT)?;
        let of = output(of, StructureType::ACTION_STATE_FLOAT)?;
        (of.current_state, of.changed_since_last_sync, of.last_change_time) = (0.0, xr::FALSE, never());
        of.is_active = active.into();
        DONE
    }

    fn get_action_state_vector2f(session: xr::Session, info: *const xr::ActionStateGetInfo, of: *mut xr::ActionStateVector2f) |state| {
        let active = query(state, session, info, ActionType::VECTOR2F_INPUT)?;
        let of = output(of, StructureType::ACTION_STATE_VECTOR2F)?;
        of.current_state = xr::Vector2f { x: 0.0, y: 0.0 };
        (of.changed_since_last_sync, of.last_change_time) = (xr::FALSE, never());
        of.is_active = active.into();
        DONE
    }

    fn get_action_state_pose(session: xr::Session, info: *const xr::ActionStateGetInfo, of: *mut xr::ActionStatePose) |state| {
        let active = query(state, session, info, ActionType::POSE_INPUT)?;
        output(of, StructureType::ACTION_STATE_POSE)?.is_active = active.into();
        DONE
    }

    fn sync_actions(session: xr::Session, info: *const xr::ActionsSyncInfo) |state| {
        let instance = state.of_session(session)?;
        let info = input(info, StructureType::ACTIONS_SYNC_INFO)?;
        for active in elements(info.active_action_sets, info.count_active_action_sets)? {
            let set = instance.actions.sets.get(&active.action_set.into_raw());
            if !set.ok_or(Code::ERROR_HANDLE_INVALID)?.attached {
                return Err(Code::ERROR_ACTIONSET_NOT_ATTACHED);
            }
            if active.subaction_path != xr::Path::NULL {
                let text = instance.paths.text(active.subaction_path)?;
                let set = active.action_set.into_raw();
                let mut of = instance.actions.actions.values().filter(|action| action.set == set);
                if !text.starts_with("/user/") || !of.any(|action| action.subactions.contains(&active.subaction_path)) {
                    return Err(Code::ERROR_PATH_UNSUPPORTED);
                }
            }
        }
        let focused = instance.session.as_ref().is_some_and(|session| session.state == SessionState::FOCUSED);
        instance.actions.active = focused;
        if !focused {
            return Ok(Code::SESSION_NOT_FOCUSED);
        }
        let bound = !instance.actions.bindings.is_empty();
        if !std::mem::replace(&mut instance.actions.synchronised, true) && bound {
            instance.events.push_back(Event::Profile(session));
        }
        DONE
    }

    fn enumerate_bound_sources_for_action(
        session: xr::Session, info: *const xr::BoundSourcesForActionEnumerateInfo, capacity: u32, count: *mut u32,
        into: *mut xr::Path,
    ) |state| {
        let instance = state.of_session(session)?;
        let info = input(info, StructureType::BOUND_SOURCES_FOR_ACTION_ENUMERATE_INFO)?;
        let action = instance.actions.of(info.action)?;
        if instance.actions.sets.get(&action.set).is_none_or(|set| !set.attached) {
            return Err(Code::ERROR_ACTIONSET_NOT_ATTACHED);
        }
        let bound = instance.actions.bound(info.action.into_raw(), None);
        let texts: Vec<String> = bound.map(|(_, hand, part)| format!("{}{part}", HANDS[*hand])).collect();
        let paths: Vec<xr::Path> = texts.iter().map(|text| instance.paths.of(text)).collect();
        values(&paths, capacity, count, into)
    }

    fn get_input_source_localized_name(
        session: xr::Session, info: *const xr::InputSourceLocalizedNameGetInfo, capacity: u32, count: *mut u32,
        buffer: *mut c_char,
    ) |state| {
        let instance = state.of_session(session)?;
        let info = input(info, StructureType::INPUT_SOURCE_LOCALIZED_NAME_GET_INFO)?;
        let path = instance.paths.text(info.source_path)?;
        if !instance.actions.attached {
            return Err(Code::ERROR_ACTIONSET_NOT_ATTACHED);
        }
        if info.which_components.is_empty() {
            return Err(INVALID);
        }
        let (hand, part) = part(path).ok_or(Code::ERROR_PATH_UNSUPPORTED)?;
        let name = PARTS.iter().find(|(of, _)| *of == part).map_or("", |(_, name)| name);
        let flags = info.which_components;
        let words = [
            (xr::InputSourceLocalizedNameFlags::USER_PATH, ["Left hand", "Right hand"][hand]),
            (xr::InputSourceLocalizedNameFlags::INTERACTION_PROFILE, "Simple controller"),
            (xr::InputSourceLocalizedNameFlags::COMPONENT, name),
        ];
        let words = words.into_iter().filter(|(flag, _)| flags.contains(*flag)).map(|(_, word)| word);
        text(&words.collect::<Vec<_>>().join(" "), capacity, count, buffer)
    }

    fn apply_haptic_feedback(session: xr::Session, info: *const xr::HapticActionInfo, feedback: *const xr::HapticBaseHeader) |state| {
        if feedback.is_null() {
            return Err(INVALID);
        }
        haptic(state, session, info)
    }

    fn stop_haptic_feedback(session: xr::Session, info: *const xr::HapticActionInfo) |state| {
        haptic(state, session, info)
    }
}
