//! Reads settings files: configurations, experiments, manifests.

use anyhow::{Context, Result, anyhow, ensure};
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// Size limit of settings files.
const LONGEST_MIB: u64 = 4;

/// Reads a settings file of at most 4 MiB. The limit also holds for devices, which may have no end.
///
/// # Errors
/// The file cannot be read, is too long or is not text; the message names it.
pub fn read_settings(path: &Path) -> Result<String> {
    let name = || path.display().to_string();
    let longest = LONGEST_MIB << 20;
    let mut bytes = Vec::new();
    let file = File::open(path).with_context(name)?;
    (file.take(longest + 1).read_to_end(&mut bytes)).with_context(name)?;
    ensure!(
        bytes.len() as u64 <= longest,
        "{}: expected at most {LONGEST_MIB} MiB of TOML, found more",
        name()
    );
    String::from_utf8(bytes).map_err(|error| {
        let good = error.utf8_error().valid_up_to();
        let bytes = error.as_bytes();
        let line = 1 + bytes.iter().take(good).filter(|b| **b == b'\n').count();
        let found = bytes.get(good).copied().unwrap_or_default();
        anyhow!(
            "{}: line {line}: expected TOML in UTF-8, found the byte {found:#04x}",
            name()
        )
    })
}
