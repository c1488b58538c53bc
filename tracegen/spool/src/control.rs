//! A page of memory shared by the launcher and the captured processes.

use memmap2::MmapMut;
use std::fs::OpenOptions;
use std::io;
use std::path::Path;
use std::sync::atomic::{AtomicU32, Ordering};

/// Name of the page's file in the capture's folder.
const FILE: &str = "control";
/// Size of the page in bytes.
const BYTES: u64 = 4096;

/// Words of the page.
#[derive(Clone, Copy, Debug)]
enum Word {
    /// Number of the frame, if the launcher counts frames.
    Frame = 0,
    /// Number of requested frames that have ended.
    Ended = 1,
    /// Number of frames that programs ended.
    Counted = 2,
}

/// The shared page.
#[derive(Debug)]
pub struct Control {
    map: MmapMut,
}

impl Control {
    /// Creates the page of a capture.
    ///
    /// # Errors
    /// The file cannot be created or mapped.
    pub fn create(folder: &Path) -> io::Result<Self> {
        std::fs::write(folder.join(FILE), vec![0; BYTES as usize])?;
        Self::open(folder)
    }

    /// Maps the page of a capture.
    ///
    /// # Errors
    /// The file cannot be mapped.
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

    /// Number of the frame that the launcher set.
    pub fn frame(&self) -> u32 {
        self.word(Word::Frame).load(Ordering::SeqCst)
    }

    /// Sets the number of the frame.
    pub fn set_frame(&self, frame: u32) {
        self.word(Word::Frame).store(frame, Ordering::SeqCst);
    }

    /// Number of frames that the programs of all processes ended.
    pub fn counted(&self) -> u32 {
        self.word(Word::Counted).load(Ordering::SeqCst)
    }

    /// Counts a frame that a program ended.
    pub fn count(&self) {
        self.word(Word::Counted).fetch_add(1, Ordering::SeqCst);
    }

    /// Number of requested frames that have ended, of all processes.
    pub fn ended(&self) -> u32 {
        self.word(Word::Ended).load(Ordering::SeqCst)
    }

    /// Counts a requested frame that has ended.
    pub fn count_ended(&self) {
        self.word(Word::Ended).fetch_add(1, Ordering::SeqCst);
    }

    fn word(&self, word: Word) -> &AtomicU32 {
        let words: *const AtomicU32 = self.map.as_ptr().cast();
        // SAFETY: the page is mapped as long as `self` lives, is aligned, has more words than `Word` has
        // variants, and is accessed only through these atomics.
        unsafe { &*words.add(word as usize) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_maps_of_a_page_share_its_words() {
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
