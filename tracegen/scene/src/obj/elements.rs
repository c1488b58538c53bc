//! The OBJ file's statements: vertices, faces, and the object and material of each face.

use super::statements::{Statement, for_each};
use crate::error::SceneError;
use crate::files::{Origin, shown};
use crate::origin;
use glam::{DVec3, DVec4, Vec2, Vec3, Vec4};
use std::ops::Range;
use std::rc::Rc;

/// A missing index of a face.
pub(super) const NONE: u32 = u32::MAX;

/// The object of faces before any `o` or `g`.
const UNNAMED: &str = "unnamed_object";

/// One corner of a face: zero-based indices of position, texture coordinate and normal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Corner {
    pub position: u32,
    pub uv: u32,
    pub normal: u32,
}

/// A face: its first corner, and its line for errors.
#[derive(Clone, Copy, Debug)]
struct Face {
    first_corner: usize,
    line: u32,
}

/// Consecutive faces with the same object and material.
#[derive(Clone, Debug)]
pub(super) struct Run {
    /// Name of the object or group.
    pub object: Rc<str>,
    /// True if the previous run belongs to another object or group, even one of the same name.
    pub starts_object: bool,
    /// The material's name as written in the file.
    pub material: Option<Rc<str>>,
    pub faces: Range<usize>,
}

/// Contents of an OBJ file.
#[derive(Debug, Default)]
pub(super) struct Elements {
    positions: Vec<DVec3>,
    /// World position that [`Self::position`] is relative to.
    pub origin: DVec3,
    /// sRGB colours with alpha of the first positions. NaN marks missing values.
    pub colors: Vec<Vec4>,
    /// True if the file's colours range from 0 to 255. `colors` ranges to 1 in any case.
    pub colors_of_bytes: bool,
    pub uvs: Vec<Vec2>,
    pub normals: Vec<Vec3>,
    /// Corners of all faces.
    corners: Vec<Corner>,
    faces: Vec<Face>,
    pub runs: Vec<Run>,
    /// Arguments of `mtllib`, by line.
    pub libraries: Vec<(usize, String)>,
    /// Points, lines and faces with fewer than three corners.
    pub not_faces: u64,
    /// Statements of curves and surfaces.
    pub free_form: u64,
}

impl Elements {
    /// Reads every statement and checks every index.
    ///
    /// # Errors
    /// Invalid numbers and indices, and indices outside the file, with their line.
    pub fn read(text: &str, file: &Origin) -> Result<Self, SceneError> {
        let mut elements = Self::default();
        elements.runs.push(Run {
            object: UNNAMED.into(),
            starts_object: true,
            material: None,
            faces: 0..0,
        });
        for_each(text, |statement| elements.add(&statement, file))?;
        elements.finish_run();
        elements.check(file)?;
        let used = elements
            .corners
            .iter()
            .map(|c| elements.positions[c.position as usize]);
        elements.origin = origin::of(origin::bounds(used));
        elements.colors_of_bytes =
            (elements.colors.iter()).any(|c| c.to_array().iter().any(|&v| v > 1.0));
        if elements.colors_of_bytes {
            elements.colors.iter_mut().for_each(|c| *c /= 255.0);
        }
        Ok(elements)
    }

    /// A position by its number.
    pub fn position(&self, index: u32) -> Vec3 {
        origin::relative(self.positions[index as usize], self.origin)
    }

    /// The corners of a face, at least three.
    pub fn corners(&self, face: usize) -> &[Corner] {
        let end = self.faces.get(face + 1);
        let end = end.map_or(self.corners.len(), |f| f.first_corner);
        &self.corners[self.faces[face].first_corner..end]
    }

    fn add(&mut self, statement: &Statement<'_>, origin: &Origin) -> Result<(), SceneError> {
        match statement.keyword {
            "v" => self.add_position(statement, origin)?,
            "vt" => {
                let uv = numbers(statement, origin, 1)?;
                let v = uv.get(1).copied().unwrap_or_default();
                self.uvs.push(Vec2::new(uv[0] as f32, v as f32));
            }
            "vn" => {
                let normal = numbers(statement, origin, 3)?;
                self.normals.push(DVec3::from_slice(&normal).as_vec3());
            }
            "f" | "fo" => self.add_face(statement, origin)?,
            "o" | "g" => {
                let name = match statement.rest {
                    "" => UNNAMED,
                    name => name,
                };
                self.start_run(|run| {
                    run.object = shown(name).into();
                    run.starts_object = true;
                });
            }
            "usemtl" => {
                let name = Some(statement.rest).filter(|name| !name.is_empty());
                self.start_run(|run| run.material = name.map(Rc::from));
            }
            "mtllib" => {
                self.libraries
                    .push((statement.line, statement.rest.to_owned()));
            }
            "p" | "l" => self.not_faces += 1,
            "vp" | "cstype" | "curv" | "curv2" | "surf" => self.free_form += 1,
            // Smoothing groups, display attributes and unknown statements do not change the shape.
            _ => {}
        }
        Ok(())
    }

    fn add_position(
        &mut self,
        statement: &Statement<'_>,
        origin: &Origin,
    ) -> Result<(), SceneError> {
        let v = numbers(statement, origin, 3)?;
        let mut position = DVec3::from_slice(&v);
        match v[3..] {
            [] => {}
            [weight] if weight != 0.0 => position /= weight,
            [red, green, blue, ref alpha @ ..] => {
                let alpha = alpha.first().copied().unwrap_or(f64::NAN);
                self.colors.resize(self.positions.len(), Vec4::NAN);
                self.colors
                    .push(DVec4::new(red, green, blue, alpha).as_vec4());
            }
            _ => {
                return Err(origin.invalid(
                    format!("line {}, v", statement.line),
                    "3 numbers, a weight other than 0 after them, or 3 or 4 of a colour",
                    format!("'{}'", statement.rest),
                ));
            }
        }
        self.positions.push(position);
        Ok(())
    }

    fn add_face(&mut self, statement: &Statement<'_>, origin: &Origin) -> Result<(), SceneError> {
        let first_corner = self.corners.len();
        let counts = [&self.positions.len(), &self.uvs.len(), &self.normals.len()];
        let counts = counts.map(|&n| n as i64);
        for word in statement.words() {
            let corner = corner(word, counts).ok_or_else(|| {
                origin.invalid(
                    format!("line {}, {}", statement.line, statement.keyword),
                    "corners as v, v/vt, v//vn or v/vt/vn with numbers of elements, negative ones \
                     counted back from here",
                    format!("'{word}'"),
                )
            })?;
            self.corners.push(corner);
        }
        if self.corners.len() < first_corner + 3 {
            self.corners.truncate(first_corner);
            self.not_faces += 1;
            return Ok(());
        }
        let line = u32::try_from(statement.line).unwrap_or(u32::MAX);
        self.faces.push(Face { first_corner, line });
        Ok(())
    }

    /// Starts a run that differs from the current one. A run without faces is changed in place.
    fn start_run(&mut self, change: impl FnOnce(&mut Run)) {
        let here = self.faces.len();
        self.finish_run();
        if let Some(last) = self.runs.last()
            && !last.faces.is_empty()
        {
            let next = Run {
                starts_object: false,
                faces: here..here,
                ..last.clone()
            };
            self.runs.push(next);
        }
        if let Some(run) = self.runs.last_mut() {
            change(run);
        }
    }

    fn finish_run(&mut self) {
        if let Some(run) = self.runs.last_mut() {
            run.faces.end = self.faces.len();
        }
    }

    /// Checks the references of faces. Removes texture coordinates and normals from the corners if
    /// the file has none.
    fn check(&mut self, origin: &Origin) -> Result<(), SceneError> {
        let counts = [self.positions.len(), self.uvs.len(), self.normals.len()];
        for face in 0..self.faces.len() {
            let line = self.faces[face].line;
            let first = self.faces[face].first_corner;
            let end = first + self.corners(face).len();
            for corner in &mut self.corners[first..end] {
                let Corner { uv, normal, .. } = corner;
                for (index, count) in [(uv, counts[1]), (normal, counts[2])] {
                    if count == 0 {
                        *index = NONE;
                    }
                }
                let indices = [corner.position, corner.uv, corner.normal];
                for ((index, count), what) in indices.into_iter().zip(counts).zip(["v", "vt", "vn"])
                {
                    if index != NONE && index as usize >= count {
                        return Err(origin.invalid(
                            format!("line {line}, f"),
                            format!("a number of one of the file's {count} {what}"),
                            (u64::from(index) + 1).to_string(),
                        ));
                    }
                }
                let position = self.positions[corner.position as usize];
                if !position.as_vec3().is_finite() {
                    return Err(origin.invalid(
                        format!("line {line}, f, v number {}", corner.position + 1),
                        "a finite position",
                        position.to_string(),
                    ));
                }
            }
        }
        Ok(())
    }
}

/// Parses `v`, `v/vt`, `v//vn` or `v/vt/vn`; `counts` are the numbers of elements so far. `None`
/// for anything else, including indices before the first element.
fn corner(word: &str, counts: [i64; 3]) -> Option<Corner> {
    let mut indices = [NONE; 3];
    for (at, part) in word.split('/').enumerate() {
        let count = *counts.get(at)?;
        if part.is_empty() && at > 0 {
            continue;
        }
        let index = match part.parse::<i64>().ok()? {
            0 => return None,
            back @ ..0 => count.checked_add(back)?,
            from_one => from_one - 1,
        };
        indices[at] = u32::try_from(index).ok().filter(|&i| i != NONE)?;
    }
    let [position, uv, normal] = indices;
    Some(Corner {
        position,
        uv,
        normal,
    })
}

/// The statement's numbers. Too few are an error.
fn numbers(
    statement: &Statement<'_>,
    origin: &Origin,
    at_least: usize,
) -> Result<Vec<f64>, SceneError> {
    let invalid = |found: String| {
        let place = format!("line {}, {}", statement.line, statement.keyword);
        origin.invalid(place, format!("at least {at_least} numbers"), found)
    };
    let numbers = (statement.numbers()).map_err(|word| invalid(format!("'{word}'")))?;
    if numbers.len() < at_least {
        return Err(invalid(numbers.len().to_string()));
    }
    Ok(numbers)
}
