//! Ray traces of files, as the model reads them.

use crate::sgrt::frame::RaySource;
use formats::raytrace::{RayTile, Raytrace, RaytraceTables};
use formats::view::Eye;
use std::error::Error;

/// An opened ray trace.
pub struct TraceFile(pub Raytrace);

impl RaySource for TraceFile {
    fn tables(&self) -> &RaytraceTables {
        self.0.tables()
    }

    fn tile(
        &self,
        eye: Eye,
        index: u32,
        tile: &mut RayTile,
    ) -> Result<(), Box<dyn Error + Send + Sync>> {
        Ok(self.0.decode_tile(eye, index, tile)?)
    }
}
