//! Orders of parts that no row of the table has: made when they are first named, and kept.

use super::parts::Parts;
use super::{Order, OrderRow};
use std::sync::{Mutex, PoisonError};

/// Those that were named so far. An order is copied with every configuration, so its name lives as long as the program;
/// a name is kept once.
static NAMED: Mutex<Vec<&'static OrderRow>> = Mutex::new(Vec::new());

/// The order with these parts: the table's row of the same parts, else one with a name of its parts.
pub(super) fn order(parts: Parts) -> Order {
    if let Some(order) = Order::all().find(|order| order.parts() == parts) {
        return order;
    }
    let mut named = NAMED.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(row) = named.iter().find(|row| row.parts == parts) {
        return Order::new(row);
    }
    let name: &'static str = parts.to_string().leak();
    let row: &'static OrderRow = Box::leak(Box::new(OrderRow {
        name,
        title: name,
        color: parts.curve.color(),
        help: "",
        parts,
        listed: None,
    }));
    named.push(row);
    Order::new(row)
}
