//! Accelerators of caches. Each equals the plain caches, as property tests hold.

mod forest;
mod set_order;

pub use forest::Forest;
pub(super) use set_order::SetOrder;
