//! Variable-length numbers (LEB128) and signed differences (zigzag).
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use crate::parse::{Cursor, Fault, Parsed, Taken};

/// Appends a number: seven bits per byte, the lowest first. The top bit marks that more bytes follow.
pub fn put(mut value: u64, bytes: &mut Vec<u8>) {
    while value >= 0x80 {
        bytes.push(value.to_le_bytes()[0] | 0x80);
        value >>= 7;
    }
    bytes.push(value.to_le_bytes()[0]);
}

/// Reads a number below `2^bits` in its shortest encoding.
#[inline]
pub fn take<'a>(what: &'static str, bits: u32, input: &'a [u8]) -> Parsed<'a, u64> {
    let mut value = 0u64;
    let most = bits.div_ceil(7) as usize;
    for (index, &byte) in input.iter().take(most).enumerate() {
        value |= u64::from(byte & 0x7f) << (7 * index);
        if byte & 0x80 == 0 {
            let shortest = byte > 0 || index == 0;
            if !shortest || value >> bits != 0 {
                break;
            }
            return Ok((input.get(index + 1..).unwrap_or_default(), value));
        }
    }
    let expected = format_args!("{what}, below 2^{bits} and in as few bytes as it needs");
    let found = input.get(..most).unwrap_or(input);
    Err(Fault::new(input, expected, format_args!("{found:02x?}")))
}

/// Maps small numbers of either sign to small numbers: 0, -1, 1, -2, ...
#[inline]
pub const fn zigzag(value: i64) -> u64 {
    (value << 1 ^ value >> 63).cast_unsigned()
}

/// The number of a zigzag code.
#[inline]
pub const fn unzigzag(code: u64) -> i64 {
    (code >> 1).cast_signed() ^ -(code & 1).cast_signed()
}

/// The lowest 32 bits.
#[inline(always)]
#[allow(
    clippy::cast_possible_truncation,
    reason = "what lies above belongs to other fields or wraps"
)]
pub const fn low_u32(bits: u64) -> u32 {
    bits as u32
}

/// Appends the wrapping difference of a column's value from the one before it.
pub fn put_difference(previous: &mut u32, value: u32, bytes: &mut Vec<u8>) {
    let difference = value.wrapping_sub(*previous).cast_signed();
    *previous = value;
    put(zigzag(difference.into()), bytes);
}

/// Reads consecutive numbers.
impl<'a> Cursor<'a> {
    /// The next number, below `2^bits`.
    ///
    /// # Errors
    /// The bytes end, or the number is too large or its encoding too long.
    #[inline]
    pub fn number(&mut self, what: &'static str, bits: u32) -> Taken<'a, u64> {
        self.parse(|input| take(what, bits, input))
    }

    /// The next number of 32 bits.
    ///
    /// # Errors
    /// See [`Self::number`].
    #[inline]
    pub fn number_u32(&mut self, what: &'static str) -> Taken<'a, u32> {
        self.number(what, 32).map(low_u32)
    }

    /// The next value of a column by its difference from the one before it.
    ///
    /// # Errors
    /// See [`Self::number`].
    #[inline]
    pub fn difference(&mut self, previous: &mut u32, what: &'static str) -> Taken<'a, u32> {
        let code = self.number(what, 32)?;
        *previous = previous.wrapping_add(low_u32(unzigzag(code).cast_unsigned()));
        Ok(*previous)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn numbers_and_differences_are_read_as_written(values in prop::collection::vec(any::<u32>(), 1..40)) {
            let mut bytes = Vec::new();
            let mut previous = 0;
            for value in &values {
                put((*value).into(), &mut bytes);
                put_difference(&mut previous, *value, &mut bytes);
                put(u64::from(*value) << 2 | 1, &mut bytes);
            }
            let mut input = Cursor::new(&bytes);
            let mut previous = 0;
            for value in values {
                prop_assert_eq!(input.number_u32("a number"), Ok(value));
                prop_assert_eq!(input.difference(&mut previous, "a difference"), Ok(value));
                prop_assert_eq!(input.number("a wide number", 34), Ok(u64::from(value) << 2 | 1));
            }
            prop_assert!(input.rest().is_empty());
        }

        #[test]
        fn zigzag_is_undone(value in any::<i64>()) {
            prop_assert_eq!(unzigzag(zigzag(value)), value);
        }
    }

    #[test]
    fn numbers_that_are_incomplete_too_long_or_too_large_are_refused() {
        let refused: [&[u8]; 6] = [
            &[],
            &[0x80],
            &[0x80, 0x00],
            &[0xff, 0x80, 0x00],
            &[0xff, 0xff, 0xff, 0xff, 0x1f],
            &[0xff; 12],
        ];
        for bytes in refused {
            assert!(take("a number", 32, bytes).is_err(), "{bytes:02x?}");
        }
        let largest = [0xff, 0xff, 0xff, 0xff, 0x0f];
        assert_eq!(
            take("a number", 32, &largest),
            Ok((&[][..], u64::from(u32::MAX)))
        );
        assert_eq!(take("a number", 32, &[0x00]), Ok((&[][..], 0)));
    }
}
