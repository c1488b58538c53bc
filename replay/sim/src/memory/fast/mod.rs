//! Accelerated caches. Property tests hold each equal to the plain caches.

mod forest;
mod set_order;

pub use forest::Forest;
