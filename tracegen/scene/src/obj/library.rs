//! MTL statements. An unreadable one causes only a warning, because it affects a colour and not a
//! shape.

use super::statements::{Statement, for_each, number, without_comment};
use crate::files::Origin;
use crate::warnings::Warnings;
use glam::{DVec3, Vec2, Vec3};
use std::convert::Infallible;

/// A material as the library describes it; `None` for missing properties.
#[derive(Debug, Default)]
pub(super) struct Entry {
    pub name: String,
    /// `Kd`
    pub diffuse: Option<Vec3>,
    /// `Ks`
    pub specular: Option<Vec3>,
    /// `Ke`
    pub emissive: Option<Vec3>,
    /// `Ns`, the exponent of Blinn and Phong.
    pub shininess: Option<f32>,
    /// `Ni`
    pub ior: Option<f32>,
    /// `d`, 1 is opaque.
    pub dissolve: Option<f32>,
    /// `Tr`, 0 is opaque.
    pub transparency: Option<f32>,
    /// `illum`
    pub illumination: Option<f32>,
    /// `map_Kd`
    pub diffuse_map: Option<Map>,
    /// `map_Ks`
    pub specular_map: Option<Map>,
    /// `map_Ke`
    pub emissive_map: Option<Map>,
    /// `map_d`
    pub opacity_map: Option<Map>,
    /// `map_Bump` or `bump`
    pub bump_map: Option<Map>,
    /// `norm`
    pub normal_map: Option<Map>,
}

/// A texture as a map statement names it.
#[derive(Debug, PartialEq)]
pub(super) struct Map {
    /// File names that the statement may refer to, the most likely first.
    pub names: Vec<String>,
    /// `-s`, for texture coordinates that grow upwards.
    pub scale: Vec2,
    /// `-o`
    pub offset: Vec2,
    /// `-clamp on`
    pub clamp: bool,
    /// `-bm`
    pub bump_multiplier: f32,
}

/// Reads a library.
pub(super) fn read(text: &str, origin: &Origin, warnings: &mut Warnings) -> Vec<Entry> {
    let mut entries: Vec<Entry> = Vec::new();
    let read: Result<(), Infallible> = for_each(text, |statement| {
        if statement.keyword.eq_ignore_ascii_case("newmtl") {
            entries.push(Entry {
                name: statement.rest.to_owned(),
                ..Entry::default()
            });
        } else if let Some(entry) = entries.last_mut()
            && let Err(expected) = entry.set(&statement)
        {
            warnings.count("mtl", || {
                format!(
                    "{}: line {}: {}: expected {expected}, found '{}'; ignored",
                    origin.file.display(),
                    statement.line,
                    statement.keyword,
                    statement.rest
                )
            });
        }
        Ok(())
    });
    let Ok(()) = read;
    entries
}

impl Entry {
    /// Applies one statement. Unknown statements are ignored. The error states what is expected.
    fn set(&mut self, statement: &Statement<'_>) -> Result<(), &'static str> {
        match &*statement.keyword.to_ascii_lowercase() {
            "kd" => self.diffuse = Some(color(statement)?),
            "ks" => self.specular = Some(color(statement)?),
            "ke" => self.emissive = Some(color(statement)?),
            "ns" => self.shininess = Some(scalar(statement)?),
            "ni" => self.ior = Some(scalar(statement)?),
            "d" => self.dissolve = Some(scalar(statement)?),
            "tr" => self.transparency = Some(scalar(statement)?),
            "illum" => self.illumination = Some(scalar(statement)?),
            "map_kd" => self.diffuse_map = Some(map(statement)?),
            "map_ks" => self.specular_map = Some(map(statement)?),
            "map_ke" => self.emissive_map = Some(map(statement)?),
            "map_d" => self.opacity_map = Some(map(statement)?),
            "map_bump" | "bump" => self.bump_map = Some(map(statement)?),
            "norm" => self.normal_map = Some(map(statement)?),
            _ => {}
        }
        Ok(())
    }
}

/// Three numbers, or one for grey.
fn color(statement: &Statement<'_>) -> Result<Vec3, &'static str> {
    let color = match statement.numbers().as_deref() {
        Ok([grey]) => Some(DVec3::splat(*grey)),
        Ok([red, green, blue, ..]) => Some(DVec3::new(*red, *green, *blue)),
        _ => None,
    };
    (color
        .map(|color| color.as_vec3())
        .filter(|color| color.is_finite()))
    .ok_or("1 or 3 numbers (spectral files and CIE XYZ are not read)")
}

/// One number, which an option may precede (`d -halo 0.5`).
fn scalar(statement: &Statement<'_>) -> Result<f32, &'static str> {
    (statement.words().find(|word| *word != "-halo"))
        .and_then(number)
        .map(|value| value as f32)
        .filter(|value| value.is_finite())
        .ok_or("a number")
}

/// Options and a file name, which may hold spaces.
fn map(statement: &Statement<'_>) -> Result<Map, &'static str> {
    let mut map = Map {
        names: Vec::new(),
        scale: Vec2::ONE,
        offset: Vec2::ZERO,
        clamp: false,
        bump_multiplier: 1.0,
    };
    let mut rest = statement.rest;
    while let Some((option, after)) = word(rest).filter(|(word, _)| word.starts_with('-')) {
        let (least, most) = match option {
            "-o" | "-s" | "-t" => (1, 3),
            "-mm" => (2, 2),
            "-blendu" | "-blendv" | "-cc" | "-clamp" | "-bm" | "-boost" | "-texres"
            | "-imfchan" | "-type" | "-colorspace" => (1, 1),
            // A file name that begins with a dash.
            _ => break,
        };
        let (values, after) = values(after, least, most).ok_or("values of the option")?;
        let numbers: Vec<f32> = (values.iter())
            .map(|value| number(value).map(|n| n as f32).filter(|n| n.is_finite()))
            .map(Option::unwrap_or_default)
            .collect();
        let pair = |default| Vec2::new(numbers[0], *numbers.get(1).unwrap_or(&default));
        match option {
            "-s" => map.scale = pair(1.0),
            "-o" => map.offset = pair(0.0),
            "-clamp" => map.clamp = values[0].eq_ignore_ascii_case("on"),
            "-bm" => map.bump_multiplier = numbers[0],
            _ => {}
        }
        rest = after;
    }
    map.names = file_names(rest);
    if map.names.is_empty() {
        return Err("a file name");
    }
    Ok(map)
}

/// The first word and what follows it.
fn word(text: &str) -> Option<(&str, &str)> {
    let text = text.trim_start();
    let end = text.find(char::is_whitespace).unwrap_or(text.len());
    (end > 0).then(|| text.split_at(end))
}

/// From `least` to `most` words. Words beyond the least count only if they are numbers and a file
/// name follows.
fn values(text: &str, least: usize, most: usize) -> Option<(Vec<&str>, &str)> {
    let (mut values, mut rest) = (Vec::new(), text);
    while values.len() < most {
        let Some((value, after)) = word(rest) else {
            break;
        };
        if values.len() >= least && (number(value).is_none() || after.trim().is_empty()) {
            break;
        }
        values.push(value);
        rest = after;
    }
    (values.len() >= least).then_some((values, rest))
}

/// File names that a statement's text may mean: all of it, or all of it before a comment.
pub(super) fn file_names(text: &str) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for name in [text, without_comment(text)] {
        let name = name.trim().trim_matches('"').trim();
        if !name.is_empty() && !names.iter().any(|known| known == name) {
            names.push(name.to_owned());
        }
    }
    names
}
