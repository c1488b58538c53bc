//! The loop of frames, and the virtual clock.

use crate::chain::{elements, find, input, output};
use crate::extensions::DEPTH;
use crate::pose::Pose;
use crate::recorder;
use crate::session::UP;
use crate::state::{Answer, BEGUN, Code, DONE, INVALID, Instance, answer, locked};
use crate::swapchains::Shown;
use crate::system::MOST_LAYERS;
use openxr_sys as xr;
use spool::openxr::ShownView;
use std::sync::PoisonError;
use xr::{Handle, SessionState, StructureType};

/// Time of the first frame, in nanoseconds. The clock does not follow that of the machine, so that a program that
/// takes its time from the runtime runs in the same way every time.
const START_NS: i64 = 1_000_000_000;

/// Counters of frames.
#[derive(Debug)]
pub(crate) struct Frames {
    frame_ns: i64,
    /// Number of xrWaitFrame calls in all.
    clock: i64,
    /// Number of xrWaitFrame calls that no xrBeginFrame has followed.
    waiting: u32,
    /// Whether a frame has begun and not ended.
    open: bool,
    /// Number of frames that have ended.
    ended: u32,
    /// Number of frames that showed pictures, and number of others since the last one.
    shown: u32,
    empty: u32,
    /// Display time of the first frame that was to be rendered.
    first: Option<i64>,
}

impl Frames {
    pub fn new(frame_ns: i64) -> Self {
        Self {
            frame_ns,
            clock: 0,
            waiting: 0,
            open: false,
            ended: 0,
            shown: 0,
            empty: 0,
            first: None,
        }
    }

    pub fn restart(&mut self) {
        (self.waiting, self.open, self.ended) = (0, false, 0);
    }

    /// The display time of the newest frame.
    pub fn now(&self) -> xr::Time {
        xr::Time::from_nanos(START_NS + self.clock * self.frame_ns)
    }

    /// The frame of the head's path at a time, and the part of the way to the next one. The path starts at the first
    /// frame that is rendered. A later time than that of the newest frame counts as the latter.
    pub fn place(&self, time: xr::Time) -> (usize, f64) {
        let since = time.as_nanos().min(self.now().as_nanos()) - self.first.unwrap_or(i64::MAX);
        if since <= 0 {
            return (0, 0.0);
        }
        let (whole, rest) = (since / self.frame_ns, since % self.frame_ns);
        (whole as usize, rest as f64 / self.frame_ns as f64)
    }
}

pub(crate) unsafe extern "system" fn wait_frame(
    session: xr::Session,
    info: *const xr::FrameWaitInfo,
    frame: *mut xr::FrameState,
) -> Code {
    let wait = || -> Answer {
        let mut state = locked();
        loop {
            let of = state.get_or_insert_default().session(session)?;
            if !info.is_null() {
                // SAFETY: a valid call of xrWaitFrame.
                unsafe { input(info, StructureType::FRAME_WAIT_INFO) }?;
            }
            // SAFETY: a valid call of xrWaitFrame.
            let frame = unsafe { output(frame, StructureType::FRAME_STATE) }?;
            if !of.running {
                return Err(Code::ERROR_SESSION_NOT_RUNNING);
            }
            if of.frames.waiting == 0 {
                let renders = [SessionState::VISIBLE, SessionState::FOCUSED].contains(&of.state);
                of.frames.waiting = 1;
                of.frames.clock += 1;
                let now = of.frames.now();
                if renders {
                    of.frames.first.get_or_insert(now.as_nanos());
                }
                frame.predicted_display_time = now;
                frame.predicted_display_period = xr::Duration::from_nanos(of.frames.frame_ns);
                frame.should_render = renders.into();
                return DONE;
            }
            // Another thread begins the frame before.
            state = BEGUN.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    };
    wait().unwrap_or_else(|error| error)
}

pub(crate) unsafe extern "system" fn begin_frame(
    session: xr::Session,
    info: *const xr::FrameBeginInfo,
) -> Code {
    let code = answer(|state| {
        let of = state.session(session)?;
        if !info.is_null() {
            // SAFETY: a valid call of xrBeginFrame.
            unsafe { input(info, StructureType::FRAME_BEGIN_INFO) }?;
        }
        if !of.running {
            return Err(Code::ERROR_SESSION_NOT_RUNNING);
        }
        if of.frames.waiting == 0 {
            return Err(Code::ERROR_CALL_ORDER_INVALID);
        }
        of.frames.waiting = 0;
        match std::mem::replace(&mut of.frames.open, true) {
            false => DONE,
            true => Ok(Code::FRAME_DISCARDED),
        }
    });
    BEGUN.notify_all();
    code
}

/// The views of a layer, after a check.
///
/// # Safety
/// A valid layer.
unsafe fn views_of_layer(
    instance: &Instance,
    layer: *const xr::CompositionLayerBaseHeader,
    time: xr::Time,
) -> Result<Option<[ShownView; 2]>, Code> {
    // SAFETY: as the caller promises; the type tells the structure.
    unsafe {
        let header = layer.as_ref().ok_or(Code::ERROR_LAYER_INVALID)?;
        let space = instance.spaces.get(&header.space.into_raw());
        let space = space.ok_or(Code::ERROR_HANDLE_INVALID)?;
        match header.ty {
            StructureType::COMPOSITION_LAYER_QUAD => {
                let quad = &*layer.cast::<xr::CompositionLayerQuad>();
                Pose::of_program(&quad.pose)?;
                instance.shown(&quad.sub_image)?;
                Ok(None)
            }
            StructureType::COMPOSITION_LAYER_PROJECTION => {
                let projection = &*layer.cast::<xr::CompositionLayerProjection>();
                let views = elements(projection.views, projection.view_count)?;
                let [left, right] = views else {
                    return Err(INVALID);
                };
                let space = instance.in_path(space, time).unwrap_or(Pose::IDENTITY);
                Ok(Some([
                    view(instance, space, left)?,
                    view(instance, space, right)?,
                ]))
            }
            _ => Err(Code::ERROR_LAYER_INVALID),
        }
    }
}

/// A view of a projection layer.
///
/// # Safety
/// A valid structure.
unsafe fn view(
    instance: &Instance,
    space: Pose,
    view: &xr::CompositionLayerProjectionView,
) -> Result<ShownView, Code> {
    let inner = Pose::of_program(&view.pose)?;
    // The numbers of the program stay as they are unless its space is another one than that of the path.
    let pose = match space == Pose::IDENTITY {
        true => view.pose,
        false => space.then(inner).to_program(),
    };
    let fov = view.fov;
    let angles = [
        fov.angle_left,
        fov.angle_right,
        fov.angle_up,
        fov.angle_down,
    ];
    if view.ty != StructureType::COMPOSITION_LAYER_PROJECTION_VIEW
        || !angles.iter().all(|a| a.is_finite())
    {
        return Err(INVALID);
    }
    let Shown { image, layer, rect } = instance.shown(&view.sub_image)?;
    let mut planes_m = [0.0; 2];
    // SAFETY: as the caller promises.
    if let Some(depth) = unsafe { find(view.next, StructureType::COMPOSITION_LAYER_DEPTH_INFO_KHR) }
        && instance.has(DEPTH, None)
    {
        // SAFETY: the type tells the structure.
        let depth = unsafe { &*depth.cast::<xr::CompositionLayerDepthInfoKHR>() };
        instance.shown(&depth.sub_image)?;
        planes_m = [depth.near_z, depth.far_z];
    }
    let (q, p) = (pose.orientation, pose.position);
    Ok(ShownView {
        image,
        layer,
        rect,
        orientation: [q.x, q.y, q.z, q.w],
        position_m: [p.x, p.y, p.z],
        angles,
        planes_m,
    })
}

api! {
    fn end_frame(session: xr::Session, info: *const xr::FrameEndInfo) |state| {
        let instance = state.of_session(session)?;
        let info = input(info, StructureType::FRAME_END_INFO)?;
        let of = instance.session.as_ref().ok_or(INVALID)?;
        if !of.running {
            return Err(Code::ERROR_SESSION_NOT_RUNNING);
        }
        if !of.frames.open {
            return Err(Code::ERROR_CALL_ORDER_INVALID);
        }
        if info.display_time.as_nanos() <= 0 {
            return Err(Code::ERROR_TIME_INVALID);
        }
        match info.environment_blend_mode {
            xr::EnvironmentBlendMode::OPAQUE => {}
            xr::EnvironmentBlendMode::ADDITIVE | xr::EnvironmentBlendMode::ALPHA_BLEND => {
                return Err(Code::ERROR_ENVIRONMENT_BLEND_MODE_UNSUPPORTED);
            }
            _ => return Err(INVALID),
        }
        if info.layer_count > MOST_LAYERS {
            return Err(Code::ERROR_LAYER_LIMIT_EXCEEDED);
        }
        let mut shown = None;
        for layer in elements(info.layers, info.layer_count)? {
            let views = views_of_layer(instance, *layer, info.display_time)?;
            // The first projection layer shows the scene. Others lie before it.
            shown = shown.or(views);
        }
        let settings = [instance.settings.frames, instance.settings.most_empty_frames];
        let of = instance.session.as_mut().ok_or(INVALID)?;
        of.frames.open = false;
        of.frames.ended += 1;
        let device = match shown {
            Some(_) => of.graphics.shown_on()?,
            None => None,
        };
        match (&shown, device) {
            (Some(views), Some(device)) => {
                of.frames.shown += 1;
                of.frames.empty = 0;
                recorder::end_frame(device, views);
            }
            _ => of.frames.empty += 1,
        }
        let is_over = of.frames.shown >= settings[0] || of.frames.empty >= settings[1];
        let is_first = of.frames.ended == 1 && !of.exiting && of.state == SessionState::READY;
        if is_first {
            instance.change_state(&UP);
        }
        if is_over {
            instance.request_exit();
        }
        DONE
    }
}
