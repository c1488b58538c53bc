//! A page of memory that the launcher and the captured processes share.

use memmap2::MmapMut;
use std::fs::OpenOptions;
use std::io;
use std::path::Path;
use std::sync::atomic::{AtomicU32, Ordering};

/// File of the page in the capture's folder.
const FILE: &str = "control";
/// Bytes of the page.
const BYTES: u64 = 4096;

/// Words of the page.
#[derive(Clone, Copy, Debug)]
enum Word {
    /// Number of the frame, where the launcher counts.
    Frame = 0,
    /// Frames of interest that have ended.
    Ended = 1,
    /// Frames that programs ended.
    Counted = 2,
}

/// The shared page.
#[derive(Debug)]
pub struct Control {
    map: MmapMut,
}

impl Control {
    /// Makes the page of a capture.
    ///
    /// # Errors
    /// A file that cannot be made or mapped.
    pub fn create(folder: &Path) -> io::Result<Self> {
        std::fs::write(folder.join(FILE), vec![0; BYTES as usize])?;
        Self::open(folder)
    }

    /// Maps the page of a capture.
    ///
    /// # Errors
    /// A file that cannot be mapped.
    pub fn open(folder: &Path) -> io::Result<Self> {
        let path = folder.join(FILE);
        let file = OpenOptions::new().read(true).write(true).open(path)?;
        if file.metadata()?.len() < BYTES {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        // SAFETY: the file is not shortened while the capture's folder exists; its words are accessed only
        // atomically.
        let map = unsafe { MmapMut::map_mut(&file) }?;
        Ok(Self { map })
    }

    /// The frame that the launcher counts.
    #[must_use]
    pub fn frame(&self) -> u32 {
        self.word(Word::Frame).load(Ordering::SeqCst)
    }

    /// Counts a frame.
    pub fn set_frame(&self, frame: u32) {
        self.word(Word::Frame).store(frame, Ordering::SeqCst);
    }

    /// Frames that programs ended, of all processes.
    #[must_use]
    pub fn counted(&self) -> u32 {
        self.word(Word::Counted).load(Ordering::SeqCst)
    }

    /// A program ended a frame.
    pub fn count(&self) {
        self.word(Word::Counted).fetch_add(1, Ordering::SeqCst);
    }

    /// Frames of interest that have ended, of all processes.
    #[must_use]
    pub fn ended(&self) -> u32 {
        self.word(Word::Ended).load(Ordering::SeqCst)
    }

    /// Another frame of interest ended.
    pub fn count_ended(&self) {
        self.word(Word::Ended).fetch_add(1, Ordering::SeqCst);
    }

    fn word(&self, word: Word) -> &AtomicU32 {
        let words: *const AtomicU32 = self.map.as_ptr().cast();
        // SAFETY: the page is mapped as long as `self` lives, is aligned, has more words than `Word` names, and is
        // never accessed but through these atomics.
        unsafe { &*words.add(word as usize) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_maps_of_a_page_see_each_other() {
        let folder = tempfile::tempdir().unwrap();
        let launcher = Control::create(folder.path()).unwrap();
        let layer = Control::open(folder.path()).unwrap();
        launcher.set_frame(12);
        layer.count_ended();
        layer.count_ended();
        assert_eq!((layer.frame(), launcher.ended()), (12, 2));
        std::fs::write(folder.path().join(FILE), b"short").unwrap();
        assert!(Control::open(folder.path()).is_err());
    }
}
