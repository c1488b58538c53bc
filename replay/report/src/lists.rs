//! Small computations over rows.

/// The different items, in order of appearance.
pub(crate) fn unique<T: PartialEq>(items: impl IntoIterator<Item = T>) -> Vec<T> {
    let mut seen = Vec::new();
    for item in items {
        if !seen.contains(&item) {
            seen.push(item);
        }
    }
    seen
}

/// Arithmetic mean; `None` without values.
pub(crate) fn mean(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let sum = |(sum, count), value| (sum + value, count + 1);
    let (sum, count) = values.into_iter().fold((0.0, 0_u32), sum);
    (count > 0).then(|| sum / f64::from(count))
}

/// Geometric mean; `None` without values.
pub(crate) fn geometric_mean(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    mean(values.into_iter().map(f64::ln)).map(f64::exp)
}

/// Number of the least value; the first one of equal values.
pub(crate) fn least(values: impl IntoIterator<Item = Option<f64>>) -> Option<usize> {
    let known = values.into_iter().enumerate();
    let known = known.filter_map(|(number, value)| Some((number, value?)));
    let least = known.min_by(|a, b| a.1.total_cmp(&b.1));
    least.map(|(number, _)| number)
}
