//! Sets up the environment in which programs run with the layer.

use crate::loader;
use formats::container::ScratchFolder;
use spool::Settings;
use spool::control::Control;
use spool::openxr::RuntimeSettings;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::Command;
use thiserror::Error;

/// Reasons why a program cannot be launched.
#[derive(Debug, Error)]
pub enum LaunchError {
    /// A library that programs load is missing.
    #[error(
        "{0} is missing: `make install` installs it with the programs, and `make build` builds it beside them; `cargo install` installs no libraries"
    )]
    NoLibrary(String),
    /// The capture's folder cannot be written.
    #[error("cannot set up the capture in {folder}: {source}")]
    Folder {
        /// Path of the folder.
        folder: String,
        /// Error of the system.
        source: std::io::Error,
    },
    /// Lavapipe is not installed.
    #[error(
        "no Vulkan driver file of lavapipe was found; install mesa-vulkan-drivers, or name one by VK_DRIVER_FILES"
    )]
    NoDriver,
    /// An environment variable names no driver.
    #[error("{variable}={value}: expected a Vulkan driver file or a folder with one, found none")]
    DriverFiles {
        /// The variable.
        variable: &'static str,
        /// Its value.
        value: String,
    },
}

/// File names of the layer's and the OpenXR runtime's library.
const LIBRARY: &str = "libparallax_layer.so";
const OPENXR_LIBRARY: &str = "libparallax_xr.so";
/// File that is locked while a capture runs.
const LOCK: &str = "lock";

/// A capture: its folder, which is removed at the end, and the page of memory shared with the programs.
#[derive(Debug)]
pub struct Launch {
    folder: ScratchFolder,
    /// Page of memory shared with the programs.
    pub control: Control,
    library: PathBuf,
    driver: Option<PathBuf>,
    /// Locked while this process runs; see [`remove_abandoned`].
    _locked: File,
}

impl Launch {
    /// Prepares a capture inside `parent` for programs on lavapipe. `tool` is the path of this program. Removes
    /// the folders of killed captures.
    ///
    /// # Errors
    /// The layer or the driver is missing, or the folder cannot be written.
    pub fn new(parent: &Path, tool: &Path, settings: &Settings) -> Result<Self, LaunchError> {
        let library = library(tool, LIBRARY)?;
        let driver = match loader::driver_of_user()? {
            Some(_) => None,
            None => {
                let installed = mesa::driver_files().into_iter().next();
                Some(installed.ok_or(LaunchError::NoDriver)?)
            }
        };
        remove_abandoned(parent);
        let set_up = || {
            let folder = loader::folder_in(parent)?;
            settings.save(folder.path())?;
            let control = Control::create(folder.path())?;
            let locked = lock(folder.path())?;
            loader::register(folder.path(), &library)?;
            Ok((folder, control, locked))
        };
        let (folder, control, locked) = set_up().map_err(|source| LaunchError::Folder {
            folder: parent.display().to_string(),
            source,
        })?;
        Ok(Self {
            folder,
            control,
            library,
            driver,
            _locked: locked,
        })
    }

    /// Folder of the programs' files.
    pub fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// Path of the layer's library.
    pub fn library(&self) -> &Path {
        &self.library
    }

    /// Makes a program use lavapipe, without the layer.
    pub fn prepare_driver(&self, command: &mut Command) {
        if let Some(driver) = &self.driver {
            loader::choose_driver(command, driver);
        }
    }

    /// Makes a program use an OpenXR runtime of the capture.
    ///
    /// # Errors
    /// The capture's folder cannot be written.
    pub fn prepare_openxr(
        &self,
        command: &mut Command,
        runtime: &Path,
        settings: &RuntimeSettings,
    ) -> std::io::Result<()> {
        settings.save(self.folder())?;
        loader::register_openxr(command, self.folder(), runtime)
    }

    /// Makes a program use the layer, and Mesa's zink for OpenGL if requested.
    pub fn prepare(&self, command: &mut Command, opengl: bool) {
        loader::announce(command, self.folder());
        self.prepare_driver(command);
        if opengl {
            command
                .env("GALLIUM_DRIVER", "zink")
                .env("MESA_LOADER_DRIVER_OVERRIDE", "zink")
                // Otherwise zink finds no device.
                .env("LIBGL_ALWAYS_SOFTWARE", "1");
        }
    }
}

/// Locks the folder of a capture. Only a running process holds the lock.
fn lock(folder: &Path) -> std::io::Result<File> {
    let file = File::create(folder.join(LOCK))?;
    file.try_lock()?;
    Ok(file)
}

/// Removes the folders of captures that were killed together with their supervisor.
fn remove_abandoned(parent: &Path) {
    for entry in fs::read_dir(parent).into_iter().flatten().flatten() {
        let folder = entry.path();
        // The manifest is written under the lock, so a folder that has one and no lock is abandoned.
        if ScratchFolder::has_name_of(&folder)
            && folder.join(loader::MANIFEST).is_file()
            && lock(&folder).is_ok()
        {
            // A folder that cannot be removed does not disturb this capture.
            let _left = fs::remove_dir_all(folder);
        }
    }
}

/// Finds the OpenXR runtime's library next to a program.
///
/// # Errors
/// It is missing.
pub fn openxr_library(tool: &Path) -> Result<PathBuf, LaunchError> {
    library(tool, OPENXR_LIBRARY)
}

/// Finds a library next to a program, among Cargo's build outputs, which may be newer, or where
/// `scripts/dist.py` puts it.
fn library(tool: &Path, name: &str) -> Result<PathBuf, LaunchError> {
    let folder = tool.parent().unwrap_or(Path::new("."));
    let installed = folder.with_file_name("lib").join("parallax");
    let beside = folder.join(name);
    let places = [
        &installed.join(name),
        &folder.join("deps").join(name),
        &beside,
    ];
    let files = places.into_iter().filter(|place| place.is_file());
    let found = files.max_by_key(|place| fs::metadata(place).and_then(|of| of.modified()).ok());
    found
        .cloned()
        .ok_or_else(|| LaunchError::NoLibrary(beside.display().to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_of_a_killed_capture_is_removed_and_one_of_a_running_capture_stays() {
        let parent = tempfile::tempdir().unwrap();
        let [killed, running, other] =
            [".scratch-a", ".scratch-b", "other"].map(|name| parent.path().join(name));
        for folder in [&killed, &running, &other] {
            fs::create_dir(folder).unwrap();
            fs::write(folder.join(loader::MANIFEST), b"").unwrap();
        }
        let _locked = lock(&running).unwrap();
        remove_abandoned(parent.path());
        assert!(!killed.exists() && running.exists() && other.exists());
    }

    #[test]
    fn the_library_is_found_next_to_the_tool_in_deps_or_where_it_is_installed() {
        let folder = tempfile::tempdir().unwrap();
        let [bin, deps, installed] =
            ["bin", "bin/deps", "lib/parallax"].map(|place| folder.path().join(place));
        let tool = bin.join("tracegen");
        let text = library(&tool, LIBRARY).unwrap_err().to_string();
        assert!(text.contains("libparallax_layer.so is missing"), "{text}");
        for place in [installed, deps, bin] {
            fs::create_dir_all(&place).unwrap();
            let file = place.join(LIBRARY);
            fs::write(&file, b"").unwrap();
            assert_eq!(library(&tool, LIBRARY).unwrap(), file);
        }
    }
}
