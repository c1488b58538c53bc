//! Published figures to compare with, and the stand-in scenes for the papers' scenes.
//!
//! The papers' scenes are not freely available. A scene stands in for one of them if the paper's table
//! lists its exact short name, or if the command line says so. Parts of names never match.

pub mod score;
pub mod sgrt;
pub mod vr;
pub mod z2;

/// Finds a scene in a paper's table of `(our short name, entry)`.
///
/// `scene` is the name or path that the trace records; see [`scene_name`](crate::result::scene_name).
pub fn stand_in<'t, T>(scene: &str, table: &'t [(&str, T)]) -> Option<&'t T> {
    let short = crate::result::scene_name(scene);
    let entry = table.iter().find(|(name, _)| *name == short)?;
    Some(&entry.1)
}

/// A scene of `--as` that the paper does not have.
#[derive(Debug, thiserror::Error, PartialEq, Eq)]
#[error("--as: expected none or one of {known}, found `{found}`")]
pub struct UnknownScene {
    known: String,
    found: String,
}

/// The paper's scene that the values of `--as` assign to a trace's label: SCENE for every trace,
/// LABEL=SCENE for one, `none` for no scene. The last matching value counts. `None` if no value matches.
///
/// # Errors
/// A scene that is not among `scenes`.
pub fn assigned_scene<'a>(
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
    fn parts_of_a_name_do_not_match() {
        let table = [("car", "BMW"), ("lab", "Chemical Lab.")];
        assert_eq!(stand_in("car", &table), Some(&"BMW"));
        for other in ["scarf.gltf", "label", "collab/model.gltf", "car-park"] {
            assert_eq!(stand_in(other, &table), None, "{other}");
        }
    }

    #[test]
    fn a_scene_of_the_paper_can_be_assigned_to_one_label_or_to_all() {
        let values = ["sponza".to_owned(), "b=none".to_owned()];
        let of = |values: &[String], label| assigned_scene(values, label, &["t-rex", "sponza"]);
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
