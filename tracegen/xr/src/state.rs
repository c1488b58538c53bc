//! What a program has created, and the lock around it.

use crate::actions::Actions;
use crate::paths::Paths;
use crate::session::Session;
use crate::spaces::Space;
use crate::swapchains::Swapchain;
use crate::vulkan::Vulkan;
use openxr_sys as xr;
use spool::openxr::RuntimeSettings;
use std::collections::{HashMap, HashSet, VecDeque};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

/// A code of success or of an error.
pub(crate) type Code = xr::Result;
/// What a function answers.
pub(crate) type Answer = Result<Code, Code>;

pub(crate) const DONE: Answer = Ok(Code::SUCCESS);
pub(crate) const INVALID: Code = Code::ERROR_VALIDATION_FAILURE;

/// An event that the program has not polled.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Event {
    State(xr::Session, xr::SessionState, xr::Time),
    Profile(xr::Session),
}

/// A program's instance and everything below it. A process has one instance at a time.
pub(crate) struct Instance {
    pub handle: u64,
    pub settings: RuntimeSettings,
    pub version: xr::Version,
    pub extensions: HashSet<&'static str>,
    pub events: VecDeque<Event>,
    pub paths: Paths,
    pub vulkan: Vulkan,
    /// Whether the program has asked for the versions of OpenGL that the runtime supports.
    pub asked_for_opengl: bool,
    pub session: Option<Session>,
    pub spaces: HashMap<u64, Space>,
    pub swapchains: HashMap<u64, Swapchain>,
    pub actions: Actions,
    pub messengers: HashSet<u64>,
}

/// The state of the process.
#[derive(Default)]
pub(crate) struct State {
    /// Number of handles that have been given out.
    handles: u64,
    pub instance: Option<Instance>,
}

static STATE: Mutex<Option<State>> = Mutex::new(None);
/// Signalled when a frame has begun, or no frame will begin.
pub(crate) static BEGUN: Condvar = Condvar::new();

/// The locked state.
pub(crate) type Locked = MutexGuard<'static, Option<State>>;

pub(crate) fn locked() -> Locked {
    STATE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Runs a function of the runtime under the lock.
pub(crate) fn answer(function: impl FnOnce(&mut State) -> Answer) -> Code {
    let mut state = locked();
    function(state.get_or_insert_default()).unwrap_or_else(|error| error)
}

/// Defines functions of the runtime. Each runs under the lock.
macro_rules! api {
    ($(fn $name:ident($($argument:ident: $type:ty),* $(,)?) |$state:ident| $body:block)*) => {$(
        #[allow(unused_unsafe)]
        pub(crate) unsafe extern "system" fn $name($($argument: $type),*) -> $crate::state::Code {
            // SAFETY: a valid call of the OpenXR function of this name, as far as it is not checked here.
            $crate::state::answer(|$state| unsafe { $body })
        }
    )*};
}

impl State {
    /// The next handle. A handle is never given out twice.
    pub fn handle(&mut self) -> u64 {
        self.handles += 1;
        self.handles
    }

    pub fn instance(&mut self, handle: xr::Instance) -> Result<&mut Instance, Code> {
        let found = self.instance.as_mut();
        found
            .filter(|instance| instance.handle == xr::Handle::into_raw(handle))
            .ok_or(Code::ERROR_HANDLE_INVALID)
    }

    /// The instance of a session.
    pub fn of_session(&mut self, handle: xr::Session) -> Result<&mut Instance, Code> {
        let found = self.instance.as_mut();
        found
            .filter(|instance| {
                let session = instance.session.as_ref();
                session.is_some_and(|session| session.handle == handle)
            })
            .ok_or(Code::ERROR_HANDLE_INVALID)
    }

    pub fn session(&mut self, handle: xr::Session) -> Result<&mut Session, Code> {
        let found = self.of_session(handle)?.session.as_mut();
        found.ok_or(Code::ERROR_HANDLE_INVALID)
    }

    pub fn any_instance(&mut self) -> Result<&mut Instance, Code> {
        self.instance.as_mut().ok_or(Code::ERROR_HANDLE_INVALID)
    }

    pub fn swapchain(&mut self, handle: xr::Swapchain) -> Result<&mut Swapchain, Code> {
        let found = (self.any_instance()?.swapchains).get_mut(&xr::Handle::into_raw(handle));
        found.ok_or(Code::ERROR_HANDLE_INVALID)
    }
}

impl Instance {
    /// Whether a program may use something that an extension or a version of the core adds.
    pub fn has(&self, extension: &str, core: Option<xr::Version>) -> bool {
        self.extensions.contains(extension) || core.is_some_and(|core| self.version >= core)
    }
}
