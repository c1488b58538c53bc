//! Writes the files of a process.

use super::{EVENTS, Event, RECORDS, Span, file, picture};
use crate::{UNIT_BYTES, Unit};
use std::collections::HashSet;
use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};

/// Appends events and records of a process.
#[derive(Debug)]
pub struct Writer {
    folder: PathBuf,
    /// Process that owns the files. A forked child gets its own files.
    pid: u32,
    events: File,
    records: File,
    written: u64,
    /// Whether zeros were written where records will follow.
    reserved: bool,
    /// Kinds and numbers of the objects that have been described.
    described: HashSet<(&'static str, u32)>,
}

impl Writer {
    /// Creates the files of this process in a folder.
    ///
    /// # Errors
    /// The files cannot be created.
    pub fn create(folder: &Path) -> io::Result<Self> {
        let pid = std::process::id();
        let open = |extension| {
            let path = file(folder, &pid.to_string(), extension);
            OpenOptions::new().create_new(true).write(true).open(path)
        };
        let mut writer = Self {
            folder: folder.to_owned(),
            pid,
            events: open(EVENTS)?,
            records: open(RECORDS)?,
            written: 0,
            reserved: false,
            described: HashSet::new(),
        };
        let command = std::env::args_os().map(|a| a.to_string_lossy().into_owned());
        writer.event(&Event::Process {
            pid,
            command: command.collect(),
        })?;
        Ok(writer)
    }

    /// Writes an event.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn event(&mut self, event: &Event) -> io::Result<()> {
        self.after_fork()?;
        let mut line = serde_json::to_vec(event)?;
        line.push(b'\n');
        self.events.write_all(&line)
    }

    /// Writes the event that describes an object, once.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn describe(
        &mut self,
        kind: &'static str,
        number: u32,
        event: impl FnOnce() -> Event,
    ) -> io::Result<()> {
        if self.described.contains(&(kind, number)) {
            return Ok(());
        }
        self.event(&event())?;
        self.described.insert((kind, number));
        Ok(())
    }

    /// Writes zeros where records will follow. The system allocates memory for a new part of a file much more
    /// slowly than it overwrites a part, and this moves the cost out of the recorded frames.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn reserve_records(&mut self, bytes: u64) -> io::Result<()> {
        static CHUNK: [u8; 1 << 16] = [0; 1 << 16];
        if std::mem::replace(&mut self.reserved, true) || self.written > 0 {
            return Ok(());
        }
        for at in (0..bytes).step_by(CHUNK.len()) {
            self.records.write_all_at(&CHUNK, at)?;
        }
        Ok(())
    }

    /// Writes records and returns their place.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn records(&mut self, records: &[Unit]) -> io::Result<Span> {
        self.after_fork()?;
        let at = self.written * UNIT_BYTES;
        self.records
            .write_all_at(bytemuck::cast_slice(records), at)?;
        let span = Span {
            first: self.written,
            count: records.len() as u64,
        };
        self.written += span.count;
        Ok(span)
    }

    /// Writes the picture of a render pass and its event.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn picture(&mut self, pass: u32, size: [u32; 2], texels: &[u8]) -> io::Result<()> {
        self.after_fork()?;
        std::fs::write(picture(&self.folder, &self.pid.to_string(), pass), texels)?;
        self.event(&Event::Picture { pass, size })
    }

    /// Creates new files after a fork.
    fn after_fork(&mut self) -> io::Result<()> {
        if std::process::id() != self.pid {
            *self = Self::create(&self.folder.clone())?;
        }
        Ok(())
    }
}
