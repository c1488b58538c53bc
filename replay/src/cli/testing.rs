//! Helpers that the subcommands' tests share.

use crate::stream::MemoryTrace;
use formats::textrace::TextraceWriter;
use std::io::Write;
use tempfile::NamedTempFile;

/// Writes a trace to a file that is deleted with the handle.
pub fn file_of(trace: &MemoryTrace) -> NamedTempFile {
    let mut writer = TextraceWriter::in_memory(&trace.tables).unwrap();
    for (pass, tiles) in trace.tiles.iter().enumerate() {
        for (index, tile) in tiles.iter().enumerate() {
            writer.write_tile(pass, index, tile).unwrap();
        }
    }
    let mut file = NamedTempFile::new().unwrap();
    file.write_all(&writer.into_bytes().unwrap()).unwrap();
    file
}

/// Splits a text into lines.
pub fn lines(text: &[u8]) -> Vec<String> {
    let text = std::str::from_utf8(text).unwrap();
    text.lines().map(str::to_owned).collect()
}
