//! Published figures, to be set beside measured ones, and which trace stands beside which.

pub mod sgrt;
mod z2;

pub use z2::*;

/// A scene of `--as` that the paper does not have.
#[derive(Debug, thiserror::Error, PartialEq, Eq)]
#[error("--as: expected none or one of {known}, found `{found}`")]
pub struct UnknownScene {
    known: String,
    found: String,
}

/// The scene of a paper that the values of `--as` give to a trace's label: SCENE for every trace,
/// LABEL=SCENE for one, `none` for no scene; the last that fits wins. `None` where no value is for
/// this label.
///
/// # Errors
/// A scene that is not among `scenes`.
pub fn asked<'a>(
    values: &[String],
    label: &str,
    scenes: &[&'a str],
) -> Result<Option<Option<&'a str>>, UnknownScene> {
    let mut found = None;
    for value in values {
        let (name, scene) = value
            .rsplit_once('=')
            .map_or((None, value.as_str()), |(n, s)| (Some(n), s));
        let known = scenes.iter().find(|known| **known == scene).copied();
        if known.is_none() && scene != "none" {
            return Err(UnknownScene {
                known: scenes.join(", "),
                found: scene.to_owned(),
            });
        }
        if name.is_none_or(|n| n == label) {
            found = Some(known);
        }
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_papers_scene_can_be_given_for_one_label_or_for_all() {
        let values = ["sponza".to_owned(), "b=none".to_owned()];
        let of = |values: &[String], label| asked(values, label, &["t-rex", "sponza"]);
        assert_eq!(of(&values, "a"), Ok(Some(Some("sponza"))));
        assert_eq!(of(&values, "b"), Ok(Some(None)));
        assert_eq!(of(&[], "a"), Ok(None));
        let error = of(&["a=x".to_owned()], "a").unwrap_err();
        assert_eq!(
            error.to_string(),
            "--as: expected none or one of t-rex, sponza, found `x`"
        );
    }
}
