//! Reads the files of the processes of a captured program.

use super::{EVENTS, Event, RECORDS, Span, file, picture};
use crate::{RawSample, UNIT_BYTES, Unit, unpack};
use std::fs::{self, File};
use std::io::{BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Reasons why a capture's files cannot be read.
#[derive(Debug, Error)]
pub enum ReadError {
    /// An error of the system.
    #[error("{file}: {source}")]
    Io {
        /// The file.
        file: String,
        /// Error of the system.
        source: std::io::Error,
    },
    /// A line that is not an event.
    #[error("{file}: line {line}: expected an event, found {found}")]
    Event {
        /// The file.
        file: String,
        /// Number of the line, from 1.
        line: usize,
        /// The parser's message.
        found: String,
    },
    /// Records that are in an event but not in the file.
    #[error("{file}: expected records up to byte {end}, found {found} bytes")]
    Short {
        /// The file.
        file: String,
        /// End of the span in bytes.
        end: u64,
        /// End of the file.
        found: u64,
    },
    /// A span that ends in the middle of a record.
    #[error("{file}: expected the end of a record at byte {end}, found the middle of one")]
    Split {
        /// The file.
        file: String,
        /// End of the span in bytes.
        end: u64,
    },
}

/// The files of one process.
#[derive(Clone, Debug)]
pub struct Process {
    pub(super) events: PathBuf,
    records: PathBuf,
}

impl Process {
    /// The processes of a capture, by the names of their files.
    ///
    /// # Errors
    /// The folder cannot be read.
    pub fn all(folder: &Path) -> Result<Vec<Self>, ReadError> {
        let io = |source| io_error(folder, source);
        let mut found = Vec::new();
        for entry in fs::read_dir(folder).map_err(io)? {
            let path = entry.map_err(io)?.path();
            if path.extension().is_some_and(|e| e == EVENTS)
                && let Some(name) = path.file_stem().and_then(|name| name.to_str())
            {
                found.push(Self {
                    records: file(folder, name, RECORDS),
                    events: path,
                });
            }
        }
        found.sort_by(|a, b| a.events.cmp(&b.events));
        Ok(found)
    }

    /// All events. An incomplete last line of a killed process is ignored.
    ///
    /// # Errors
    /// The file cannot be read, or a line is not an event.
    pub fn events(&self) -> Result<Vec<Event>, ReadError> {
        let open = File::open(&self.events).map_err(|e| io_error(&self.events, e))?;
        let mut lines = BufReader::new(open);
        let mut events = Vec::new();
        let mut line = String::new();
        loop {
            line.clear();
            let read = lines.read_line(&mut line);
            if read.map_err(|e| io_error(&self.events, e))? == 0 || !line.ends_with('\n') {
                return Ok(events);
            }
            let event = serde_json::from_str(&line).map_err(|e| ReadError::Event {
                file: self.events.display().to_string(),
                line: events.len() + 1,
                found: e.to_string(),
            })?;
            events.push(event);
        }
    }

    /// Texels of the picture of a render pass.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn picture(&self, pass: u32) -> Result<Vec<u8>, ReadError> {
        let folder = self.events.parent().unwrap_or(Path::new("."));
        let name = (self.events.file_stem()).map(|name| name.to_string_lossy().into_owned());
        let path = picture(folder, &name.unwrap_or_default(), pass);
        fs::read(&path).map_err(|e| io_error(&path, e))
    }

    /// Opens the file of records.
    ///
    /// # Errors
    /// The file cannot be opened.
    pub fn records(&self) -> Result<Reader, ReadError> {
        let file = File::open(&self.records).map_err(|e| io_error(&self.records, e))?;
        Ok(Reader {
            file,
            name: self.records.clone(),
        })
    }
}

/// Reads spans of records.
#[derive(Debug)]
pub struct Reader {
    file: File,
    name: PathBuf,
}

impl Reader {
    /// Reads the records of a span, coordinate group by coordinate group.
    ///
    /// # Errors
    /// The records are missing or incomplete.
    pub fn read(&mut self, span: Span, each: impl FnMut(RawSample)) -> Result<(), ReadError> {
        let file = || self.name.display().to_string();
        let io = |e| io_error(&self.name, e);
        let found = self.file.metadata().map_err(io)?.len();
        let end = span.first.saturating_add(span.count);
        let end = end.saturating_mul(UNIT_BYTES);
        let count = usize::try_from(span.count).ok().filter(|_| end <= found);
        let Some(count) = count else {
            return Err(ReadError::Short {
                file: file(),
                end,
                found,
            });
        };
        let mut units = vec![Unit::default(); count];
        let at = SeekFrom::Start(span.first * UNIT_BYTES);
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut units);
        let read = self.file.seek(at).and_then(|_| self.file.read_exact(bytes));
        read.map_err(|e| io_error(&self.name, e))?;
        if unpack(&units, each) {
            Ok(())
        } else {
            Err(ReadError::Split { file: file(), end })
        }
    }
}

fn io_error(file: &Path, source: std::io::Error) -> ReadError {
    ReadError::Io {
        file: file.display().to_string(),
        source,
    }
}
