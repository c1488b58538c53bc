//! Suggestions for mistyped names.

/// Jaro-Winkler similarity of a suggestion.
const LEAST_SIMILARITY: f64 = 0.8;

/// `; did you mean 'NAME'?` with the name most similar to a mistyped one, or nothing if none is similar.
pub(crate) fn did_you_mean<'n>(typed: &str, names: impl IntoIterator<Item = &'n str>) -> String {
    let typed = typed.to_lowercase();
    (names.into_iter())
        .map(|name| (strsim::jaro_winkler(&name.to_lowercase(), &typed), name))
        .filter(|(similarity, _)| *similarity > LEAST_SIMILARITY)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, name)| format!("; did you mean '{name}'?"))
        .unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::did_you_mean;

    #[test]
    fn only_a_similar_name_is_suggested() {
        let names = ["atrium", "Gallery", "galley-2"];
        assert_eq!(did_you_mean("galery", names), "; did you mean 'Gallery'?");
        assert_eq!(did_you_mean("xyz", names), "");
        assert_eq!(did_you_mean("gallery", []), "");
    }
}
