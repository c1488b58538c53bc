//! Sessions and their states.

use crate::chain::{find, input};
use crate::extensions::HEADLESS;
use crate::frames::Frames;
use crate::graphics::Graphics;
use crate::opengl::Context;
use crate::state::{BEGUN, Code, DONE, Event, INVALID, Instance};
use crate::system::{check_system, check_views};
use crate::vulkan::Device;
use openxr_sys as xr;
use xr::{Handle, SessionState, StructureType};

/// A session. An instance has one at a time.
pub(crate) struct Session {
    pub handle: xr::Session,
    pub graphics: Graphics,
    pub state: SessionState,
    /// Between xrBeginSession and xrEndSession.
    pub running: bool,
    /// Whether the program or the runtime asked for the end.
    pub exiting: bool,
    pub frames: Frames,
}

impl Instance {
    /// Moves the session through states, with an event for each.
    pub fn change_state(&mut self, states: &[SessionState]) {
        let Some(session) = &mut self.session else {
            return;
        };
        let time = session.frames.now();
        for state in states {
            session.state = *state;
            (self.events).push_back(Event::State(session.handle, *state, time));
        }
    }

    /// Asks the program to end the session.
    pub fn request_exit(&mut self) {
        let Some(session) = &mut self.session else {
            return;
        };
        if std::mem::replace(&mut session.exiting, true) {
            return;
        }
        let down = [
            SessionState::VISIBLE,
            SessionState::SYNCHRONIZED,
            SessionState::STOPPING,
        ];
        let first = match session.state {
            SessionState::FOCUSED => 0,
            SessionState::VISIBLE => 1,
            _ => 2,
        };
        self.change_state(&down[first..]);
    }

    /// Destroys the session and what belongs to it.
    pub fn drop_session(&mut self) {
        self.swapchains.clear();
        self.spaces.clear();
        self.actions.detach();
        self.session = None;
        let of_session = |event: &Event| matches!(event, Event::State(..) | Event::Profile(_));
        self.events.retain(|event| !of_session(event));
    }
}

api! {
    fn create_session(handle: xr::Instance, info: *const xr::SessionCreateInfo, session: *mut xr::Session) |state| {
        let instance = state.instance(handle)?;
        let info = input(info, StructureType::SESSION_CREATE_INFO)?;
        let session = session.as_mut().ok_or(INVALID)?;
        check_system(info.system_id)?;
        if info.create_flags != xr::SessionCreateFlags::EMPTY {
            return Err(INVALID);
        }
        let vulkan = find(info.next, StructureType::GRAPHICS_BINDING_VULKAN_KHR);
        let opengl = find(info.next, StructureType::GRAPHICS_BINDING_OPENGL_XLIB_KHR);
        let graphics = match (vulkan, opengl) {
            (Some(binding), _) => Graphics::Vulkan(Device::of_binding(&instance.vulkan, &*binding.cast())?),
            (_, Some(binding)) => Graphics::OpenGl(Context::of_binding(instance.asked_for_opengl, &*binding.cast())?),
            _ if instance.has(HEADLESS, None) => Graphics::None,
            _ => return Err(Code::ERROR_GRAPHICS_DEVICE_INVALID),
        };
        if instance.session.is_some() {
            return Err(Code::ERROR_LIMIT_REACHED);
        }
        let made = xr::Session::from_raw(state.handle());
        let instance = state.instance(handle)?;
        instance.session = Some(Session {
            handle: made,
            graphics,
            state: SessionState::IDLE,
            running: false,
            exiting: false,
            frames: Frames::new(instance.settings.frame_ns),
        });
        instance.change_state(&[SessionState::IDLE, SessionState::READY]);
        *session = made;
        DONE
    }

    fn destroy_session(session: xr::Session) |state| {
        state.of_session(session)?.drop_session();
        BEGUN.notify_all();
        DONE
    }

    fn begin_session(session: xr::Session, info: *const xr::SessionBeginInfo) |state| {
        let instance = state.of_session(session)?;
        let info = input(info, StructureType::SESSION_BEGIN_INFO)?;
        let session = instance.session.as_mut().ok_or(INVALID)?;
        if session.running {
            return Err(Code::ERROR_SESSION_RUNNING);
        }
        if session.state != SessionState::READY {
            return Err(Code::ERROR_SESSION_NOT_READY);
        }
        check_views(info.primary_view_configuration_type)?;
        session.running = true;
        session.frames.restart();
        // A session without pictures needs no frames.
        if matches!(session.graphics, Graphics::None) {
            instance.change_state(&UP);
        }
        DONE
    }

    fn end_session(session: xr::Session) |state| {
        let instance = state.of_session(session)?;
        let session = instance.session.as_mut().ok_or(INVALID)?;
        if !session.running {
            return Err(Code::ERROR_SESSION_NOT_RUNNING);
        }
        if session.state != SessionState::STOPPING {
            return Err(Code::ERROR_SESSION_NOT_STOPPING);
        }
        session.running = false;
        instance.change_state(&[SessionState::IDLE, SessionState::EXITING]);
        BEGUN.notify_all();
        DONE
    }

    fn request_exit_session(session: xr::Session) |state| {
        let instance = state.of_session(session)?;
        if !instance.session.as_ref().is_some_and(|session| session.running) {
            return Err(Code::ERROR_SESSION_NOT_RUNNING);
        }
        instance.request_exit();
        DONE
    }
}

/// The states of a session whose program runs its loop of frames.
pub(crate) const UP: [SessionState; 3] = [
    SessionState::SYNCHRONIZED,
    SessionState::VISIBLE,
    SessionState::FOCUSED,
];
