//! Orders whose parts have no row in the table. They are created when first named, and kept.

use super::parts::Parts;
use super::{Order, OrderRow};
use std::sync::{Mutex, PoisonError};

/// The orders created so far. An order is copied with every configuration, so its name must live until the
/// program ends. Each name is stored once.
static NAMED: Mutex<Vec<&'static OrderRow>> = Mutex::new(Vec::new());

/// The order with these parts: the table's row with the same parts, otherwise an order whose name lists them.
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
