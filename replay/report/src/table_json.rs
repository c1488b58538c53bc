//! A table in JSON: an array with an object per row, whose keys are those of the columns. If the row has figures with
//! their doubt, its object `figures` has them under the same keys.

use super::columns::{Heading, Value};
use super::table::Table;
use serde::ser::{Error, Serialize, SerializeMap, Serializer};
use serde_json::Map;

impl Serialize for Table {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let headings = &self.headings;
        serializer.collect_seq(self.rows.iter().map(|cells| Record { headings, cells }))
    }
}

/// A row as an object. Columns whose keys have the same prefix before a dot are adjacent.
struct Record<'a> {
    headings: &'a [Heading],
    cells: &'a [Value],
}

/// The prefix of a key before its dot.
fn prefix(heading: &Heading) -> Option<&str> {
    heading.key.split_once('.').map(|(first, _)| first)
}

impl Serialize for Record<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let cells: Vec<(&Heading, &Value)> = self.headings.iter().zip(self.cells).collect();
        let same = |a: &Heading, b: &Heading| prefix(a).is_some() && prefix(a) == prefix(b);
        let figures = cells.iter().filter_map(|(heading, value)| {
            let figure = serde_json::to_value(value.figure()?);
            Some(figure.map(|figure| (heading.key.to_string(), figure)))
        });
        let figures: Result<Map<String, _>, _> = figures.collect();
        let figures = figures.map_err(S::Error::custom)?;
        let mut map = serializer.serialize_map(None)?;
        for group in cells.chunk_by(|a, b| same(a.0, b.0)) {
            let (first, value) = group[0];
            match prefix(first) {
                None => map.serialize_entry(first.key.as_ref(), value)?,
                Some(name) if group.iter().all(|(_, value)| **value == Value::None) => {
                    map.serialize_entry(name, &())?;
                }
                Some(name) => {
                    let inner = group.iter().map(|(heading, value)| {
                        let key = &heading.key[name.len() + 1..];
                        (key.to_owned(), serde_json::json!(value))
                    });
                    map.serialize_entry(name, &Map::from_iter(inner))?;
                }
            }
        }
        if !figures.is_empty() {
            map.serialize_entry("figures", &figures)?;
        }
        map.end()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::columns::{Column, Show};
    use sim::figure::Figure;

    #[test]
    fn figures_are_beside_the_plain_numbers_and_only_where_they_exist() {
        let column = Column::real("saved_pct", "saved", "%", 1, |f: &Option<Figure>| f.clone());
        let bounds = Figure::bounded(42.0, [40.5, 43.0], "3 starts".to_owned());
        let table = Table::new(&[column], &[Some(bounds), None]);
        let json = serde_json::to_value(&table).unwrap();
        assert_eq!(json[0]["saved_pct"], 42.0);
        assert_eq!(json[0]["figures"]["saved_pct"]["low"], 40.5);
        assert_eq!(json[1], serde_json::json!({ "saved_pct": null }));
        assert_eq!(
            table.csv(),
            "saved_pct,saved_pct_low,saved_pct_high\n42,40.5,43\n,,\n"
        );
        assert_eq!(table.cells(), [["42.0 [40.5 to 43.0]"], [""]]);
    }

    #[test]
    fn keys_with_dots_nest_and_an_empty_group_is_null() {
        let columns: [Column<Option<f64>>; 3] = [
            Column::new(
                "misses",
                "misses",
                "M",
                Show::Millions(1),
                |_: &Option<f64>| 7_u64,
            ),
            Column::real("paper.rate", "paper", "%", 2, |p: &Option<f64>| *p).published(),
            Column::real("paper.half", "half", "%", 2, |p: &Option<f64>| {
                p.map(|x| x / 2.0)
            }),
        ];
        let json = |paper| serde_json::to_string(&Table::new(&columns, &[paper])).unwrap();
        assert_eq!(
            json(Some(3.0)),
            r#"[{"misses":7,"paper":{"rate":3.0,"half":1.5}}]"#
        );
        assert_eq!(json(None), r#"[{"misses":7,"paper":null}]"#);
    }
}
