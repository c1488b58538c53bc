//! Which driver captures.

use crate::backend::CaptureBackend;
use crate::draws::DrawList;
use crate::error::RasterError;
use crate::lavapipe::{Lavapipe, device};
use crate::osmesa::Osmesa;
use scene::Scene;
use textures::TextureSet;

/// A driver by name, or whichever is there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Driver {
    /// Mesa's Vulkan driver on the processor.
    #[default]
    Lavapipe,
    /// Mesa's OpenGL without a window: plain frames alone.
    Osmesa,
    /// The first where it is found, else the second.
    Auto,
}

impl Driver {
    /// Opens the driver and uploads the scene for views of `view_size_px`. Regions may produce
    /// `record_budget_bytes` of raw records before they are split.
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
    ) -> Result<Box<dyn CaptureBackend>, RasterError> {
        let osmesa = || Osmesa::new(scene, draws, textures, record_budget_bytes);
        if self == Self::Osmesa {
            return Ok(Box::new(osmesa()?));
        }
        let gpu = match device::open(None) {
            Err(none @ RasterError::NoDriver(_)) if self == Self::Auto => {
                let nor = |e| RasterError::NoBackend(Box::new(none), Box::new(e));
                return Ok(Box::new(osmesa().map_err(nor)?));
            }
            gpu => gpu?,
        };
        let budget = record_budget_bytes;
        let lavapipe = Lavapipe::on(gpu, scene, draws, textures, view_size_px, budget)?;
        Ok(Box::new(lavapipe))
    }
}
