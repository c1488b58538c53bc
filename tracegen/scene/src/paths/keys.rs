//! Position of a time among ascending key times.

/// The key at or before `time`, and the fraction of the way to the next key, 0 to 1. Times outside
/// the keys are clamped. There is at least one key.
pub(crate) fn bracket(times: &[f64], time: f64) -> (usize, f64) {
    let after = times.partition_point(|&key| key <= time);
    let Some(key) = after.checked_sub(1) else {
        return (0, 0.0);
    };
    match (times.get(key), times.get(after)) {
        (Some(a), Some(b)) => (key, (time - a) / (b - a)),
        _ => (key, 0.0),
    }
}

#[cfg(test)]
mod tests {
    use super::bracket;

    #[test]
    fn times_lie_between_their_keys_or_at_an_end() {
        let keys = [1.0, 2.0, 4.0];
        for (time, expected) in [
            (0.0, (0, 0.0)),
            (1.0, (0, 0.0)),
            (1.25, (0, 0.25)),
            (2.0, (1, 0.0)),
            (3.0, (1, 0.5)),
            (4.0, (2, 0.0)),
            (9.0, (2, 0.0)),
        ] {
            assert_eq!(bracket(&keys, time), expected, "{time}");
        }
        assert_eq!(bracket(&[7.0], 8.0), (0, 0.0));
    }
}
