//! Announces the layer to the Vulkan loader of a program by environment variables, whatever variables the user
//! has set.

use super::launch::LaunchError;
use formats::container::ScratchFolder;
use spool::{FOLDER_VARIABLE, LAYER_LINK, LAYER_NAME};
use std::ffi::{OsStr, OsString};
use std::fs;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::process::Command;

/// File that registers the layer with the loader.
pub(super) const MANIFEST: &str = "parallax_layer.json";
/// Character that separates the entries of the loader's lists of paths.
const SEPARATOR: u8 = b':';
/// Variable of layers that the loader disables.
const DISABLED_LAYERS: &str = "VK_LOADER_LAYERS_DISABLE";
/// Variables with driver files. The first one that is set has precedence.
const DRIVER_FILES: [&str; 2] = ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"];
/// Variables that add or remove drivers.
const DRIVER_FILTERS: [&str; 3] = [
    "VK_ADD_DRIVER_FILES",
    "VK_LOADER_DRIVERS_SELECT",
    "VK_LOADER_DRIVERS_DISABLE",
];

/// Folders for temporary files if the usual one cannot be in a list of paths.
const OTHER_FOLDERS: [&str; 3] = ["/tmp", "/var/tmp", "/dev/shm"];

/// Creates a folder for a capture, whose path can be an entry of the loader's lists.
///
/// # Errors
/// No folder can be created.
pub fn folder_in(parent: &Path) -> std::io::Result<ScratchFolder> {
    let parent = std::path::absolute(parent)?;
    if !parent.as_os_str().as_bytes().contains(&SEPARATOR) {
        return ScratchFolder::create_in(&parent);
    }
    let made = OTHER_FOLDERS.map(|other| ScratchFolder::create_in(Path::new(other)));
    made.into_iter().find_map(Result::ok).ok_or_else(|| {
        std::io::Error::other("the loader takes no path with a colon; set TMPDIR to another folder")
    })
}

/// Writes the manifest that registers the library with the loader.
///
/// # Errors
/// The folder cannot be written.
pub fn register(folder: &Path, library: &Path) -> std::io::Result<()> {
    std::os::unix::fs::symlink(library, folder.join(LAYER_LINK))?;
    fs::write(folder.join(MANIFEST), include_bytes!("parallax_layer.json"))
}

/// File that registers the OpenXR runtime, and the link to its library beside it.
const OPENXR_MANIFEST: &str = "parallax_xr.json";
const OPENXR_LINK: &str = "libparallax_xr.so";

/// Makes the OpenXR loader of a program open the runtime.
///
/// # Errors
/// The folder cannot be written.
pub fn register_openxr(
    command: &mut Command,
    folder: &Path,
    library: &Path,
) -> std::io::Result<()> {
    std::os::unix::fs::symlink(library, folder.join(OPENXR_LINK))?;
    let manifest = folder.join(OPENXR_MANIFEST);
    fs::write(&manifest, include_bytes!("parallax_xr.json"))?;
    command.env("XR_RUNTIME_JSON", manifest);
    Ok(())
}

/// Makes a program load the registered layer.
pub fn announce(command: &mut Command, folder: &Path) {
    let value = |name| std::env::var_os(name).filter(|value| !value.is_empty());
    // The loader ignores additional folders if the user has replaced the system's.
    let folders = match value("VK_LAYER_PATH") {
        Some(_) => "VK_LAYER_PATH",
        None => "VK_ADD_LAYER_PATH",
    };
    command
        .env(FOLDER_VARIABLE, folder)
        .env(
            "VK_INSTANCE_LAYERS",
            prepended(value("VK_INSTANCE_LAYERS"), LAYER_NAME.into()),
        )
        .env(folders, prepended(value(folders), folder.into()));
    if let Some(disabled) = value(DISABLED_LAYERS) {
        match without_layer(&disabled.to_string_lossy()) {
            Some(others) => command.env(DISABLED_LAYERS, others),
            None => command.env_remove(DISABLED_LAYERS),
        };
    }
}

/// A list after an entry is prepended.
fn prepended(list: Option<OsString>, entry: OsString) -> OsString {
    let mut all = entry;
    if let Some(old) = list {
        all.push(OsStr::from_bytes(&[SEPARATOR]));
        all.push(old);
    }
    all
}

/// A list of disabled layers without the patterns that match this layer; `None` if none is left. Explicit layers
/// are loaded only where they are named, so that no other layer is loaded instead.
fn without_layer(disabled: &str) -> Option<String> {
    let kept = disabled.split(',').map(str::trim).filter_map(|pattern| {
        match pattern.to_lowercase().as_str() {
            "" | "~explicit~" => None,
            // The other half of all layers.
            "~all~" | "*" | "**" => Some("~implicit~"),
            other if matches(other, &LAYER_NAME.to_lowercase()) => None,
            _ => Some(pattern),
        }
    });
    let kept: Vec<&str> = kept.collect();
    (!kept.is_empty()).then(|| kept.join(","))
}

/// Whether a pattern of the loader matches a name. It may have a star at each end.
fn matches(pattern: &str, name: &str) -> bool {
    match (pattern.strip_prefix('*'), pattern.strip_suffix('*')) {
        (Some(_), Some(_)) => name.contains(pattern.trim_matches('*')),
        (Some(end), None) => name.ends_with(end),
        (None, Some(start)) => name.starts_with(start),
        (None, None) => name == pattern,
    }
}

/// The driver file that the user set by an environment variable, if it is one.
///
/// # Errors
/// A variable that names no file.
pub fn driver_of_user() -> Result<Option<OsString>, LaunchError> {
    for variable in DRIVER_FILES {
        if let Some(value) = std::env::var_os(variable).filter(|value| !value.is_empty()) {
            return match names_a_file(&value) {
                true => Ok(Some(value)),
                false => Err(LaunchError::DriverFiles {
                    variable,
                    value: value.to_string_lossy().into_owned(),
                }),
            };
        }
    }
    Ok(None)
}

/// Whether a list has a file, or a folder with files of drivers.
fn names_a_file(list: &OsStr) -> bool {
    let is_manifest = |path: &PathBuf| path.extension().is_some_and(|e| e == "json");
    let mut entries = list.as_bytes().split(|byte| *byte == SEPARATOR);
    entries.any(|entry| {
        let path = Path::new(OsStr::from_bytes(entry));
        match fs::read_dir(path) {
            Ok(mut files) => files.any(|file| file.is_ok_and(|file| is_manifest(&file.path()))),
            Err(_) => path.is_file(),
        }
    })
}

/// Makes a program use a driver and no other.
pub fn choose_driver(command: &mut Command, driver: &Path) {
    for variable in DRIVER_FILES {
        command.env(variable, driver);
    }
    for variable in DRIVER_FILTERS {
        command.env_remove(variable);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patterns_that_disable_the_layer_are_removed() {
        for (disabled, kept) in [
            ("~all~", Some("~implicit~")),
            ("*", Some("~implicit~")),
            ("~explicit~", None),
            ("VK_LAYER_PARALLAX_*", None),
            (
                "*parallax*, VK_LAYER_MESA_overlay",
                Some("VK_LAYER_MESA_overlay"),
            ),
            ("*_capture,~implicit~", Some("~implicit~")),
            ("vk_layer_parallax_capture", None),
            ("VK_LAYER_PARALLAX", Some("VK_LAYER_PARALLAX")),
            ("", None),
        ] {
            assert_eq!(without_layer(disabled).as_deref(), kept, "{disabled}");
        }
    }

    #[test]
    fn a_folder_with_a_colon_is_replaced() {
        let parent = tempfile::tempdir().unwrap();
        let plain = folder_in(parent.path()).unwrap();
        assert!(plain.path().starts_with(parent.path()));
        let colon = parent.path().join("a:b");
        fs::create_dir(&colon).unwrap();
        let other = folder_in(&colon).unwrap();
        assert!(!other.path().as_os_str().as_bytes().contains(&SEPARATOR));
        assert!(fs::read_dir(&colon).unwrap().next().is_none());
    }

    #[test]
    fn the_manifest_names_the_library_by_a_link_beside_it() {
        let folder = tempfile::tempdir().unwrap();
        let library = folder.path().join("a \"quoted\" library.so");
        fs::write(&library, b"library").unwrap();
        register(folder.path(), &library).unwrap();
        let text = fs::read(folder.path().join(MANIFEST)).unwrap();
        let manifest: serde_json::Value = serde_json::from_slice(&text).unwrap();
        assert_eq!(manifest["layer"]["name"], LAYER_NAME);
        let named = manifest["layer"]["library_path"].as_str().unwrap();
        assert_eq!(fs::read(folder.path().join(named)).unwrap(), b"library");
    }

    #[test]
    fn lists_of_drivers_have_files_or_folders_of_files() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("lvp.json");
        assert!(!names_a_file(folder.path().as_os_str()));
        assert!(!names_a_file(file.as_os_str()));
        fs::write(&file, b"{}").unwrap();
        for path in [folder.path(), &file] {
            assert!(names_a_file(path.as_os_str()));
        }
        let mut list = OsString::from("/none/such.json:");
        list.push(&file);
        assert!(names_a_file(&list));
    }
}
