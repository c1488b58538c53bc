//! Evaluates a folder of `tracegen techniques`: frame times against the baseline's, image errors inside the
//! visible area, and cache lines that both eyes share.
//!
//! All data about a capture comes from the folder: its manifest, pictures and traces.

mod check;
mod folder;
pub mod manifest;
mod measured;
mod pacing;
mod pareto;
mod pictures;
mod sharing;
mod skipped;
mod timing;

#[cfg(any(test, feature = "testing"))]
pub mod testing;
#[cfg(test)]
mod tests;

pub use folder::{Folder, FolderError};
pub use measured::{CacheFigures, Count, Gain, Measured, Measures, OrderGain};
pub use pacing::{Pacing, RATES_HZ};
pub use pareto::{LEAST_SAMPLES, dominated, dominated_in_time};
pub use pictures::{PictureFigures, picture_figures};
pub use sharing::{Sharing, sharing};
pub use skipped::{Difference, differences};
pub use timing::{REFRESH_HZ, Spread, Timing};
