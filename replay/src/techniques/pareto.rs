//! Which choices no one should make: another is as cheap and as good, and better at one of both.

/// For each point of two costs, whether another is no worse in both and better in one.
#[must_use]
pub fn dominated(points: &[(f64, f64)]) -> Vec<bool> {
    let beats = |a: &(f64, f64), b: &(f64, f64)| a.0 <= b.0 && a.1 <= b.1 && a != b;
    points
        .iter()
        .map(|point| points.iter().any(|other| beats(other, point)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_another_beats_is_dominated() {
        let points = [
            (1.0, 0.0),
            (0.8, 0.1),
            (0.9, 0.1),
            (0.5, 0.4),
            (1.0, 0.0),
            (1.1, 0.0),
        ];
        assert_eq!(dominated(&points), [false, false, true, false, false, true]);
    }
}
