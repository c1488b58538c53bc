//! The capture that this process belongs to.

use spool::control::Control;
use spool::openxr::ShownEye;
use spool::{Event, FOLDER_VARIABLE, FramesBy, Settings, Writer};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::Instant;

/// Number of the current frame, by each way of counting.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct FrameNumbers {
    pub frame: u32,
    /// Number if waits separate frames; `None` once something else does.
    pub by_waits: Option<u32>,
}

/// Frames that end when the program waits for rendering. They count only for a program that neither presents nor
/// reads back an image.
#[derive(Debug, Default)]
struct Waits {
    /// Whether a render pass was submitted since the last wait.
    renders: AtomicBool,
    /// Number of frames.
    ended: AtomicU32,
    /// Time of the last frame's end, microseconds after the start.
    ended_us: AtomicU64,
    /// Time of the end of the last requested frame.
    last_us: AtomicU64,
    /// Whether the requested frames were reported as ended.
    over: AtomicBool,
}

/// Frames by waits after the last requested one, and time in microseconds, after which a program is taken to
/// render for ever without presenting.
const ENDLESS_FRAMES: u32 = 16;
const ENDLESS_US: u64 = 30_000_000;

/// Settings and state of the capture in this process.
#[derive(Debug)]
pub(crate) struct Capture {
    pub settings: Settings,
    folder: PathBuf,
    control: Control,
    /// The files of the process; created at the first write.
    writer: Mutex<Option<Writer>>,
    /// Number of frames that this process counted.
    counted: AtomicU32,
    /// Number of frames whose end has been written.
    ended: AtomicU32,
    started: Instant,
    /// Time of the last frame's end, microseconds after `started`.
    ended_us: AtomicU64,
    /// Whether the program has a swapchain.
    presents: AtomicBool,
    /// Number of submissions of requested frames whose records have not been written.
    pending: AtomicU32,
    waits: Waits,
    /// Set after a write error; nothing more is written.
    failed: AtomicBool,
}

/// The capture, if a launcher requested one.
pub(crate) fn capture() -> Option<&'static Capture> {
    static CAPTURE: OnceLock<Option<Capture>> = OnceLock::new();
    CAPTURE.get_or_init(Capture::start).as_ref()
}

impl Capture {
    fn start() -> Option<Self> {
        let folder = PathBuf::from(std::env::var_os(FOLDER_VARIABLE)?);
        match Self::open(&folder) {
            Ok(capture) => Some(capture),
            Err(error) => {
                eprintln!(
                    "parallax: {}: {error}: nothing is captured",
                    folder.display()
                );
                None
            }
        }
    }

    fn open(folder: &Path) -> std::io::Result<Self> {
        Ok(Self {
            settings: Settings::load(folder)?,
            control: Control::open(folder)?,
            folder: folder.to_owned(),
            writer: Mutex::new(None),
            counted: AtomicU32::new(0),
            ended: AtomicU32::new(0),
            started: Instant::now(),
            ended_us: AtomicU64::new(0),
            presents: AtomicBool::new(false),
            pending: AtomicU32::new(0),
            waits: Waits::default(),
            failed: AtomicBool::new(false),
        })
    }

    /// The current frame.
    pub fn place(&self) -> FrameNumbers {
        FrameNumbers {
            frame: self.frame(),
            by_waits: self.frame_by_waits(),
        }
    }

    /// Number of the current frame.
    fn frame(&self) -> u32 {
        match self.settings.frames_by {
            FramesBy::Launcher => self.control.frame(),
            _ => self.counted.load(Ordering::SeqCst),
        }
    }

    /// Number of the current frame if waits separate frames, as long as the program has neither presented nor
    /// read back an image.
    fn frame_by_waits(&self) -> Option<u32> {
        let is_open = self.settings.frames_by == FramesBy::Auto
            && !self.presents.load(Ordering::Relaxed)
            && self.counted.load(Ordering::SeqCst) == 0;
        is_open.then(|| self.waits.ended.load(Ordering::SeqCst))
    }

    /// Whether the launcher requested a frame.
    pub fn wants(&self, place: FrameNumbers) -> bool {
        self.wants_number(place.frame) || place.by_waits.is_some_and(|f| self.wants_number(f))
    }

    fn wants_number(&self, frame: u32) -> bool {
        let [first, end] = self.settings.frames;
        (first..end).contains(&frame)
    }

    /// Whether commands recorded now may be executed in a requested frame. Programs may record commands of
    /// the next frame before they submit those of the current one.
    pub fn may_want_commands(&self) -> bool {
        let now = self.place();
        let next = FrameNumbers {
            frame: now.frame.saturating_add(1),
            by_waits: now.by_waits.map(|frame| frame.saturating_add(1)),
        };
        self.wants(now) || self.wants(next)
    }

    /// Whether all requested frames have ended.
    pub fn is_over(&self) -> bool {
        self.frame() >= self.settings.frames[1]
    }

    /// Notes that the program uses Vulkan.
    pub fn note_use(&self) {
        // The first write creates the files of the process.
        self.write(|_| Ok(()));
    }

    /// Notes that the program has a swapchain.
    pub fn note_swapchain(&self) {
        self.presents.store(true, Ordering::Relaxed);
    }

    /// Notes a submission of a requested frame.
    pub fn note_submission(&self) {
        self.pending.fetch_add(1, Ordering::SeqCst);
    }

    /// Notes that the records of submissions have been written.
    pub fn note_read(&self, submissions: u32) {
        self.pending.fetch_sub(submissions, Ordering::SeqCst);
        self.note_frames();
    }

    /// Whether records of submissions have not been written.
    pub fn has_pending(&self) -> bool {
        self.pending.load(Ordering::SeqCst) > 0
    }

    /// Notes that the program submitted a render pass.
    pub fn note_rendering(&self) {
        self.waits.renders.store(true, Ordering::SeqCst);
    }

    /// Notes that the program waited for the device.
    pub fn note_wait(&self) {
        let Some(frame) = self.frame_by_waits() else {
            return;
        };
        if self.has_pending() || !self.waits.renders.swap(false, Ordering::SeqCst) {
            return;
        }
        self.waits
            .ended
            .store(frame.saturating_add(1), Ordering::SeqCst);
        let (now_us, took_us) = self.time_since(&self.waits.ended_us);
        let end = self.settings.frames[1];
        if frame < end {
            self.event(&Event::Waited { frame, took_us });
            self.waits.last_us.store(now_us, Ordering::SeqCst);
        }
        // A program that loads may wait often before it presents.
        let since_us = now_us.saturating_sub(self.waits.last_us.load(Ordering::SeqCst));
        let is_long = frame >= end.saturating_add(ENDLESS_FRAMES) && since_us > ENDLESS_US;
        if is_long && !self.waits.over.swap(true, Ordering::SeqCst) {
            let [first, end] = self.settings.frames;
            (first..end).for_each(|_| self.control.count_ended());
        }
    }

    /// Notes that the program presented an image.
    pub fn note_present(&self) {
        if matches!(self.settings.frames_by, FramesBy::Present | FramesBy::Auto) {
            self.end_frame();
        }
    }

    /// Notes that the program copied an image to memory that it can read.
    pub fn note_readback(&self) {
        let counts = match self.settings.frames_by {
            FramesBy::Readback => true,
            FramesBy::Auto => !self.presents.load(Ordering::Relaxed),
            FramesBy::Present | FramesBy::Launcher | FramesBy::OpenXr => false,
        };
        if counts {
            self.end_frame();
        }
    }

    /// Notes that an OpenXR program showed pictures to the eyes.
    pub fn note_shown(&self, eyes: [ShownEye; 2]) {
        if self.settings.frames_by == FramesBy::OpenXr {
            let frame = self.frame();
            if self.wants_number(frame) {
                self.event(&Event::Shown { frame, eyes });
            }
            self.end_frame();
        }
    }

    fn end_frame(&self) {
        self.counted.fetch_add(1, Ordering::SeqCst);
        self.control.count();
        self.note_frames();
    }

    /// Writes the events of frames that have ended, up to the last requested one. The records of their
    /// submissions come first.
    pub fn note_frames(&self) {
        if self.has_pending() {
            return;
        }
        let frame = self.frame();
        let before = self.ended.swap(frame, Ordering::SeqCst);
        let new = before..frame.min(self.settings.frames[1]);
        if new.is_empty() {
            return;
        }
        let (_, took_us) = self.time_since(&self.ended_us);
        for ended in new {
            self.event(&Event::Frame {
                frame: ended,
                took_us,
            });
            if self.wants_number(ended) {
                self.control.count_ended();
            }
        }
    }

    /// Microseconds since the start, and since an earlier time, which is set to now.
    fn time_since(&self, last_us: &AtomicU64) -> (u64, u64) {
        let now_us = self.started.elapsed().as_micros() as u64;
        let last_us = last_us.swap(now_us, Ordering::SeqCst);
        (now_us, now_us.saturating_sub(last_us))
    }

    /// Writes an event.
    pub fn event(&self, event: &Event) {
        self.write(|writer| writer.event(event));
    }

    /// Writes to the process's files. A write error ends the capture with a line on stderr.
    pub fn write<T>(&self, write: impl FnOnce(&mut Writer) -> std::io::Result<T>) -> Option<T> {
        if self.failed.load(Ordering::Relaxed) {
            return None;
        }
        let mut writer = lock(&self.writer);
        let written = match &mut *writer {
            Some(writer) => write(writer),
            none => Writer::create(&self.folder).and_then(|new| write(none.insert(new))),
        };
        match written {
            Ok(value) => Some(value),
            Err(error) => {
                self.failed.store(true, Ordering::Relaxed);
                eprintln!(
                    "parallax: {}: {error}: the capture ends here",
                    self.folder.display()
                );
                None
            }
        }
    }
}

/// Locks a mutex and ignores poisoning. A panic leaves no data in this crate half changed.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
