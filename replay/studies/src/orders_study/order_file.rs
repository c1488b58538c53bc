//! Files of searched orders: text with a header and a line per item.
//!
//! ```text
//! parallax order 1
//! trace 2298d60d
//! name anneal
//! l2_bytes 131072
//! items 2
//! 0:17 1:17
//! 0:18
//! ```
//!
//! The name is not that of another order. An item is a tile, or two tiles whose triangles are rendered in turn. A tile is the index of its pass and
//! its number. The items visit all tiles of both passes once.

use super::Bound;
use formats::textrace::Tables;
use sim::order::{Interleave, Order, TileRef, Views, WorkItem, check_items, views};
use std::fmt::Write as _;
use thiserror::Error;

const MAGIC: &str = "parallax order 1";

/// A searched order of one frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OrderFile {
    /// Checksum of the trace's content.
    pub trace: String,
    /// The name of the search method.
    pub name: String,
    /// The L2 that it was searched for.
    pub l2_bytes: u64,
    /// Its items.
    pub items: Vec<WorkItem>,
}

/// An unreadable file, or items that are not an order.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("line {line}: expected {expected}, found {found}")]
pub struct OrderFileError {
    /// From 1; one past the end if something is missing.
    line: usize,
    expected: String,
    found: String,
}

fn error<T>(line: usize, expected: impl Into<String>, found: &str) -> Result<T, OrderFileError> {
    let found = if found.is_empty() {
        "nothing".to_owned()
    } else {
        format!("`{found}`")
    };
    Err(OrderFileError {
        line,
        expected: expected.into(),
        found,
    })
}

impl OrderFile {
    /// The file's text.
    pub fn text(&self) -> String {
        let mut text = format!(
            "{MAGIC}\ntrace {}\nname {}\nl2_bytes {}\nitems {}\n",
            self.trace,
            self.name,
            self.l2_bytes,
            self.items.len()
        );
        for item in &self.items {
            let tiles: Vec<String> = item
                .tiles()
                .map(|at| format!("{}:{}", at.pass, at.tile))
                .collect();
            let _ = writeln!(text, "{}", tiles.join(" "));
        }
        text
    }

    /// Reads a file's text.
    ///
    /// # Errors
    /// The first error, with its line.
    pub fn parse(text: &str) -> Result<Self, OrderFileError> {
        let mut lines = (1..).zip(text.lines());
        let mut next = |key: &str, expected: &str| -> Result<String, OrderFileError> {
            let (line, text) = lines.next().unwrap_or((text.lines().count() + 1, ""));
            let value = if key.is_empty() {
                Some(text).filter(|text| *text == MAGIC)
            } else {
                text.strip_prefix(key)
                    .and_then(|rest| rest.strip_prefix(' '))
            };
            let value = value.filter(|value| !value.is_empty()).map(str::to_owned);
            value.map_or_else(|| error(line, expected, text), Ok)
        };
        next("", "`parallax order 1`")?;
        let trace = next("trace", "`trace CHECKSUM`")?;
        let name = next("name", "`name NAME`")?;
        if Order::by_name(&name).is_ok() || name.starts_with(Bound::PREFIX) {
            return error(3, "a name of no other order or bound", &name);
        }
        let l2_bytes = next("l2_bytes", "`l2_bytes BYTES`")?;
        let count = next("items", "`items COUNT`")?;
        let Ok(l2_bytes) = l2_bytes.parse() else {
            return error(4, "a number of bytes", &l2_bytes);
        };
        let Ok(count) = count.parse::<usize>() else {
            return error(5, "a number of items", &count);
        };
        let mut items = Vec::new();
        for (line, text) in lines {
            let mut tiles = text.split(' ').map(tile);
            let item = match (tiles.next().flatten(), tiles.next(), tiles.next()) {
                (Some(tile), None, None) => WorkItem::Tile(tile),
                (Some(left), Some(Some(right)), None) => {
                    WorkItem::Pair(left, right, Interleave::Alternate)
                }
                _ => return error(line, "one or two tiles as in `0:17 1:17`", text),
            };
            items.push(item);
        }
        if items.len() != count {
            return error(
                5,
                format!("{count} items after the header"),
                &items.len().to_string(),
            );
        }
        Ok(Self {
            trace,
            name,
            l2_bytes,
            items,
        })
    }

    /// The pass of the left view of these items.
    ///
    /// # Errors
    /// The items do not visit all tiles of a left and a right view once.
    pub fn check(&self, tables: &Tables) -> Result<u32, OrderFileError> {
        let first = self.items.iter().flat_map(WorkItem::tiles).next();
        let Some(first) = first else {
            return error(6, "an item", "");
        };
        let frame = tables
            .passes
            .get(first.pass as usize)
            .map_or(0, |pass| pass.frame);
        let pair = views(&tables.passes, frame)
            .into_iter()
            .find_map(|phase| match phase {
                Views::Pair(left, right) if [left.pass, right.pass].contains(&first.pass) => {
                    Some([left, right])
                }
                _ => None,
            });
        let Some(eyes) = pair else {
            return error(
                6,
                "a tile of a pass of one of two eyes",
                &format!("{}:{}", first.pass, first.tile),
            );
        };
        check_items(&self.items, eyes)
            .or_else(|fault| error(6 + fault.item, fault.expected, &fault.found.to_string()))?;
        Ok(eyes[0].pass)
    }
}

fn tile(text: &str) -> Option<TileRef> {
    let (pass, tile) = text.split_once(':')?;
    Some(TileRef {
        pass: pass.parse().ok()?,
        tile: tile.parse().ok()?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use sim::stream::testing::Synthetic;

    fn file() -> OrderFile {
        let tile = |pass, tile| TileRef { pass, tile };
        OrderFile {
            trace: "0badcafe".into(),
            name: "greedy".into(),
            l2_bytes: 131_072,
            items: vec![
                WorkItem::Pair(tile(0, 1), tile(1, 0), Interleave::Alternate),
                WorkItem::Tile(tile(0, 0)),
                WorkItem::Tile(tile(1, 1)),
            ],
        }
    }

    fn tables() -> Tables {
        Synthetic::one_layer([32, 16], 120).generate().tables
    }

    #[test]
    fn a_written_file_reads_back_the_same() {
        let text = file().text();
        assert_eq!(text.lines().nth(5), Some("0:1 1:0"));
        assert_eq!(OrderFile::parse(&text), Ok(file()));
        assert_eq!(file().check(&tables()), Ok(0));
    }

    #[test]
    fn an_invalid_order_file_is_refused_with_the_line() {
        let text = file().text();
        for (from, to, expected) in [
            (
                "order 1",
                "order 2",
                "line 1: expected `parallax order 1`, found `parallax order 2`",
            ),
            (
                "trace 0badcafe",
                "trace ",
                "line 2: expected `trace CHECKSUM`, found `trace `",
            ),
            (
                "name greedy",
                "name z2-sta",
                "line 3: expected a name of no other order or bound, found `z2-sta`",
            ),
            (
                "name greedy",
                "name strip4+sta",
                "line 3: expected a name of no other order or bound, found `strip4+sta`",
            ),
            (
                "name greedy",
                "name bound: windows",
                "line 3: expected a name of no other order or bound, found `bound: windows`",
            ),
            (
                "131072",
                "-1",
                "line 4: expected a number of bytes, found `-1`",
            ),
            (
                "items 3",
                "items 4",
                "line 5: expected 4 items after the header, found `3`",
            ),
            (
                "0:1 1:0",
                "0:1 1:0 0:0",
                "line 6: expected one or two tiles as in `0:17 1:17`, found `0:1 1:0 0:0`",
            ),
            (
                "0:1 1:0",
                "0:1 1",
                "line 6: expected one or two tiles as in `0:17 1:17`, found `0:1 1`",
            ),
        ] {
            assert_eq!(
                OrderFile::parse(&text.replace(from, to))
                    .unwrap_err()
                    .to_string(),
                expected
            );
        }
        assert_eq!(
            OrderFile::parse("").unwrap_err().to_string(),
            "line 1: expected `parallax order 1`, found nothing"
        );
    }

    #[test]
    fn an_order_that_is_not_a_permutation_of_the_tiles_is_refused() {
        let check = |change: fn(&mut Vec<WorkItem>)| {
            let mut file = file();
            change(&mut file.items);
            file.check(&tables()).unwrap_err().to_string()
        };
        let tile = |pass, tile| WorkItem::Tile(TileRef { pass, tile });
        assert_eq!(tile(0, 0), file().items[1]);
        assert_eq!(
            check(|items| items.truncate(2)),
            "line 8: expected every tile of both passes, found `1 tiles not listed`"
        );
        assert_eq!(
            check(|items| items[2] = items[1]),
            "line 8: expected a tile of these passes that was not listed yet, found `0:0`"
        );
        assert_eq!(
            check(|items| items[1] = WorkItem::Tile(TileRef { pass: 0, tile: 2 })),
            "line 7: expected a tile of these passes that was not listed yet, found `0:2`"
        );
        assert_eq!(check(Vec::clear), "line 6: expected an item, found nothing");
    }
}
