//! Ranges of the tiles of a trace.

pub use crate::records::{ray_tiles, tiles};

/// A range of numbers on the command line: `7`, `3..8`, `5..` or `..8`; the end is exclusive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NumberRange {
    first: usize,
    end: usize,
}

impl NumberRange {
    /// Whether `number` is in the range.
    pub fn contains(self, number: usize) -> bool {
        (self.first..self.end).contains(&number)
    }

    /// First number, for checks against the number of tiles.
    pub fn first(self) -> usize {
        self.first
    }
}

impl std::str::FromStr for NumberRange {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let bad = || format!("expected a number or a range such as 3..8, found {text:?}");
        let number = |text: &str| text.parse::<usize>().map_err(|_| bad());
        let (first, end) = match text.split_once("..") {
            None => {
                let only = number(text)?;
                (only, only.checked_add(1).ok_or_else(bad)?)
            }
            Some((first, end)) => (
                if first.is_empty() { 0 } else { number(first)? },
                if end.is_empty() {
                    usize::MAX
                } else {
                    number(end)?
                },
            ),
        };
        if first < end {
            Ok(Self { first, end })
        } else {
            Err(bad())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_end_of_a_range_is_exclusive() {
        let range = |text: &str| text.parse::<NumberRange>();
        assert_eq!(range("7"), Ok(NumberRange { first: 7, end: 8 }));
        assert!(range("3..8").is_ok_and(|r| r.contains(7) && !r.contains(8)));
        assert!(range("..2").is_ok_and(|r| r.contains(0)));
        assert!(range("5..").is_ok_and(|r| r.contains(5000)));
        for bad in ["", "x", "8..3", "3..3", "-1"] {
            assert!(range(bad).is_err(), "{bad}");
        }
    }
}
