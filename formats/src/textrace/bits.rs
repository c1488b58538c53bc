//! Bits in little-endian order: the first bit is the lowest bit of the first byte.

/// Zero bytes after the last bit, so that a reader can always load eight bytes at once.
pub const PADDING_BYTES: usize = 8;

/// Minimum number of bits that [`BitReader::peek`] returns.
pub(in crate::textrace) const PEEK_BITS: u32 = 57;

/// Appends bits to bytes.
pub(in crate::textrace) struct BitWriter {
    bytes: Vec<u8>,
    pending: u64,
    count: u32,
}

impl BitWriter {
    pub(in crate::textrace) fn new(bytes: Vec<u8>) -> Self {
        Self {
            bytes,
            pending: 0,
            count: 0,
        }
    }

    /// Appends the lowest `count` bits of `value`, at most 32.
    pub(in crate::textrace) fn put(&mut self, value: u32, count: u32) {
        debug_assert!(count == 32 || u64::from(value) < 1 << count);
        // Fewer than 32 bits are pending.
        self.pending |= u64::from(value) << self.count;
        self.count += count;
        if self.count >= 32 {
            let [a, b, c, d, ..] = self.pending.to_le_bytes();
            self.bytes.extend_from_slice(&[a, b, c, d]);
            self.pending >>= 32;
            self.count -= 32;
        }
    }

    /// The bytes, with padding.
    pub(in crate::textrace) fn finish(self) -> Vec<u8> {
        let mut bytes = self.finish_unpadded();
        bytes.extend([0; PADDING_BYTES]);
        bytes
    }

    pub(in crate::textrace) fn finish_unpadded(mut self) -> Vec<u8> {
        let rest = self.count.div_ceil(8) as usize;
        self.bytes
            .extend(self.pending.to_le_bytes().iter().take(rest));
        self.bytes
    }
}

/// Reads bits from bytes that end with [`PADDING_BYTES`].
#[derive(Clone, Copy)]
pub(in crate::textrace) struct BitReader<'a> {
    bytes: &'a [u8],
    bit: usize,
}

impl<'a> BitReader<'a> {
    pub(in crate::textrace) fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, bit: 0 }
    }

    /// The next bits, at least [`PEEK_BITS`] of them; `None` at the end.
    #[inline(always)]
    pub(in crate::textrace) fn peek(&self) -> Option<u64> {
        let at = self.bit >> 3;
        let word = self.bytes.get(at..at + 8)?.first_chunk::<8>()?;
        Some(u64::from_le_bytes(*word) >> (self.bit & 7))
    }

    #[inline(always)]
    pub(in crate::textrace) fn skip(&mut self, count: u32) {
        self.bit += count as usize;
    }

    /// The bytes without a read bit.
    pub(in crate::textrace) fn rest(&self) -> &'a [u8] {
        self.bytes.get(self.bytes_read()..).unwrap_or_default()
    }

    /// The bits between the last read bit and the end of its byte.
    pub(in crate::textrace) fn left_in_byte(&self) -> u8 {
        let byte = self.bytes.get(self.bit >> 3);
        match self.bit & 7 {
            0 => 0,
            read => byte.copied().unwrap_or_default() >> read,
        }
    }

    /// Number of bytes with at least one read bit; may exceed the length of the input.
    pub(in crate::textrace) fn bytes_read(&self) -> usize {
        self.bit.div_ceil(8)
    }
}
