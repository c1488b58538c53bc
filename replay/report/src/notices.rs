//! What a reader of figures must know about their traces. Every command opens its traces here. The notices are
//! printed on standard error, and are in the page of a command that writes one.

use formats::Trace;
use formats::textrace::Textrace;
use sim::result::{TraceId, notices_of};
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

/// Names of files and their printed notices.
static PRINTED: Mutex<BTreeSet<(String, String)>> = Mutex::new(BTreeSet::new());

/// Prints notices about a file on standard error, each once in a run of the program.
pub fn print(file: &Path, notices: &[String]) {
    let name = file.file_name().unwrap_or(file.as_os_str());
    for notice in notices {
        let of = (name.to_string_lossy().into_owned(), notice.clone());
        let mut printed = PRINTED.lock().unwrap_or_else(PoisonError::into_inner);
        if printed.insert(of) {
            shell::note(&format!("note: {}: {notice}", file.display()));
        }
    }
}

/// Sentences of the notices that were printed, sorted.
pub fn printed() -> Vec<String> {
    let printed = PRINTED.lock().unwrap_or_else(PoisonError::into_inner);
    let sentences = printed.iter();
    sentences
        .map(|(name, notice)| format!("{name}: {notice}"))
        .collect()
}

/// Opens a trace of either kind and prints its notices.
///
/// # Errors
/// The file cannot be read or is malformed.
pub fn open(path: &Path) -> formats::Result<Trace> {
    let trace = Trace::open(path)?;
    if let Trace::Texture(of_textures) = &trace {
        print(path, &notices_of(&of_textures.tables().meta));
    }
    Ok(trace)
}

/// Opens a texture trace, prints its notices, and returns its identification for results.
///
/// # Errors
/// The file cannot be read or is damaged.
pub fn open_textrace(path: &Path) -> formats::Result<(Textrace, TraceId)> {
    let trace = Textrace::open(path)?;
    let id = TraceId::new(path, &trace.tables().meta, trace.content_checksum());
    print(path, &id.notices);
    Ok((trace, id))
}
