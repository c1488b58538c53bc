//! Tables as Parquet files: typed columns with the names of the CSV's columns, for DuckDB, Polars and
//! pandas. Cells that are empty in CSV are null.

use super::columns::{Heading, Kind, Value};
use super::table::Table;
use ::parquet::basic::{LogicalType, Repetition, Type as Physical};
use ::parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use ::parquet::errors::ParquetError;
use ::parquet::file::metadata::KeyValue;
use ::parquet::file::properties::WriterProperties;
use ::parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use ::parquet::schema::types::Type;
use serde_json::{Map, json};
use sim::result::TOOL;
use std::io::Write;
use std::sync::Arc;
use thiserror::Error;

/// Key of the file's metadata with a JSON object: unit and definition by column. Most readers do not show
/// metadata of columns.
const COLUMNS_KEY: &str = "parallax.columns";

/// Error for a table that cannot be written as Parquet.
#[derive(Debug, Error)]
pub enum TableError {
    /// A cell whose type differs from its column's, or whose value is too large.
    #[error("column {column}, row {row}: expected {expected}, found {found}")]
    Cell {
        /// Name of the column.
        column: String,
        /// Row number, from 0.
        row: usize,
        /// Type of the column.
        expected: &'static str,
        /// Value of the cell.
        found: String,
    },
    /// An error of the encoder.
    #[error("Parquet: {0}")]
    Encoder(#[from] ParquetError),
}

/// The bytes of a file with one row group, without compression. Every column is optional: text in UTF-8,
/// counts as signed 64-bit integers (differences of unsigned ones overflow in many readers), measures as
/// doubles, flags as booleans. Equal tables have equal bytes.
///
/// # Errors
/// A cell that its column cannot hold.
pub fn bytes(table: &Table) -> Result<Vec<u8>, TableError> {
    let table = table.with_ends();
    let facts: Map<String, serde_json::Value> = table
        .headings
        .iter()
        .map(|h| (h.flat_key(), json!({ "unit": h.unit, "about": h.about })))
        .collect();
    let facts = serde_json::Value::Object(facts).to_string();
    let facts = KeyValue::new(COLUMNS_KEY.to_owned(), facts);
    let columns = table.headings.iter().map(|heading| {
        let (physical, logical) = match heading.kind {
            Kind::Text => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
            Kind::Flag => (Physical::BOOLEAN, None),
            Kind::Whole => (Physical::INT64, None),
            Kind::Real => (Physical::DOUBLE, None),
        };
        (heading.flat_key(), physical, logical)
    });
    let mut writer = create(Vec::new(), Repetition::OPTIONAL, columns, vec![facts])?;
    let mut rows = writer.next_row_group()?;
    for (index, heading) in table.headings.iter().enumerate() {
        let cells = Cells {
            heading,
            values: table.rows.iter().map(|row| &row[index]).collect(),
        };
        match heading.kind {
            Kind::Text => cells.write::<ByteArrayType>(&mut rows, "text", |value| match value {
                Value::Text(text) => Some(ByteArray::from(text.as_str())),
                Value::Named(name, _) => Some(ByteArray::from(*name)),
                _ => None,
            }),
            Kind::Flag => cells.write::<BoolType>(&mut rows, "a flag", |value| match value {
                Value::Flag(flag) => Some(*flag),
                _ => None,
            }),
            Kind::Whole => {
                cells.write::<Int64Type>(&mut rows, "a count below 2^63", |value| match value {
                    Value::Whole(count) => i64::try_from(*count).ok(),
                    _ => None,
                })
            }
            Kind::Real => cells.write::<DoubleType>(&mut rows, "a measure", Value::number),
        }?;
    }
    rows.close()?;
    Ok(writer.into_inner()?)
}

/// Begins a file of rows. Equal rows have equal bytes.
pub(crate) fn create<W: Write + Send, N: AsRef<str>>(
    out: W,
    repetition: Repetition,
    columns: impl Iterator<Item = (N, Physical, Option<LogicalType>)>,
    facts: Vec<KeyValue>,
) -> Result<SerializedFileWriter<W>, ParquetError> {
    let column = |(name, physical, logical): (N, Physical, Option<LogicalType>)| {
        let column = Type::primitive_type_builder(name.as_ref(), physical)
            .with_repetition(repetition)
            .with_logical_type(logical)
            .build()?;
        Ok(Arc::new(column))
    };
    let columns: Result<Vec<_>, ParquetError> = columns.map(column).collect();
    let rows = Type::group_type_builder("rows").with_fields(columns?);
    let properties = WriterProperties::builder()
        .set_created_by(TOOL.to_owned())
        .set_key_value_metadata((!facts.is_empty()).then_some(facts))
        .build();
    SerializedFileWriter::new(out, Arc::new(rows.build()?), Arc::new(properties))
}

/// Writes the next column of a group. `present` has a number per row of a column that may be empty.
pub(crate) fn write_column<T: DataType, W: Write + Send>(
    group: &mut SerializedRowGroupWriter<'_, W>,
    values: &[T::T],
    present: Option<&[i16]>,
) -> Result<(), ParquetError> {
    let missing = || ParquetError::General("fewer columns than the schema has".to_owned());
    let mut column = group.next_column()?.ok_or_else(missing)?;
    column.typed::<T>().write_batch(values, present, None)?;
    column.close().map(|_| ())
}

/// The cells of a column.
struct Cells<'a> {
    heading: &'a Heading,
    values: Vec<&'a Value>,
}

impl Cells<'_> {
    /// Writes the column. `of` returns `None` for a value that the column cannot hold.
    fn write<T: DataType>(
        &self,
        rows: &mut SerializedRowGroupWriter<'_, Vec<u8>>,
        expected: &'static str,
        of: impl Fn(&Value) -> Option<T::T>,
    ) -> Result<(), TableError> {
        let mut present = Vec::with_capacity(self.values.len());
        let mut values = Vec::with_capacity(self.values.len());
        for (row, value) in self.values.iter().enumerate() {
            let is_empty = match value {
                Value::None => true,
                Value::Text(text) => text.is_empty(),
                _ => false,
            };
            present.push(i16::from(!is_empty));
            if !is_empty {
                values.push(of(value).ok_or_else(|| TableError::Cell {
                    column: self.heading.flat_key(),
                    row,
                    expected,
                    found: value.exact(),
                })?);
            }
        }
        Ok(write_column::<T, _>(rows, &values, Some(&present))?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::columns::Column;
    use ::parquet::file::reader::{FileReader, SerializedFileReader};
    use ::parquet::record::Field;

    type Cells = (&'static str, Option<f64>, u64, bool);

    fn table(rows: &[Cells]) -> Table {
        let columns: Vec<Column<Cells>> = vec![
            Column::text("scene", "scene", |r: &Cells| r.0),
            Column::real(
                "paper.l1_footprint_miss_pct",
                "L1 miss",
                "%",
                2,
                |r: &Cells| r.1,
            )
            .about("footprints"),
            Column::real("bytes", "external", "bytes", 0, |r: &Cells| r.2),
            Column::text("lossless", "lossless", |r: &Cells| r.3),
        ];
        Table::new(&columns, rows)
    }

    fn read(bytes: Vec<u8>) -> (Vec<Vec<(String, Field)>>, String) {
        let mut file = tempfile::tempfile().unwrap();
        file.write_all(&bytes).unwrap();
        let reader = SerializedFileReader::new(file).unwrap();
        let rows = reader.get_row_iter(None).unwrap();
        let row = |row: ::parquet::record::Row| {
            let columns = row.get_column_iter();
            columns
                .map(|(name, field)| (name.clone(), field.clone()))
                .collect()
        };
        let rows = rows.map(|found| row(found.unwrap())).collect();
        let metadata = reader.metadata().file_metadata();
        let facts = metadata.key_value_metadata().unwrap();
        let facts = facts.iter().find(|pair| pair.key == COLUMNS_KEY).unwrap();
        (rows, facts.value.clone().unwrap())
    }

    #[test]
    fn cells_are_read_with_their_types_and_empty_cells_as_null() {
        let table = table(&[
            ("a, \"b\" \u{e9}", Some(0.1 + 0.2), u64::MAX >> 1, true),
            ("", None, 0, false),
        ]);
        let written = bytes(&table).unwrap();
        assert_eq!(written, bytes(&table).unwrap());
        let (rows, facts) = read(written);
        let named = |fields: [Field; 4]| {
            let names = ["scene", "paper_l1_footprint_miss_pct", "bytes", "lossless"];
            names
                .map(str::to_owned)
                .into_iter()
                .zip(fields)
                .collect::<Vec<_>>()
        };
        assert_eq!(
            rows,
            [
                named([
                    Field::Str("a, \"b\" \u{e9}".to_owned()),
                    Field::Double(0.1 + 0.2),
                    Field::Long(i64::MAX),
                    Field::Bool(true)
                ]),
                named([Field::Null, Field::Null, Field::Long(0), Field::Bool(false)]),
            ]
        );
        let facts: serde_json::Value = serde_json::from_str(&facts).unwrap();
        assert_eq!(
            facts["paper_l1_footprint_miss_pct"],
            json!({ "unit": "%", "about": "footprints" })
        );
        assert_eq!(facts["bytes"]["unit"], "bytes");
    }

    #[test]
    fn a_table_without_rows_keeps_its_columns() {
        let (rows, facts) = read(bytes(&table(&[])).unwrap());
        assert!(rows.is_empty());
        assert!(facts.contains("paper_l1_footprint_miss_pct"));
    }

    #[test]
    fn the_error_for_a_count_that_does_not_fit_names_it() {
        let error = bytes(&table(&[("a", None, 1 << 63, true)])).unwrap_err();
        assert_eq!(
            error.to_string(),
            "column bytes, row 0: expected a count below 2^63, found 9223372036854775808"
        );
    }
}
