//! Compares tile orders with each other and with bounds: the bytes that they fetch and the hardware that they
//! need.
//!
//! [`study`] replays every order with every pair of caches. [`search`] finds better orders from the accesses of
//! the frame, and [`bounds`] computes lower bounds. [`learn`] chooses an order per frame.

mod anneal;
pub mod bounds;
mod default_orders;
mod greedy;
mod items;
pub mod learn;
mod order_file;
mod row;
pub mod search;
mod stream;
mod study;

pub use default_orders::default_orders;
pub use items::Items;
pub use order_file::{OrderFile, OrderFileError};
pub use row::{BASELINE, Bound, CornerBytes, OrderRow, RowKind};
pub use study::{Corners, OrdersError, OrdersStudy, Searched, Subjects};
