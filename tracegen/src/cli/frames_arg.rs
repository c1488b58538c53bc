//! The value of `--frames`: how many frames of a path, or which.

use scene::paths::MAX_FRAMES;
use std::collections::BTreeSet;
use std::str::FromStr;

/// Frames of a path.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Frames {
    /// The first frames.
    First(u32),
    /// These, ascending.
    Listed(Vec<u32>),
}

impl Frames {
    /// The number after the last frame.
    pub(super) fn end(&self) -> u32 {
        match self {
            Self::First(count) => *count,
            Self::Listed(list) => list.last().map_or(0, |last| last + 1),
        }
    }

    /// The listed frames.
    pub(super) fn list(&self) -> Option<&[u32]> {
        match self {
            Self::First(_) => None,
            Self::Listed(list) => Some(list),
        }
    }
}

impl FromStr for Frames {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let expected = |found: &str| {
            format!(
                "expected 1 to {MAX_FRAMES} frames, or numbers below {MAX_FRAMES} and ranges as in 3,17,40..43, found '{found}'"
            )
        };
        let number = |text: &str| text.trim().parse::<u32>().ok().filter(|n| *n <= MAX_FRAMES);
        if !text.contains([',', '.']) {
            let count = number(text).filter(|count| *count > 0);
            return count.map(Self::First).ok_or_else(|| expected(text));
        }
        let mut list = BTreeSet::new();
        for part in text.split(',') {
            let range = match part.split_once("..") {
                Some((first, end)) => number(first).zip(number(end)),
                None => number(part).filter(|n| *n < MAX_FRAMES).map(|n| (n, n + 1)),
            };
            match range.filter(|(first, end)| first < end) {
                Some((first, end)) => list.extend(first..end),
                None => return Err(expected(part)),
            }
        }
        Ok(Self::Listed(list.into_iter().collect()))
    }
}

/// Listed frames, and the frames before them that fill the caches.
pub(super) struct Chosen {
    listed: Vec<u32>,
    /// All frames to capture, ascending.
    pub(super) captured: BTreeSet<u32>,
}

impl Chosen {
    pub(super) fn new(listed: &[u32], warm: u32) -> Self {
        let with_warm = |&frame: &u32| frame.saturating_sub(warm)..=frame;
        Self {
            captured: listed.iter().flat_map(with_warm).collect(),
            listed: listed.to_vec(),
        }
    }

    /// Frames that only fill the caches, ascending.
    pub(super) fn warm(&self) -> Vec<u32> {
        let captured = self.captured.iter().copied();
        captured
            .filter(|frame| self.listed.binary_search(frame).is_err())
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_counts_frames_and_a_list_names_them() {
        assert_eq!("40".parse(), Ok(Frames::First(40)));
        assert_eq!(
            "17,3,40..43".parse(),
            Ok(Frames::Listed(vec![3, 17, 40, 41, 42]))
        );
        assert_eq!("5..6".parse(), Ok(Frames::Listed(vec![5])));
        for bad in [
            "",
            "0",
            "-1",
            "x",
            "3,",
            "4..4",
            "5..3",
            "3,,4",
            "1..99999999",
            "3.5",
        ] {
            let error = bad.parse::<Frames>().unwrap_err();
            assert!(error.starts_with("expected 1 to"), "{bad}: {error}");
        }
    }

    #[test]
    fn frames_before_listed_ones_are_captured_once() {
        let chosen = Chosen::new(&[0, 3, 4, 9], 2);
        let captured: Vec<u32> = chosen.captured.iter().copied().collect();
        assert_eq!(captured, [0, 1, 2, 3, 4, 7, 8, 9]);
        assert_eq!(chosen.warm(), [1, 2, 7, 8]);
    }
}
