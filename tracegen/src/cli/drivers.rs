//! Selection of the driver that captures.

use anyhow::anyhow;
use raster::backend::CaptureBackend;
use raster::draws::DrawList;
use raster::error::RasterError;
use raster::lavapipe::{Lavapipe, device};
use scene::Scene;
use std::env;
use std::path::PathBuf;
use textures::TextureSet;

/// A driver by name, or the first one available.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Driver {
    /// Mesa's Vulkan driver on the processor.
    #[default]
    Lavapipe,
    /// Mesa's OpenGL without a window, which captures only plain frames.
    Osmesa,
    /// Lavapipe if it is installed and can capture, else OSMesa.
    Auto,
}

impl Driver {
    /// Opens the driver and uploads the scene for views of `view_size_px`. A region is split if its
    /// raw records exceed `record_budget_bytes`.
    ///
    /// # Errors
    /// No driver, driver errors, sizes beyond its limits.
    pub fn open(
        self,
        scene: &Scene,
        draws: &DrawList,
        textures: &TextureSet,
        view_size_px: [u32; 2],
        record_budget_bytes: u64,
    ) -> anyhow::Result<Opened> {
        let budget = record_budget_bytes;
        let osmesa = || -> anyhow::Result<Box<dyn CaptureBackend>> {
            #[cfg(feature = "osmesa")]
            return Ok(Box::new(osmesa::Osmesa::new(
                scene, draws, textures, budget,
            )?));
            #[cfg(not(feature = "osmesa"))]
            anyhow::bail!(
                "this program is built without the driver osmesa; `make build` builds it with all drivers"
            )
        };
        let lavapipe = || -> Result<Box<dyn CaptureBackend>, RasterError> {
            let lavapipe = Lavapipe::new(
                device::open(None)?,
                scene,
                draws,
                textures,
                view_size_px,
                budget,
            )?;
            Ok(Box::new(lavapipe))
        };
        let (backend, instead_of) = match self {
            Self::Lavapipe => (lavapipe()?, None),
            Self::Osmesa => (osmesa()?, None),
            Self::Auto => either(lavapipe(), osmesa)?,
        };
        Ok(Opened {
            backend,
            instead_of,
        })
    }
}

/// Files that change with the version of a driver: those in which drivers name their library, the libraries, and
/// the list of the system's libraries.
pub fn version_files() -> Vec<PathBuf> {
    let mut files = mesa::driver_files();
    for variable in ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"] {
        files.extend(env::var_os(variable).iter().flat_map(env::split_paths));
    }
    let library = |path: &PathBuf| {
        let text = std::fs::read(path).ok()?;
        let value: serde_json::Value = serde_json::from_slice(&text).ok()?;
        let library = value.pointer("/ICD/library_path")?.as_str()?;
        Some(path.parent()?.join(library))
    };
    let libraries: Vec<PathBuf> = files.iter().filter_map(library).collect();
    files.extend(libraries);
    files.push(PathBuf::from("/etc/ld.so.cache"));
    files
}

/// An opened driver.
pub struct Opened {
    /// The driver.
    pub backend: Box<dyn CaptureBackend>,
    /// Why the preferred driver does not capture, if it does not.
    pub instead_of: Option<RasterError>,
}

/// The first driver or, if it is missing or lacks a feature, the second one with the reason.
fn either<B>(
    first: Result<B, RasterError>,
    second: impl FnOnce() -> anyhow::Result<B>,
) -> anyhow::Result<(B, Option<RasterError>)> {
    match first {
        Err(error) if error.is_of_the_driver() => match second() {
            Ok(backend) => Ok((backend, Some(error))),
            Err(other) => Err(anyhow!("{error}; nor OSMesa: {other}")),
        },
        first => Ok((first?, None)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lacking() -> RasterError {
        RasterError::Unsupported {
            driver: "lavapipe".into(),
            what: "PRIMITIVE_INDEX".into(),
        }
    }

    #[test]
    fn the_second_driver_replaces_one_that_lacks_a_feature_and_both_reasons_are_reported() {
        let absent = || Err(anyhow!("libOSMesa.so.8 is absent"));
        let both = either::<()>(Err(lacking()), absent);
        let error = both.expect_err("no driver at all").to_string();
        assert!(error.contains("PRIMITIVE_INDEX"), "{error}");
        assert!(error.contains("libOSMesa.so.8"), "{error}");
        let mut tried = false;
        let other = RasterError::Scene("inconsistent".into());
        let error = either::<()>(Err(other), || {
            tried = true;
            absent()
        });
        assert!(error.is_err() && !tried, "another driver helps no scene");
        let (backend, instead_of) = either(Err(lacking()), || Ok("osmesa")).unwrap();
        assert_eq!(backend, "osmesa");
        assert!(instead_of.is_some_and(|error| error.to_string().contains("PRIMITIVE_INDEX")));
        let (backend, instead_of) = either(Ok("lavapipe"), || Ok("osmesa")).unwrap();
        assert!(backend == "lavapipe" && instead_of.is_none());
    }
}
