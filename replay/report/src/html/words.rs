//! Words for computed sentences.

/// A number with its noun: `1 frame`, `2 frames`.
pub fn count(number: usize, noun: &str) -> String {
    let number = crate::theme::group_thousands(&number.to_string());
    let plural = match number.as_str() {
        "1" => "",
        _ => "s",
    };
    format!("{number} {noun}{plural}")
}

/// Names as a list: `a`, `a and b`, `a, b and c`; at most `most` of them, then how many more.
pub fn list<S: AsRef<str>>(names: &[S], most: usize) -> String {
    let names: Vec<&str> = names.iter().map(AsRef::as_ref).collect();
    if names.len() > most.max(1) {
        let shown = names[..most.max(1)].join(", ");
        return format!("{shown} and {} more", names.len() - most.max(1));
    }
    match names.split_last() {
        None => String::new(),
        Some((last, [])) => (*last).to_owned(),
        Some((last, others)) => format!("{} and {last}", others.join(", ")),
    }
}

/// A change in percent as words: `12.3 % less`, `0.4 % more`, `as much`. Changes that round to zero are
/// none.
pub fn change(pct: f64, less: &str, more: &str, same: &str) -> String {
    let size = format!("{:.1}", pct.abs());
    if size == "0.0" {
        same.to_owned()
    } else if pct < 0.0 {
        format!("{size} % {less}")
    } else {
        format!("{size} % {more}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nouns_follow_their_numbers() {
        assert_eq!(count(0, "trace"), "0 traces");
        assert_eq!(count(1, "trace"), "1 trace");
        assert_eq!(count(12, "order"), "12 orders");
    }

    #[test]
    fn lists_read_as_english() {
        assert_eq!(list::<&str>(&[], 3), "");
        assert_eq!(list(&["a"], 3), "a");
        assert_eq!(list(&["a", "b"], 3), "a and b");
        assert_eq!(list(&["a", "b", "c"], 3), "a, b and c");
        assert_eq!(list(&["a", "b", "c", "d"], 2), "a, b and 2 more");
    }

    #[test]
    fn a_change_that_rounds_to_zero_is_reported_as_none() {
        let words = |pct| change(pct, "less", "more", "as much");
        assert_eq!(words(-12.34), "12.3 % less");
        assert_eq!(words(0.4), "0.4 % more");
        assert_eq!(words(-0.04), "as much");
        assert_eq!(words(0.0), "as much");
    }
}
