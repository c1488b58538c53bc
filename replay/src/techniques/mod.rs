//! What a folder of `tracegen techniques` holds, measured: frame times against the baseline's,
//! image errors where the user can see, and what both eyes share in their traces.
//!
//! The folder is read alone: its manifest, pictures and traces are all that is known of a capture.

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

#[cfg(test)]
pub(crate) mod testing;
#[cfg(test)]
mod tests;

pub use folder::{Folder, FolderError};
pub use measured::{CacheFigures, Count, Gain, Measured, Measures, OrderGain};
pub use pacing::{Pacing, RATES_HZ};
pub use pareto::{dominated, dominated_in_time};
pub use pictures::{PictureFigures, picture_figures};
pub use sharing::{Sharing, sharing};
pub use skipped::{Difference, DifferenceError, differences};
pub use timing::{REFRESH_HZ, Spread, Timing};
