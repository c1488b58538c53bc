//! Foveation: coarser shading away from the gaze. One technique per file.
//!
//! Each technique renders layers of lower resolution. A coarse pixel therefore samples as on a display with
//! fewer pixels: its derivatives span more texels, which selects coarser mip levels.

pub(crate) mod acuity;
pub mod lens_matched;
pub(crate) mod multi_resolution;
pub(crate) mod radial_density;
pub(crate) mod rings;
