//! Foveation: coarser shading away from the gaze. One technique per file.
//!
//! Each renders layers of its own sizes, so that what a coarse pixel samples is what it would sample on a
//! display with fewer pixels: its derivatives span more texels, and coarser mip levels follow by themselves.

pub(crate) mod acuity;
pub mod lens_matched;
pub(crate) mod multi_resolution;
pub(crate) mod radial_density;
pub(crate) mod rings;
