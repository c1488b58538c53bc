//! A manifest of captures: scenes, cameras and displays, crossed.
//!
//! ```toml
//! [base]                          # options of every capture, by their long names
//! size = "1024x1024"
//! [[captures]]                    # lists are crossed
//! scene = ["atrium", "sponza.gltf"]
//! hmd = ["vive", "quest2"]
//! [[captures]]
//! command = "rays"                # default: `raster`
//! scene = "chess"
//! ```

use anyhow::{Context, bail, ensure};
use std::path::Path;
use toml::{Table, Value};

/// A manifest with more captures is refused, because it is probably a mistake.
const MOST_CAPTURES: usize = 10_000;

/// Options that a manifest must not contain, because the sweep sets them.
const OWN_OPTIONS: [&str; 5] = ["output", "image", "threads", "quiet", "help"];

/// A capture to make.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Capture {
    /// Name of the trace's file.
    pub file: String,
    /// Arguments of `tracegen` without the output.
    pub arguments: Vec<String>,
    /// Number of its `[[captures]]` table, from 1.
    pub table: usize,
}

impl Capture {
    /// The arguments in one line, as in the recipes of golden traces.
    pub fn recipe(&self) -> String {
        let words: Vec<_> = self.arguments.iter().map(|a| shell::quoted(a)).collect();
        words.join(" ")
    }

    /// Name of the recipe's file: the trace's name with `.recipe` appended, so that a texture trace and a ray
    /// trace with the same name have separate recipes.
    pub fn recipe_file(&self) -> String {
        format!("{}.recipe", self.file)
    }

    /// Text of the recipe's file: the arguments and the checksum of the trace.
    pub fn recipe_text(&self, checksum: u32) -> String {
        format!("{}\n# content checksum {checksum:08x}\n", self.recipe())
    }
}

/// Reads a manifest.
///
/// # Errors
/// A syntax error, an unknown table, an invalid option value, or two captures with one file name.
pub fn parse(text: &str) -> anyhow::Result<Vec<Capture>> {
    let manifest: Table =
        toml::from_str(text).map_err(|e| anyhow::anyhow!("{}", e.to_string().trim()))?;
    let mut base = Table::new();
    let mut tables = Vec::new();
    for (key, value) in manifest {
        match (key.as_str(), value) {
            ("base", Value::Table(table)) => base = table,
            ("captures", Value::Array(list)) => tables = list,
            (key, value) => bail!(
                "`{key}`: expected [base] or [[captures]], found {}",
                value.type_str()
            ),
        }
    }
    ensure!(!tables.is_empty(), "expected [[captures]], found none");
    let mut captures: Vec<Capture> = Vec::new();
    for (index, own) in tables.into_iter().enumerate() {
        let place = || format!("[[captures]] {}", index + 1);
        let Value::Table(own) = own else {
            bail!("{}: expected a table", place());
        };
        let mut options = base.clone();
        options.extend(own);
        for capture in crossed(options, index + 1).with_context(place)? {
            if let Some(other) = captures.iter().find(|c| c.file == capture.file) {
                bail!(
                    "{}: `{}` and `{}` would both be {}; give one table a `name`",
                    place(),
                    other.recipe(),
                    capture.recipe(),
                    capture.file
                );
            }
            captures.push(capture);
            ensure!(
                captures.len() <= MOST_CAPTURES,
                "expected at most {MOST_CAPTURES} captures, found more"
            );
        }
    }
    Ok(captures)
}

/// The captures of a table: every combination of its lists' values.
fn crossed(mut options: Table, table: usize) -> anyhow::Result<Vec<Capture>> {
    let mut word = |key: &str| match options.remove(key) {
        None => Ok(None),
        Some(Value::String(text)) => Ok(Some(text)),
        Some(other) => bail!("`{key}`: expected text, found {other}"),
    };
    let command = word("command")?.unwrap_or_else(|| "raster".to_owned());
    let name = word("name")?;
    if let Some(name) = &name {
        // The name starts a file name in the sweep's folder, so it must not lead to another folder.
        ensure!(
            !name.contains(['/', '\\', '\0']),
            "`name`: expected a part of a file's name, found {name:?}"
        );
    }
    let extension = match command.as_str() {
        "raster" => "textrace",
        "rays" => "raytrace",
        other => bail!("`command`: expected raster or rays, found `{other}`"),
    };
    let scenes = options
        .remove("scene")
        .context("`scene`: expected one or a list, found none")?;
    let mut axes = vec![("scene".to_owned(), values("scene", scenes)?)];
    for (key, value) in options {
        ensure!(
            !OWN_OPTIONS.contains(&key.as_str()),
            "`{key}`: the sweep sets it itself"
        );
        let values = values(&key, value)?;
        axes.push((key, values));
    }
    let product = axes.iter().map(|(_, values)| values.len());
    let count = product.fold(1usize, usize::saturating_mul);
    ensure!(
        count <= MOST_CAPTURES,
        "expected at most {MOST_CAPTURES} captures, found {count}"
    );
    let capture = |mut number: usize| {
        let mut arguments = vec![command.clone()];
        let mut parts: Vec<String> = name.iter().cloned().collect();
        let mut chosen = Vec::new();
        // The last axis varies fastest.
        for (key, values) in axes.iter().rev() {
            chosen.push((key, &values[number % values.len()], values.len() > 1));
            number /= values.len();
        }
        for (key, value, varies) in chosen.into_iter().rev() {
            let is_scene = key == "scene";
            if varies || is_scene && name.is_none() {
                parts.push(short(value.as_deref().unwrap_or(key), is_scene));
            }
            match value {
                Some(value) if is_scene => arguments.push(value.clone()),
                Some(value) if value.is_empty() => arguments.push(format!("--{key}")),
                Some(value) if value.starts_with('-') => arguments.push(format!("--{key}={value}")),
                Some(value) => arguments.extend([format!("--{key}"), value.clone()]),
                None => {}
            }
        }
        Capture {
            file: format!("{}.{extension}", parts.join("-")),
            arguments,
            table,
        }
    };
    Ok((0..count).map(capture).collect())
}

/// The values of an option: text; empty for a switch that is set, `None` for one that is not.
fn values(key: &str, value: Value) -> anyhow::Result<Vec<Option<String>>> {
    let values = match value {
        Value::Array(values) if values.is_empty() => bail!("`{key}`: expected values, found none"),
        Value::Array(values) => values,
        value => vec![value],
    };
    let text = |value: Value| match value {
        Value::String(text) if text.is_empty() => bail!("`{key}`: expected text, found none"),
        Value::String(text) => Ok(Some(text)),
        Value::Integer(_) | Value::Float(_) => Ok(Some(value.to_string())),
        Value::Boolean(set) if key != "scene" => Ok(set.then(String::new)),
        other => bail!("`{key}`: expected text, a number or true, found {other}"),
    };
    values.into_iter().map(text).collect()
}

/// A value as part of a file name; a scene is represented by its file name without extension.
fn short(value: &str, is_scene: bool) -> String {
    let stem = Path::new(value).file_stem().filter(|_| is_scene);
    let text = stem.map_or(value.into(), |stem| stem.to_string_lossy());
    let kept = |c: char| {
        if c.is_alphanumeric() || "._+".contains(c) {
            c
        } else {
            '_'
        }
    };
    text.chars().map(kept).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn recipes(text: &str) -> Vec<(String, String)> {
        let captures = parse(text).unwrap();
        captures
            .into_iter()
            .map(|c| (c.file.clone(), c.recipe()))
            .collect()
    }

    #[test]
    fn lists_are_crossed_and_name_the_files() {
        let text = "[base]\nsize = \"64x48\"\nno-plain = true\n[[captures]]\nscene = [\"atrium\", \"models/my scene.gltf\"]\nhmd = [\"vive\", \"quest2\"]\n\
                    [[captures]]\ncommand = \"rays\"\nscene = \"chess\"\nno-plain = false\nspp = 2\ncant = -5\n[[captures]]\nname = \"dark\"\nscene = \"atrium\"\nshadows = true\n";
        let expected = [
            (
                "atrium-vive.textrace",
                "raster atrium --hmd vive --no-plain --size 64x48",
            ),
            (
                "atrium-quest2.textrace",
                "raster atrium --hmd quest2 --no-plain --size 64x48",
            ),
            (
                "my_scene-vive.textrace",
                "raster 'models/my scene.gltf' --hmd vive --no-plain --size 64x48",
            ),
            (
                "my_scene-quest2.textrace",
                "raster 'models/my scene.gltf' --hmd quest2 --no-plain --size 64x48",
            ),
            (
                "chess.raytrace",
                "rays chess --cant=-5 --size 64x48 --spp 2",
            ),
            (
                "dark.textrace",
                "raster atrium --no-plain --shadows --size 64x48",
            ),
        ];
        let expected: Vec<_> = expected.map(|(a, b)| (a.to_owned(), b.to_owned())).into();
        assert_eq!(recipes(text), expected);
    }

    #[test]
    fn what_is_no_manifest_is_refused() {
        let many = |n: usize| (0..n).map(|i| i.to_string()).collect::<Vec<_>>().join(",");
        let crossed = format!(
            "[[captures]]\nscene = \"a\"\na = [{0}]\nb = [{0}]\n",
            many(101)
        );
        for (text, expected) in [
            ("", "expected [[captures]], found none"),
            ("[capture]\n", "`capture`: expected [base] or [[captures]]"),
            ("captures = [1]\n", "[[captures]] 1: expected a table"),
            (
                "[[captures]]\n",
                "`scene`: expected one or a list, found none",
            ),
            (
                "[[captures]]\nscene = []\n",
                "`scene`: expected values, found none",
            ),
            ("[[captures]]\nscene = true\n", "`scene`: expected text"),
            (
                "[[captures]]\nscene = \"a\"\ncommand = \"rm\"\n",
                "raster or rays, found `rm`",
            ),
            (
                "[[captures]]\nscene = \"a\"\nname = \"../a\"\n",
                "`name`: expected a part of a file's name, found \"../a\"",
            ),
            (
                "[[captures]]\nscene = \"a\"\noutput = \"b\"\n",
                "`output`: the sweep sets it itself",
            ),
            (
                "[[captures]]\nscene = \"a\"\nx = { y = 1 }\n",
                "`x`: expected text, a number or true",
            ),
            (
                "[[captures]]\nscene = [\"a/s.obj\", \"b/s.obj\"]\n",
                "would both be s.textrace",
            ),
            ("[[captures]]\nscene = \n", "line 2"),
            (&crossed, "at most 10000 captures, found 10201"),
        ] {
            let error = format!("{:#}", parse(text).unwrap_err());
            assert!(error.contains(expected), "{text}: {error}");
        }
    }
}
