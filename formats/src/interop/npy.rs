//! NPY files of NumPy (format version 1.0): one array with a named field per column.

use super::columns::Tabular;
use std::io::{self, Write};

/// The header is padded so that the data begin at a multiple of this many bytes.
const ALIGNMENT: usize = 64;
const MAGIC: &[u8; 8] = b"\x93NUMPY\x01\x00";

/// Writes rows.
#[derive(Debug)]
pub struct NpyWriter<W, R> {
    out: W,
    /// Rows that the header promises, and rows written.
    expected: u64,
    written: u64,
    bytes: Vec<u8>,
    rows: std::marker::PhantomData<fn(&R)>,
}

impl<W: Write, R: Tabular> NpyWriter<W, R> {
    /// Writes the header of a file with this many rows.
    ///
    /// # Errors
    /// Errors of the underlying writer.
    pub fn new(mut out: W, rows: u64) -> io::Result<Self> {
        let fields = R::FIELDS.iter();
        let fields: Vec<String> = fields
            .map(|field| format!("('{}', '{}')", field.name, field.get.numpy_type()))
            .collect();
        let mut header = format!(
            "{{'descr': [{}], 'fortran_order': False, 'shape': ({rows},), }}",
            fields.join(", ")
        );
        // A line break ends the header.
        let begins = MAGIC.len() + 2;
        let end = (begins + header.len() + 1).next_multiple_of(ALIGNMENT);
        header.extend(std::iter::repeat_n(' ', end - begins - header.len() - 1));
        header.push('\n');
        let length = u16::try_from(header.len()).map_err(io::Error::other)?;
        out.write_all(MAGIC)?;
        out.write_all(&length.to_le_bytes())?;
        out.write_all(header.as_bytes())?;
        Ok(Self {
            out,
            expected: rows,
            written: 0,
            bytes: Vec::new(),
            rows: std::marker::PhantomData,
        })
    }

    /// Writes a row.
    ///
    /// # Errors
    /// Errors of the underlying writer.
    pub fn write(&mut self, row: &R) -> io::Result<()> {
        self.bytes.clear();
        for field in R::FIELDS {
            field.get.append_bytes(row, &mut self.bytes);
        }
        self.written += 1;
        self.out.write_all(&self.bytes)
    }

    /// Ends the file.
    ///
    /// # Errors
    /// Another number of rows than the header has.
    pub fn finish(self) -> io::Result<()> {
        if self.written == self.expected {
            return Ok(());
        }
        Err(io::Error::other(format!(
            "expected {} rows, found {}",
            self.expected, self.written
        )))
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Access, RayAccess, RayRow, RecordRow, SampleRow};
    use super::*;

    fn begins_aligned<R: Tabular>() {
        for rows in [0, 9, u64::MAX] {
            let mut bytes = Vec::new();
            let writer = NpyWriter::<_, R>::new(&mut bytes, rows).unwrap();
            assert_eq!(writer.finish().is_ok(), rows == 0);
            assert!(bytes.len().is_multiple_of(ALIGNMENT) && bytes.ends_with(b"\n"));
            let length = u16::from_le_bytes([bytes[8], bytes[9]]);
            assert_eq!(usize::from(length) + 10, bytes.len());
        }
    }

    #[test]
    fn the_header_is_padded_and_rows_are_packed() {
        begins_aligned::<Access>();
        begins_aligned::<RayAccess>();
        begins_aligned::<RayRow>();
        begins_aligned::<SampleRow>();
        let mut bytes = Vec::new();
        let mut writer = NpyWriter::new(&mut bytes, 1).unwrap();
        writer.write(&RecordRow::default()).unwrap();
        writer.finish().unwrap();
        let header = String::from_utf8_lossy(&bytes);
        assert!(header.contains("{'descr': [('pass', '<u4'), "), "{header}");
        assert!(header.contains("'shape': (1,), }"), "{header}");
        assert_eq!(bytes.len() % ALIGNMENT, 52);
    }
}
