//! Where the eyes are, and their fields of view.

use crate::chain::{input, output, structures};
use crate::pose::Pose;
use crate::spaces::check_time;
use crate::state::{Code, DONE, INVALID};
use crate::system::check_views;
use openxr_sys as xr;
use spool::openxr::DisplayEye;
use xr::{Handle, StructureType, ViewStateFlags};

/// The angles of an eye's field of view, from its tangents.
fn fov(eye: &DisplayEye) -> xr::Fovf {
    let [left, right, up, down] = eye.tangents.map(|tangent| f64::from(tangent).atan() as f32);
    xr::Fovf {
        angle_left: -left,
        angle_right: right,
        angle_up: up,
        angle_down: -down,
    }
}

api! {
    fn locate_views(
        session: xr::Session, info: *const xr::ViewLocateInfo, found: *mut xr::ViewState, capacity: u32, count: *mut u32,
        into: *mut xr::View,
    ) |state| {
        let instance = state.of_session(session)?;
        let info = input(info, StructureType::VIEW_LOCATE_INFO)?;
        let found = output(found, StructureType::VIEW_STATE)?;
        check_views(info.view_configuration_type)?;
        let space = instance.spaces.get(&info.space.into_raw()).ok_or(Code::ERROR_HANDLE_INVALID)?;
        check_time(info.display_time)?;
        if count.is_null() {
            return Err(INVALID);
        }
        let base = instance.in_path(space, info.display_time);
        let known = ViewStateFlags::ORIENTATION_VALID | ViewStateFlags::POSITION_VALID;
        let tracked = ViewStateFlags::ORIENTATION_TRACKED | ViewStateFlags::POSITION_TRACKED;
        found.view_state_flags = match base {
            Some(_) => known | tracked,
            None => ViewStateFlags::EMPTY,
        };
        let head = instance.head(info.display_time);
        let eyes = &instance.settings.eyes;
        structures(eyes.len(), StructureType::VIEW, capacity, count, into, |place, view| {
            let eye = head.then(Pose::of_settings(&eyes[place].in_head));
            let pose = base.map_or(Pose::IDENTITY, |base| base.inverse().then(eye));
            (view.pose, view.fov) = (pose.to_program(), fov(&eyes[place]));
        })?;
        DONE
    }
}
