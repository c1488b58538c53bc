//! What lies below the caches, and who asks it for what.

pub mod clients;
pub mod dram;
