//! Rows of traces as Parquet files, one row group per million rows.

use crate::parquet;
use ::parquet::basic::{LogicalType, Repetition, Type as Physical};
use ::parquet::data_type::{ByteArray, ByteArrayType, DataType, FloatType, Int32Type, Int64Type};
use ::parquet::errors::ParquetError;
use ::parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use formats::interop::{Field, Get, Tabular};
use std::io::Write;

/// Rows per group.
const GROUP_ROWS: usize = 1 << 20;

/// Writes rows. Every column is required: codes as text, numbers with their width and sign.
pub struct RowsWriter<W: Write + Send, R> {
    file: SerializedFileWriter<W>,
    rows: Vec<R>,
}

impl<W: Write + Send, R: Tabular> RowsWriter<W, R> {
    /// Begins a file. Equal rows have equal bytes.
    ///
    /// # Errors
    /// Errors of the underlying writer.
    pub fn new(out: W) -> Result<Self, ParquetError> {
        let columns = R::FIELDS.iter().map(column);
        Ok(Self {
            file: parquet::create(out, Repetition::REQUIRED, columns, Vec::new())?,
            rows: Vec::new(),
        })
    }

    /// Writes a row.
    ///
    /// # Errors
    /// Errors of the underlying writer.
    pub fn write(&mut self, row: R) -> Result<(), ParquetError> {
        self.rows.push(row);
        if self.rows.len() == GROUP_ROWS {
            self.write_group()?;
        }
        Ok(())
    }

    /// Ends the file.
    ///
    /// # Errors
    /// Errors of the underlying writer.
    pub fn finish(mut self) -> Result<W, ParquetError> {
        if !self.rows.is_empty() {
            self.write_group()?;
        }
        self.file.into_inner()
    }

    fn write_group(&mut self) -> Result<(), ParquetError> {
        let mut group = self.file.next_row_group()?;
        for field in R::FIELDS {
            write_column(field, &self.rows, &mut group)?;
        }
        group.close()?;
        self.rows.clear();
        Ok(())
    }
}

/// Name and types of a field's column.
fn column<R>(field: &Field<R>) -> (&'static str, Physical, Option<LogicalType>) {
    let unsigned = |bit_width| Some(LogicalType::integer(bit_width, false));
    let (physical, logical) = match field.get {
        _ if !field.codes.is_empty() => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
        Get::U8(_) => (Physical::INT32, unsigned(8)),
        Get::U16(_) => (Physical::INT32, unsigned(16)),
        Get::U32(_) => (Physical::INT32, unsigned(32)),
        Get::U64(_) => (Physical::INT64, unsigned(64)),
        Get::I32(_) => (Physical::INT32, None),
        Get::F32(_) => (Physical::FLOAT, None),
    };
    (field.name, physical, logical)
}

fn write_column<R, W: Write + Send>(
    field: &Field<R>,
    rows: &[R],
    group: &mut SerializedRowGroupWriter<'_, W>,
) -> Result<(), ParquetError> {
    let name = |code: u8| {
        let name = field.codes.get(usize::from(code)).copied();
        ByteArray::from(name.unwrap_or_default())
    };
    // Parquet stores unsigned numbers as signed ones with the same bits.
    match field.get {
        Get::U8(get) if !field.codes.is_empty() => {
            write::<ByteArrayType, _, _>(rows, group, |row| name(get(row)))
        }
        Get::U8(get) => write::<Int32Type, _, _>(rows, group, |row| get(row).into()),
        Get::U16(get) => write::<Int32Type, _, _>(rows, group, |row| get(row).into()),
        Get::U32(get) => write::<Int32Type, _, _>(rows, group, |row| get(row).cast_signed()),
        Get::U64(get) => write::<Int64Type, _, _>(rows, group, |row| get(row).cast_signed()),
        Get::I32(get) => write::<Int32Type, _, _>(rows, group, get),
        Get::F32(get) => write::<FloatType, _, _>(rows, group, get),
    }
}

fn write<T: DataType, R, W: Write + Send>(
    rows: &[R],
    group: &mut SerializedRowGroupWriter<'_, W>,
    of: impl Fn(&R) -> T::T,
) -> Result<(), ParquetError> {
    let values: Vec<T::T> = rows.iter().map(of).collect();
    parquet::write_column::<T, W>(group, &values, None)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::parquet::file::reader::{FileReader, SerializedFileReader};
    use formats::interop::{Origin, RayRow, RecordRow};
    use formats::raytrace::{RayKind, RayRecord};
    use formats::textrace::QuadRecord;
    use formats::view::Eye;

    fn read(bytes: Vec<u8>) -> Vec<String> {
        let mut file = tempfile::tempfile().unwrap();
        file.write_all(&bytes).unwrap();
        let reader = SerializedFileReader::new(file).unwrap();
        let rows = reader.get_row_iter(None).unwrap();
        rows.map(|row| row.unwrap().to_string()).collect()
    }

    #[test]
    fn numbers_keep_their_width_and_sign_and_codes_are_names() {
        let mut writer = RowsWriter::new(Vec::new()).unwrap();
        let origin = Origin {
            primitive: u32::MAX,
            ..Origin::default()
        };
        let record = QuadRecord {
            mask: 255,
            dy: [i32::MIN, 1],
            ..QuadRecord::default()
        };
        writer.write(RecordRow { origin, record }).unwrap();
        let rows = read(writer.finish().unwrap());
        assert_eq!(rows.len(), 1);
        for part in ["primitive: 4294967295", "mask: 255", "dy_u: -2147483648"] {
            assert!(rows[0].contains(part), "{}", rows[0]);
        }
        let mut writer = RowsWriter::new(Vec::new()).unwrap();
        writer
            .write(RayRow {
                place: formats::interop::columns::SamplePlace {
                    eye: Eye::Right,
                    tile: 1,
                    pixel: [2, 3],
                    sample: 0,
                },
                ray: 4,
                record: RayRecord {
                    kind: RayKind::Reflection,
                    ..RayRecord::default()
                },
            })
            .unwrap();
        let rows = read(writer.finish().unwrap());
        assert!(rows[0].contains("eye: \"right\"") && rows[0].contains("kind: \"reflection\""));
    }

    #[test]
    fn a_file_without_rows_has_its_columns() {
        let writer = RowsWriter::<_, RecordRow>::new(Vec::new()).unwrap();
        let bytes = writer.finish().unwrap();
        assert!(read(bytes.clone()).is_empty());
        let text = String::from_utf8_lossy(&bytes);
        assert!(text.contains("cross_v"));
    }
}
