//! Reference spaces, spaces of actions, and where they are.

use crate::chain::{elements, find, input, output, values};
use crate::extensions::LOCAL_FLOOR;
use crate::negotiate::NEWEST;
use crate::pose::Pose;
use crate::state::{Code, DONE, INVALID, Instance};
use glam::DVec3;
use openxr_sys as xr;
use spool::openxr::PathSpace;
use xr::{Handle, ReferenceSpaceType, SpaceLocationFlags, StructureType};

/// A space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Space {
    origin: Origin,
    /// Pose relative to the origin.
    offset: Pose,
}

/// What a space stays with.
#[derive(Clone, Copy, Debug)]
enum Origin {
    Reference(ReferenceSpaceType),
    /// A pose of an action, of the left or the right hand.
    Action(u64, Option<usize>),
}

/// The controllers at rest, relative to the upright pose of the head at the start of its path.
const HANDS_M: [[f64; 3]; 2] = [[-0.2, -0.35, -0.4], [0.2, -0.35, -0.4]];

/// The flags of a pose that is known and tracked.
fn located_flags() -> SpaceLocationFlags {
    SpaceLocationFlags::ORIENTATION_VALID
        | SpaceLocationFlags::POSITION_VALID
        | SpaceLocationFlags::ORIENTATION_TRACKED
        | SpaceLocationFlags::POSITION_TRACKED
}

impl Instance {
    /// The types of reference spaces that the program may use.
    fn reference_spaces(&self) -> Vec<ReferenceSpaceType> {
        let floor = self.has(LOCAL_FLOOR, Some(NEWEST));
        let known = [
            ReferenceSpaceType::VIEW,
            ReferenceSpaceType::LOCAL,
            ReferenceSpaceType::STAGE,
        ];
        let more = floor.then_some(ReferenceSpaceType::LOCAL_FLOOR);
        known.into_iter().chain(more).collect()
    }

    /// The head in the space of its path.
    pub fn head(&self, time: xr::Time) -> Pose {
        let heads = &self.settings.heads;
        let (frame, part) =
            (self.session.as_ref()).map_or((0, 0.0), |session| session.frames.place(time));
        let at = |frame: usize| match heads.get(frame).or(heads.last()) {
            Some(pose) => Pose::of_settings(pose),
            None => Pose::IDENTITY,
        };
        at(frame).between(at(frame + 1), part)
    }

    /// The upright pose of the head at the start of its path, in the space of the path.
    fn start(&self) -> Pose {
        let first = self.settings.heads.first();
        first.map_or(Pose::IDENTITY, |pose| Pose::of_settings(pose).upright())
    }

    /// A type of reference space in the space of the head's path.
    fn reference(&self, kind: ReferenceSpaceType, time: xr::Time) -> Pose {
        let floor = DVec3::new(0.0, -self.settings.eye_height_m, 0.0);
        let down = Pose {
            place: floor,
            ..Pose::IDENTITY
        };
        let start = self.start();
        // Below the start of the path, on the floor of the stage.
        let below = Pose {
            place: DVec3::new(start.place.x, 0.0, start.place.z),
            ..start
        };
        match (self.settings.space, kind) {
            (_, ReferenceSpaceType::VIEW) => self.head(time),
            (PathSpace::Local, ReferenceSpaceType::LOCAL) => Pose::IDENTITY,
            (PathSpace::Local, _) => down,
            (PathSpace::Stage, ReferenceSpaceType::LOCAL) => start,
            (PathSpace::Stage, ReferenceSpaceType::LOCAL_FLOOR) => below,
            (PathSpace::Stage, _) => Pose::IDENTITY,
        }
    }

    /// A space in the space of the head's path; `None` for a controller that is not there.
    pub fn in_path(&self, space: &Space, time: xr::Time) -> Option<Pose> {
        let origin = match space.origin {
            Origin::Reference(kind) => self.reference(kind, time),
            Origin::Action(action, hand) => {
                let hand = self.actions.pose_hand(action, hand)?;
                let place = DVec3::from_array(HANDS_M[hand]);
                self.start().then(Pose {
                    place,
                    ..Pose::IDENTITY
                })
            }
        };
        Some(origin.then(space.offset))
    }

    fn space(&self, handle: xr::Space) -> Result<&Space, Code> {
        self.spaces
            .get(&handle.into_raw())
            .ok_or(Code::ERROR_HANDLE_INVALID)
    }

    /// A space in another one.
    fn located(
        &self,
        space: xr::Space,
        base: xr::Space,
        time: xr::Time,
    ) -> Result<(SpaceLocationFlags, xr::Posef), Code> {
        let poses = (
            self.in_path(self.space(space)?, time),
            self.in_path(self.space(base)?, time),
        );
        Ok(match poses {
            (Some(_), Some(_)) if space == base => (located_flags(), xr::Posef::IDENTITY),
            (Some(space), Some(base)) => (located_flags(), base.inverse().then(space).to_program()),
            _ => (SpaceLocationFlags::EMPTY, xr::Posef::IDENTITY),
        })
    }
}

pub(crate) fn check_time(time: xr::Time) -> Result<(), Code> {
    match time.as_nanos() {
        1.. => Ok(()),
        _ => Err(Code::ERROR_TIME_INVALID),
    }
}

/// Notes that velocities are not known.
///
/// # Safety
/// A valid chain.
unsafe fn deny_velocity(chain: *const std::ffi::c_void) {
    // SAFETY: as the caller promises.
    unsafe {
        if let Some(of) = find(chain, StructureType::SPACE_VELOCITY) {
            (*of.cast::<xr::SpaceVelocity>()).velocity_flags = xr::SpaceVelocityFlags::EMPTY;
        }
        if let Some(of) = find(chain, StructureType::SPACE_VELOCITIES) {
            let of = &*of.cast::<xr::SpaceVelocities>();
            for place in 0..of.velocity_count as usize {
                if !of.velocities.is_null() {
                    (*of.velocities.add(place)).velocity_flags = xr::SpaceVelocityFlags::EMPTY;
                }
            }
        }
    }
}

api! {
    fn enumerate_reference_spaces(session: xr::Session, capacity: u32, count: *mut u32, into: *mut ReferenceSpaceType) |state| {
        let known = state.of_session(session)?.reference_spaces();
        values(&known, capacity, count, into)
    }

    fn create_reference_space(session: xr::Session, info: *const xr::ReferenceSpaceCreateInfo, space: *mut xr::Space) |state| {
        let instance = state.of_session(session)?;
        let info = input(info, StructureType::REFERENCE_SPACE_CREATE_INFO)?;
        let space = space.as_mut().ok_or(INVALID)?;
        let kind = info.reference_space_type;
        if !instance.reference_spaces().contains(&kind) {
            return Err(Code::ERROR_REFERENCE_SPACE_UNSUPPORTED);
        }
        let made = Space {
            origin: Origin::Reference(kind),
            offset: Pose::of_program(&info.pose_in_reference_space)?,
        };
        let handle = state.handle();
        state.any_instance()?.spaces.insert(handle, made);
        *space = xr::Space::from_raw(handle);
        DONE
    }

    fn get_reference_space_bounds_rect(session: xr::Session, kind: ReferenceSpaceType, bounds: *mut xr::Extent2Df) |state| {
        let known = state.of_session(session)?.reference_spaces();
        let bounds = bounds.as_mut().ok_or(INVALID)?;
        if !known.contains(&kind) {
            return Err(Code::ERROR_REFERENCE_SPACE_UNSUPPORTED);
        }
        *bounds = xr::Extent2Df { width: 0.0, height: 0.0 };
        Ok(Code::SPACE_BOUNDS_UNAVAILABLE)
    }

    fn create_action_space(session: xr::Session, info: *const xr::ActionSpaceCreateInfo, space: *mut xr::Space) |state| {
        let instance = state.of_session(session)?;
        let info = input(info, StructureType::ACTION_SPACE_CREATE_INFO)?;
        let space = space.as_mut().ok_or(INVALID)?;
        let action = instance.actions.typed(info.action, xr::ActionType::POSE_INPUT)?;
        let hand = instance.actions.hand(action, info.subaction_path, &instance.paths)?;
        let made = Space {
            origin: Origin::Action(info.action.into_raw(), hand),
            offset: Pose::of_program(&info.pose_in_action_space)?,
        };
        let handle = state.handle();
        state.any_instance()?.spaces.insert(handle, made);
        *space = xr::Space::from_raw(handle);
        DONE
    }

    fn destroy_space(space: xr::Space) |state| {
        let removed = state.any_instance()?.spaces.remove(&space.into_raw());
        removed.map(|_| Code::SUCCESS).ok_or(Code::ERROR_HANDLE_INVALID)
    }

    fn locate_space(space: xr::Space, base: xr::Space, time: xr::Time, location: *mut xr::SpaceLocation) |state| {
        let instance = state.any_instance()?;
        instance.space(space)?;
        instance.space(base)?;
        let location = output(location, StructureType::SPACE_LOCATION)?;
        check_time(time)?;
        (location.location_flags, location.pose) = instance.located(space, base, time)?;
        deny_velocity(location.next);
        DONE
    }

    fn locate_spaces(session: xr::Session, info: *const xr::SpacesLocateInfo, locations: *mut xr::SpaceLocations) |state| {
        let instance = state.of_session(session)?;
        let info = input(info, StructureType::SPACES_LOCATE_INFO)?;
        let locations = output(locations, StructureType::SPACE_LOCATIONS)?;
        check_time(info.time)?;
        instance.space(info.base_space)?;
        let spaces = elements(info.spaces, info.space_count)?;
        let into = elements(locations.locations, locations.location_count)?.len();
        if spaces.is_empty() || into != spaces.len() {
            return Err(INVALID);
        }
        for (place, space) in spaces.iter().enumerate() {
            let (location_flags, pose) = instance.located(*space, info.base_space, info.time)?;
            *locations.locations.add(place) = xr::SpaceLocationData { location_flags, pose };
        }
        deny_velocity(locations.next);
        DONE
    }
}
