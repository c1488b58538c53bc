//! Bits in little-endian order: the first bit is the lowest bit of the first byte.

/// Zero bytes after the last bit, so that a reader can always load eight bytes at once.
pub const PADDING_BYTES: usize = 8;

/// Most bits that [`BitReader::peek`] is sure to hold.
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

/// Reads bits from bytes; `BACK`: from the last byte to the first.
#[derive(Clone, Copy)]
pub(in crate::textrace) struct BitReader<'a, const BACK: bool = false> {
    bytes: &'a [u8],
    bit: usize,
}

impl<'a> BitReader<'a> {
    /// The next bits, at least [`PEEK_BITS`] of them, of bytes that end with padding; `None` at the end.
    #[inline(always)]
    pub(in crate::textrace) fn peek(&self) -> Option<u64> {
        let word = self.bytes.get(self.bit >> 3..)?.first_chunk::<8>()?;
        Some(u64::from_le_bytes(*word) >> (self.bit & 7))
    }

    /// The bytes that no read bit lies in.
    pub(in crate::textrace) fn rest(&self) -> &'a [u8] {
        self.bytes.get(self.bytes_read()..).unwrap_or_default()
    }
}

impl<'a, const BACK: bool> BitReader<'a, BACK> {
    pub(in crate::textrace) fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, bit: 0 }
    }

    /// The next bits, at least [`PEEK_BITS`] of them, zeros after the last one; `None` where bits were
    /// read that are not there.
    #[inline(always)]
    pub(in crate::textrace) fn peek_unpadded(&self) -> Option<u64> {
        self.whole_word().or_else(|| self.peek_tail())
    }

    #[inline(always)]
    fn whole_word(&self) -> Option<u64> {
        let at = self.bit >> 3;
        let word = if BACK {
            let end = self.bytes.len().checked_sub(at)?;
            u64::from_be_bytes(*self.bytes.get(..end)?.last_chunk::<8>()?)
        } else {
            u64::from_le_bytes(*self.bytes.get(at..)?.first_chunk::<8>()?)
        };
        Some(word >> (self.bit & 7))
    }

    #[cold]
    #[inline(never)]
    fn peek_tail(&self) -> Option<u64> {
        let mut word = [0; 8];
        let at = self.bit >> 3;
        if BACK {
            let left = self.bytes.iter().rev().skip(at);
            word.iter_mut().zip(left).for_each(|(to, from)| *to = *from);
        } else {
            let left = self.bytes.iter().skip(at);
            word.iter_mut().zip(left).for_each(|(to, from)| *to = *from);
        }
        (self.bit <= self.bytes.len() * 8).then(|| u64::from_le_bytes(word) >> (self.bit & 7))
    }

    #[inline(always)]
    pub(in crate::textrace) fn skip(&mut self, count: u32) {
        self.bit += count as usize;
    }

    /// The bits between the last one read and the end of its byte.
    pub(in crate::textrace) fn left_in_byte(&self) -> u8 {
        let at = self.bit >> 3;
        let byte = if BACK {
            self.bytes.iter().rev().nth(at)
        } else {
            self.bytes.get(at)
        };
        match self.bit & 7 {
            0 => 0,
            read => byte.copied().unwrap_or_default() >> read,
        }
    }

    /// Bytes of which at least a bit was read, some of them perhaps beyond the end.
    pub(in crate::textrace) fn bytes_read(&self) -> usize {
        self.bit.div_ceil(8)
    }
}
