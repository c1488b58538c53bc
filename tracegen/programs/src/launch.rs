//! Programs under the layer: what has to stand where, and in which environment variables.

use formats::container::ScratchFolder;
use parallax_layer::control::Control;
use parallax_layer::spool::{FOLDER_VARIABLE, LAYER_NAME, Settings};
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use thiserror::Error;

/// Why a program cannot be launched.
#[derive(Debug, Error)]
pub enum LaunchError {
    /// The layer's library is not where it belongs.
    #[error("{0} is missing: it is built with tracegen and belongs beside it")]
    NoLayer(String),
    /// The folder of the capture.
    #[error("cannot set up the capture in {folder}: {source}")]
    Folder {
        /// The folder.
        folder: String,
        /// The system's reason.
        source: std::io::Error,
    },
    /// No lavapipe.
    #[error(
        "no Vulkan driver file of lavapipe was found; install mesa-vulkan-drivers, or name one by VK_DRIVER_FILES"
    )]
    NoDriver,
}

/// Name of the layer's library.
const LIBRARY: &str = "libparallax_layer.so";
/// File by which the loader finds it.
const MANIFEST: &str = "parallax_layer.json";

/// Folders in which drivers register with the loader.
const DRIVER_FOLDERS: [&str; 3] = [
    "/usr/share/vulkan/icd.d",
    "/etc/vulkan/icd.d",
    "/usr/local/share/vulkan/icd.d",
];

/// A capture under way: its folder, which goes with it, and the page that is shared with the programs.
#[derive(Debug)]
pub struct Launch {
    folder: ScratchFolder,
    /// Shared with the programs.
    pub control: Control,
    library: PathBuf,
    driver: Option<PathBuf>,
}

impl Launch {
    /// Sets a capture up inside `parent`, for programs on lavapipe. `tool` is this program's own file.
    ///
    /// # Errors
    /// A layer or a driver that is missing, or a folder that cannot be written.
    pub fn new(parent: &Path, tool: &Path, settings: &Settings) -> Result<Self, LaunchError> {
        let library = library(tool)?;
        let driver =
            match std::env::var_os("VK_DRIVER_FILES").or(std::env::var_os("VK_ICD_FILENAMES")) {
                Some(_) => None,
                None => Some(lavapipe().ok_or(LaunchError::NoDriver)?),
            };
        let set_up = || {
            let folder = ScratchFolder::create_in(parent)?;
            settings.save(folder.path())?;
            let control = Control::create(folder.path())?;
            fs::write(folder.path().join(MANIFEST), manifest(&library))?;
            Ok((folder, control))
        };
        let (folder, control) = set_up().map_err(|source| LaunchError::Folder {
            folder: parent.display().to_string(),
            source,
        })?;
        Ok(Self {
            folder,
            control,
            library,
            driver,
        })
    }

    /// Folder that programs write into.
    #[must_use]
    pub fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// The layer's library.
    #[must_use]
    pub fn library(&self) -> &Path {
        &self.library
    }

    /// Lets a program run on lavapipe, without the layer.
    pub fn prepare_driver(&self, command: &mut Command) {
        if let Some(driver) = &self.driver {
            command
                .env("VK_DRIVER_FILES", driver)
                .env("VK_ICD_FILENAMES", driver);
        }
    }

    /// Runs a program under the layer; OpenGL through Mesa's zink if requested.
    pub fn prepare(&self, command: &mut Command, opengl: bool) {
        command
            .env(FOLDER_VARIABLE, self.folder())
            .env(
                "VK_INSTANCE_LAYERS",
                with("VK_INSTANCE_LAYERS", LAYER_NAME.into()),
            )
            .env("VK_LAYER_PATH", with("VK_LAYER_PATH", self.folder().into()));
        self.prepare_driver(command);
        if opengl {
            command
                .env("GALLIUM_DRIVER", "zink")
                .env("MESA_LOADER_DRIVER_OVERRIDE", "zink")
                // Else zink finds no device.
                .env("LIBGL_ALWAYS_SOFTWARE", "1");
        }
    }
}

/// A variable's list with an entry before it.
fn with(variable: &str, entry: OsString) -> OsString {
    let mut list = entry;
    if let Some(old) = std::env::var_os(variable).filter(|old| !old.is_empty()) {
        list.push(":");
        list.push(old);
    }
    list
}

/// The layer's library, next to a program or among Cargo's build outputs.
fn library(tool: &Path) -> Result<PathBuf, LaunchError> {
    let folder = tool.parent().unwrap_or(Path::new("."));
    let places = [folder.join(LIBRARY), folder.join("deps").join(LIBRARY)];
    let found = places.iter().find(|place| place.is_file()).cloned();
    found.ok_or_else(|| LaunchError::NoLayer(places[0].display().to_string()))
}

fn lavapipe() -> Option<PathBuf> {
    let files = DRIVER_FOLDERS
        .iter()
        .filter_map(|folder| fs::read_dir(folder).ok())
        .flatten();
    let mut found: Vec<PathBuf> = files
        .filter_map(|file| Some(file.ok()?.path()))
        .filter(|path| {
            let name = path
                .file_name()
                .and_then(|name| name.to_str())
                .unwrap_or("");
            name.starts_with("lvp_icd") && name.ends_with(".json") && !name.contains("i686")
        })
        .collect();
    found.sort();
    found.into_iter().next()
}

fn manifest(library: &Path) -> String {
    // A path in JSON.
    let library = library
        .display()
        .to_string()
        .replace('\\', "\\\\")
        .replace('"', "\\\"");
    format!(
        r#"{{
  "file_format_version": "1.1.2",
  "layer": {{
    "name": "{LAYER_NAME}",
    "type": "GLOBAL",
    "library_path": "{library}",
    "api_version": "1.3.0",
    "implementation_version": "1",
    "description": "Records the texture samples of a program"
  }}
}}
"#
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_library_is_found_beside_the_tool_or_among_its_parts() {
        let folder = tempfile::tempdir().unwrap();
        let tool = folder.path().join("tracegen");
        let text = library(&tool).unwrap_err().to_string();
        assert!(text.contains("libparallax_layer.so is missing"), "{text}");
        let deps = folder.path().join("deps");
        fs::create_dir(&deps).unwrap();
        for place in [deps, folder.path().to_owned()] {
            let file = place.join(LIBRARY);
            fs::write(&file, b"").unwrap();
            assert_eq!(library(&tool).unwrap(), file);
        }
    }
}
