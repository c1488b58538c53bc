//! Which draw enters which view or shadow cascade. One technique a file.

pub mod frustum;
pub mod triangles;
