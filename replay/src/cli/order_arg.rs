//! Tile orders as arguments: names or lists of parts, one order or several.

use super::choice::possible_values;
use anyhow::{Result, bail};
use clap::builder::{PossibleValue, TypedValueParser};
use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Arg, Command, Error};
use sim::config::Order;
use sim::paper::z2;
use std::ffi::OsStr;

/// Parses an order. Help and completions show the table.
#[derive(Clone, Debug)]
pub(super) struct OrderParser;

impl TypedValueParser for OrderParser {
    type Value = Order;

    fn parse_ref(
        &self,
        command: &Command,
        arg: Option<&Arg>,
        value: &OsStr,
    ) -> Result<Order, Error> {
        let text = value.to_string_lossy();
        Order::by_name(&text).map_err(|why| {
            let arg = arg.map_or_else(|| "--order".to_owned(), ToString::to_string);
            if let Some(why) = why {
                let message = format!("invalid value '{text}' for '{arg}': {why}\n");
                return Error::raw(ErrorKind::InvalidValue, message).with_cmd(command);
            }
            let mut error = Error::new(ErrorKind::InvalidValue).with_cmd(command);
            let known = Order::all().map(|order| order.name().to_owned()).collect();
            for (kind, value) in [
                (ContextKind::InvalidArg, ContextValue::String(arg)),
                (
                    ContextKind::InvalidValue,
                    ContextValue::String(text.into_owned()),
                ),
                (ContextKind::ValidValue, ContextValue::Strings(known)),
            ] {
                error.insert(kind, value);
            }
            error
        })
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        Some(Box::new(possible_values::<Order>()))
    }
}

/// Parses comma-separated orders. `all` stands for all orders of the table.
///
/// # Errors
/// An unknown order.
pub(super) fn parse_orders(text: &str) -> Result<Vec<Order>> {
    if text == "all" {
        let others = Order::all().filter(|o| !z2::ORDERS.contains(o));
        return Ok(z2::ORDERS.into_iter().chain(others).collect());
    }
    parse_named(text)
}

/// Parses the order that savings are over, and others. Returns the former first.
///
/// # Errors
/// An unknown order, or several baselines.
pub(super) fn parse_over(baseline: &str, orders: &str) -> Result<Vec<Order>> {
    let [first] = parse_named(baseline)?[..] else {
        bail!("--baseline: expected one order, found `{baseline}`");
    };
    let mut orders = parse_named(orders)?;
    orders.retain(|order| *order != first);
    orders.insert(0, first);
    Ok(orders)
}

/// Parses comma-separated orders without `all`.
pub(super) fn parse_named(text: &str) -> Result<Vec<Order>> {
    let mut orders = Vec::new();
    for name in text.split(',').map(str::trim) {
        let order = match Order::by_name(name) {
            Ok(order) => order,
            Err(Some(why)) => bail!("--orders: {why}"),
            Err(None) => {
                let known: Vec<&str> = Order::all().map(|o| o.name()).collect();
                let similar = Order::similar(name);
                let hint =
                    similar.map_or(String::new(), |o| format!("; did you mean `{}`?", o.name()));
                bail!(
                    "--orders: expected `all`, names, or parts as in zig-zag+sta+offset (docs/models/orders.md); the names are {}; \
                     found `{name}`{hint}",
                    known.join(", ")
                );
            }
        };
        if !orders.contains(&order) {
            orders.push(order);
        }
    }
    Ok(orders)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_orders_start_with_those_of_the_paper() {
        let orders = parse_orders("all").unwrap();
        assert_eq!(orders[..3], z2::ORDERS);
        assert_eq!(orders.len(), Order::all().len());
    }

    #[test]
    fn the_error_for_an_unknown_order_lists_the_known_ones() {
        let known: Vec<&str> = Order::all().map(Order::name).collect();
        assert_eq!(
            parse_orders("morton,spiral").unwrap_err().to_string(),
            format!(
                "--orders: expected `all`, names, or parts as in zig-zag+sta+offset (docs/models/orders.md); the names are {}; \
                 found `spiral`",
                known.join(", ")
            )
        );
    }

    #[test]
    fn a_mistyped_order_comes_with_a_suggestion() {
        for (typed, order) in [
            ("z2-sts", "z2-sta"),
            ("Mortn", "morton"),
            ("hilber", "hilbert"),
        ] {
            let error = parse_orders(typed).unwrap_err().to_string();
            let hint = format!("found `{typed}`; did you mean `{order}`?");
            assert!(error.ends_with(&hint), "{error}");
        }
    }

    #[test]
    fn an_order_is_found_by_its_parts() {
        let orders = parse_orders("z2-sta,morton+sta,strip4+sta+boustro").unwrap();
        let names: Vec<&str> = orders.iter().map(|order| order.name()).collect();
        assert_eq!(names, ["z2-sta", "strip4+sta+boustro"]);
        let error = parse_orders("strip4+sta+sta").unwrap_err().to_string();
        assert_eq!(
            error,
            "--orders: `sta`: expected one way to combine the eyes, found two"
        );
    }
}
