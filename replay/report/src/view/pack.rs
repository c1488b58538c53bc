//! Lists of numbers as text, about half as long as in JSON: digits of five bits, the lowest first, six bits a character;
//! the sixth says that another digit follows.

use serde::Serialize;
use studies::experiment::{STEPS, Share};

/// The characters of the values 0 to 63. None of them needs an escape in JSON or HTML.
const CHARACTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";

/// A list of numbers as text.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(transparent)]
pub(super) struct Packed(String);

impl FromIterator<u32> for Packed {
    fn from_iter<T: IntoIterator<Item = u32>>(numbers: T) -> Self {
        let mut text = String::new();
        for mut number in numbers {
            while number > 31 {
                text.push(character(number & 31 | 32));
                number >>= 5;
            }
            text.push(character(number));
        }
        Self(text)
    }
}

fn character(value: u32) -> char {
    CHARACTERS[value as usize].into()
}

pub(super) fn packed<'a>(numbers: impl IntoIterator<Item = &'a u32>) -> Packed {
    numbers.into_iter().copied().collect()
}

/// Equal neighbours as pairs of value and length.
pub(super) fn runs(values: &[u8]) -> Packed {
    let runs = values.chunk_by(|a, b| a == b);
    runs.flat_map(|run| [run[0].into(), run.len() as u32])
        .collect()
}

/// The changes of lists of steps and shares, as in `FrameContent::shares`, a character each: place of the step times 8
/// plus the share. The place counts from the step after the last change, up to 7. A share that stays the same skips 8
/// steps, once and as often as the place says. A list ends with its last step or with a skip of the rest.
pub(super) fn shares(lists: &[Vec<(u32, Share)>]) -> Packed {
    let mut text = String::new();
    for list in lists {
        let (mut next, mut now) = (0, 0);
        let mut put = |place: u32, share: Share| text.push(character(8 * place + u32::from(share)));
        for &(step, share) in list {
            while step - next > 7 {
                let skips = ((step - next) / 8).min(8);
                put(skips - 1, now);
                next += 8 * skips;
            }
            put(step - next, share);
            (next, now) = (step + 1, share);
        }
        while next <= STEPS {
            let skips = ((STEPS - next) / 8).min(7);
            put(skips, now);
            next += 8 * (skips + 1);
        }
    }
    Packed(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_take_a_character_for_each_five_bits() {
        let numbers = [0, 31, 32, 1023, 1024, u32::MAX];
        assert_eq!(packed(&numbers).0, "AfgB_fggB______D");
        assert_eq!(runs(&[3, 3, 3, 0]), packed(&[3, 3, 0, 1]));
        // Change at 0; skip 16 and change at 20; skip of the rest. No change: a skip of all. Change at the last step.
        let lists = [vec![(0, 7), (20, 1)], vec![], vec![(64, 2)]];
        let found: Vec<usize> = shares(&lists)
            .0
            .bytes()
            .map(|of| CHARACTERS.iter().position(|c| *c == of).unwrap())
            .collect();
        assert_eq!(found, [7, 8 + 7, 3 * 8 + 1, 5 * 8 + 1, 7 * 8, 0, 7 * 8, 2]);
    }
}
