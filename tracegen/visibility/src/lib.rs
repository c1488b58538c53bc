//! Which draw enters which view or shadow cascade. One technique a file.

pub mod culling;
pub mod frustum;
pub mod magnification;
pub mod receivers;
pub mod triangles;

pub use culling::Culling;
