//! Pairs the draws of the left eye with those of the right eye.

/// Indices of a draw in the sequences of the left and the right eye.
pub type Pair = (Option<usize>, Option<usize>);

/// Merges two sequences and keeps the order of both. Where the sequences differ, both skip entries until the
/// nearest pair of equal entries. Skipped entries remain without a partner.
pub fn pair<K: PartialEq>(left: &[K], right: &[K]) -> Vec<Pair> {
    let mut pairs = Vec::with_capacity(left.len().max(right.len()));
    let (mut l, mut r) = (0, 0);
    while l < left.len() && r < right.len() {
        if left[l] == right[r] {
            pairs.push((Some(l), Some(r)));
            (l, r) = (l + 1, r + 1);
            continue;
        }
        // Find the nearest pair of equal entries.
        let ahead = |in_left: usize, in_right: usize| -> Option<(usize, usize)> {
            let a = left.get(l + in_left)?;
            let b = right.get(r + in_right)?;
            (a == b).then_some((l + in_left, r + in_right))
        };
        let meeting = (1..left.len() + right.len() - l - r)
            .find_map(|far| (0..=far).find_map(|in_left| ahead(in_left, far - in_left)));
        let (next_l, next_r) = meeting.unwrap_or((left.len(), right.len()));
        pairs.extend((l..next_l).map(|l| (Some(l), None)));
        pairs.extend((r..next_r).map(|r| (None, Some(r))));
        (l, r) = (next_l, next_r);
    }
    pairs.extend((l..left.len()).map(|l| (Some(l), None)));
    pairs.extend((r..right.len()).map(|r| (None, Some(r))));
    pairs
}

/// Share of the entries that have a partner, 0 to 1.
pub fn matched_share<K: PartialEq>(left: &[K], right: &[K]) -> f64 {
    let longer = left.len().max(right.len());
    if longer == 0 {
        return 0.0;
    }
    let met = pair(left, right)
        .iter()
        .filter(|(l, r)| l.is_some() && r.is_some())
        .count();
    met as f64 / longer as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn all_entries_of_equal_sequences_are_paired() {
        let all: Vec<Pair> = (0..4).map(|i| (Some(i), Some(i))).collect();
        assert_eq!(pair(b"abca", b"abca"), all);
        assert_eq!(matched_share(b"abca", b"abca"), 1.0);
        assert_eq!(matched_share::<u8>(b"", b""), 0.0);
    }

    #[test]
    fn a_draw_of_only_one_eye_has_no_partner() {
        let expected = [
            (Some(0), Some(0)),
            (Some(1), None),
            (Some(2), Some(1)),
            (None, Some(2)),
        ];
        assert_eq!(pair(b"abc", b"acd"), expected);
    }

    proptest! {
        #[test]
        fn every_entry_occurs_once_and_in_order(
            left in prop::collection::vec(0..4_u8, 0..12),
            right in prop::collection::vec(0..4_u8, 0..12),
        ) {
            let pairs = pair(&left, &right);
            let of_left: Vec<usize> = pairs.iter().filter_map(|(l, _)| *l).collect();
            let of_right: Vec<usize> = pairs.iter().filter_map(|(_, r)| *r).collect();
            prop_assert_eq!(of_left, (0..left.len()).collect::<Vec<_>>());
            prop_assert_eq!(of_right, (0..right.len()).collect::<Vec<_>>());
            for (l, r) in pairs {
                if let (Some(l), Some(r)) = (l, r) {
                    prop_assert_eq!(left[l], right[r]);
                }
            }
        }
    }
}
