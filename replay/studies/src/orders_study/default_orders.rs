//! The default orders of a study.

use super::BASELINE;
use sim::config::Order;
use sim::order::Interleave;
use sim::order::curve::Curve;
use sim::order::parts::{Eyes, Parts};

/// The other parts, one at a time, with the best curves.
const FURTHER: [&str; 29] = [
    "strip16+sta",
    "strip32+sta",
    "band2+sta",
    "band8+sta",
    "morton+sta+offset",
    "zig-zag+sta+offset",
    "strip+sta+offset",
    "band+sta+offset",
    "adaptive+sta+offset",
    "morton+sta+infinity",
    "zig-zag+sta+infinity",
    "strip+sta+infinity",
    "band+sta+infinity",
    "band8+sta+infinity",
    "zig-zag+sta+row-primitives",
    "zig-zag+sta+row-lines",
    "zig-zag+lrta+offset",
    "zig-zag+merge+offset",
    "zig-zag+halves+offset",
    "morton+right-reversed",
    "zig-zag+right-reversed",
    "morton+sta+boustro",
    "zig-zag+sta+offset+boustro",
    "strip+sta+offset+boustro",
    "band+sta+infinity+boustro",
    "zig-zag+sta+offset+static",
    "zig-zag+sta+offset+affinity",
    "zig-zag+sta+offset+quads",
    "zig-zag+sta+offset+runs",
];

/// The baseline, the other orders of the table, every curve with both tiles of a cell on one core, and the
/// other parts.
pub fn default_orders() -> Vec<Order> {
    let together = Eyes::OneCore(Interleave::Alternate);
    let curves = Curve::all().map(|curve| Order::of(Parts::of(curve).with(together)));
    let further = FURTHER.iter().filter_map(|name| Order::find(name));
    let all = std::iter::once(BASELINE)
        .chain(Order::all())
        .chain(curves)
        .chain(further);
    let mut orders: Vec<Order> = Vec::new();
    for order in all {
        if !orders.contains(&order) {
            orders.push(order);
        }
    }
    orders
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_is_an_order_and_no_order_is_repeated() {
        let orders = default_orders();
        // Morton with STA is in the table of orders.
        assert_eq!(
            orders.len(),
            Order::all().len() + Curve::all().len() - 1 + FURTHER.len()
        );
        assert_eq!(orders[0], BASELINE);
    }
}
