//! The capture that this process belongs to.

use crate::control::Control;
use crate::spool::{Event, FOLDER_VARIABLE, FramesBy, Settings, Writer};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};

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
    /// Whether the program has a swapchain.
    presents: AtomicBool,
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
            presents: AtomicBool::new(false),
            failed: AtomicBool::new(false),
        })
    }

    /// Number of the current frame.
    pub fn frame(&self) -> u32 {
        match self.settings.frames_by {
            FramesBy::Launcher => self.control.frame(),
            _ => self.counted.load(Ordering::SeqCst),
        }
    }

    /// Whether the launcher requested a frame.
    pub fn wants(&self, frame: u32) -> bool {
        let [first, end] = self.settings.frames;
        (first..end).contains(&frame)
    }

    /// Whether commands recorded now may be executed in a requested frame. Programs may record commands of
    /// the next frame before they submit those of the current one.
    pub fn may_want_commands(&self) -> bool {
        let frame = self.frame();
        self.wants(frame) || self.wants(frame.saturating_add(1))
    }

    /// Whether all requested frames have ended.
    pub fn is_over(&self) -> bool {
        self.frame() >= self.settings.frames[1]
    }

    /// Notes that the program has a swapchain.
    pub fn note_swapchain(&self) {
        self.presents.store(true, Ordering::Relaxed);
    }

    /// Notes that the program presented an image.
    pub fn note_present(&self) {
        if matches!(self.settings.frames_by, FramesBy::Present | FramesBy::Auto) {
            self.end_frame();
        }
    }

    /// Notes that the program copied an image to a buffer.
    pub fn note_readback(&self) {
        let counts = match self.settings.frames_by {
            FramesBy::Readback => true,
            FramesBy::Auto => !self.presents.load(Ordering::Relaxed),
            FramesBy::Present | FramesBy::Launcher => false,
        };
        if counts {
            self.end_frame();
        }
    }

    fn end_frame(&self) {
        self.counted.fetch_add(1, Ordering::SeqCst);
        self.control.count();
        self.note_frames();
    }

    /// Writes the events of frames that have ended.
    pub fn note_frames(&self) {
        let frame = self.frame();
        let before = self.ended.swap(frame, Ordering::SeqCst);
        for ended in (before..frame).filter(|ended| self.wants(*ended)) {
            self.event(&Event::Frame { frame: ended });
            self.control.count_ended();
        }
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
