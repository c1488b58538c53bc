//! Finds out why Vulkan lists no device although a driver may be installed.

use libloading::Library;
use std::path::{Path, PathBuf};

/// Library of Vulkan's loader.
const LOADER: &str = "libvulkan.so.1";

/// Approximate address space that lavapipe needs in addition to its libraries.
const NEEDED_BYTES: usize = 512 << 20;

/// Reason why an installed lavapipe does not start; `None` if it is not installed or the reason is
/// unknown. The loader silently skips a driver that it cannot load, for example when memory runs
/// out.
pub(super) fn reason() -> Option<String> {
    let libraries = installed();
    if libraries.is_empty() {
        return None;
    }
    std::iter::once(PathBuf::from(LOADER))
        .chain(libraries)
        .find_map(|library| cannot_load(&library))
        .or_else(little_memory)
}

/// Lavapipe's libraries, read from its driver files.
fn installed() -> Vec<PathBuf> {
    let text = |path| std::fs::read_to_string(path).ok();
    let texts = mesa::driver_files().into_iter().filter_map(text);
    texts.filter_map(|text| library_of(&text)).collect()
}

/// The value of `library_path`.
fn library_of(description: &str) -> Option<PathBuf> {
    let (_, rest) = description.split_once("\"library_path\"")?;
    let value = rest.split('"').nth(1)?;
    Some(PathBuf::from(value))
}

fn cannot_load(library: &Path) -> Option<String> {
    // SAFETY: loading runs the initialisers of Vulkan's loader or of Mesa and LLVM, as opening a device does.
    let loaded = unsafe { Library::new(library) };
    // The loader's text names the file and the cause, such as "failed to map segment".
    loaded.err().map(|error| error.to_string())
}

fn little_memory() -> Option<String> {
    let refused = Vec::<u8>::new().try_reserve_exact(NEEDED_BYTES).is_err();
    refused.then(|| {
        format!(
            "not enough memory: {} MiB more were refused (the machine's memory, or ulimit -v)",
            NEEDED_BYTES >> 20
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unloadable_driver_library_is_reported_with_the_loaders_message() {
        let text = r#"{ "ICD": { "api_version": "1.1.230", "library_path" : "/lib/libx.so" } }"#;
        assert_eq!(library_of(text), Some(PathBuf::from("/lib/libx.so")));
        assert_eq!(library_of("{}"), None);
        let said = cannot_load(Path::new("/lib/no-such-driver.so")).unwrap();
        assert!(said.contains("no-such-driver.so"), "{said}");
    }
}
