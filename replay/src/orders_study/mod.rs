//! Tile orders held against each other and against bounds: which fetches the fewest bytes, what hardware it needs, and how
//! much is left.
//!
//! [`study`] replays every order with every pair of caches; [`search`] looks for better orders with the frame's own accesses
//! in hand, and [`bounds`] says what no order gets below; [`learn`] chooses an order from frame to frame.

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
pub use row::{BASELINE, Bound, Of, Row};
pub use study::{Searched, Study, StudyError, Subjects};
