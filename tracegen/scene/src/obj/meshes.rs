//! Faces to meshes: one mesh per run of faces with the same object and material.

use super::elements::{Corner, Elements, NONE, Run};
use super::polygon::triangulate;
use crate::geometry::{unit_or, vertex_normals, vertex_tangents};
use crate::{Mesh, srgb};
use glam::{Vec2, Vec3, Vec4};
use std::collections::HashMap;

/// The meshes of the file in order, each with the material from `material_of`.
pub(super) fn build(
    elements: &Elements,
    mut material_of: impl FnMut(&Run) -> Option<usize>,
) -> Vec<(Mesh, Option<usize>)> {
    let mut parts: Vec<(&Run, Option<usize>, Part<'_>)> = Vec::new();
    let mut starts_object = true;
    for run in &elements.runs {
        starts_object |= run.starts_object;
        if run.faces.is_empty() {
            continue;
        }
        let material = material_of(run);
        let goes_on = !starts_object && parts.last().is_some_and(|(_, m, _)| *m == material);
        if !goes_on {
            parts.push((run, material, Part::new(elements)));
        }
        starts_object = false;
        if let Some((.., part)) = parts.last_mut() {
            run.faces.clone().for_each(|face| part.add_face(face));
        }
    }
    (parts.into_iter())
        .map(|(run, material, part)| (part.finish(run.object.to_string()), material))
        .collect()
}

/// A mesh under construction.
struct Part<'a> {
    elements: &'a Elements,
    /// Corners in order of first use, each once: the mesh's vertices.
    vertices: Vec<Corner>,
    index_of: HashMap<Corner, u32>,
    indices: Vec<u32>,
}

impl<'a> Part<'a> {
    fn new(elements: &'a Elements) -> Self {
        Self {
            elements,
            vertices: Vec::new(),
            index_of: HashMap::new(),
            indices: Vec::new(),
        }
    }

    fn add_face(&mut self, face: usize) {
        let corners = self.elements.corners(face);
        if let [_, _, _] = corners {
            corners.iter().for_each(|&corner| self.add_corner(corner));
            return;
        }
        let polygon: Vec<Vec3> = corners
            .iter()
            .map(|c| self.elements.position(c.position))
            .collect();
        for triangle in triangulate(&polygon) {
            for i in triangle {
                self.add_corner(corners[i]);
            }
        }
    }

    fn add_corner(&mut self, corner: Corner) {
        let next = self.vertices.len() as u32;
        let index = *self.index_of.entry(corner).or_insert(next);
        if index == next {
            self.vertices.push(corner);
        }
        self.indices.push(index);
    }

    fn finish(self, name: String) -> Mesh {
        let Self {
            elements,
            vertices,
            indices,
            ..
        } = self;
        let at = |index: u32| index as usize;
        let positions: Vec<Vec3> = (vertices.iter())
            .map(|c| elements.position(c.position))
            .collect();
        let uv0: Vec<Vec2> = (vertices.iter())
            .map(|c| match c.uv {
                NONE => Vec2::ZERO,
                // v grows upwards in OBJ and downwards here.
                uv => Vec2::new(elements.uvs[at(uv)].x, 1.0 - elements.uvs[at(uv)].y),
            })
            .map(|uv| if uv.is_finite() { uv } else { Vec2::ZERO })
            .collect();
        let computed = vertex_normals(&positions, &indices);
        let normals: Vec<Vec3> = (vertices.iter().zip(computed))
            .map(|(c, computed)| match c.normal {
                NONE => computed,
                normal => unit_or(elements.normals[at(normal)], computed),
            })
            .collect();
        let colored = elements.colors.len();
        let colors = if vertices.iter().any(|c| at(c.position) < colored) {
            (vertices.iter())
                .map(|c| elements.colors.get(at(c.position)))
                .map(|c| c.copied().map_or(Vec4::ONE, linear))
                .collect()
        } else {
            Vec::new()
        };
        let tangents = vertex_tangents(&positions, &normals, &uv0, &indices);
        Mesh {
            name,
            positions,
            normals,
            tangents,
            uv0,
            uv1: Vec::new(),
            colors,
            indices,
            material: 0,
        }
    }
}

/// Colours of OBJ files are sRGB. NaN marks missing values.
fn linear(color: Vec4) -> Vec4 {
    let unit = |value: f32| {
        if value.is_nan() {
            1.0
        } else {
            value.clamp(0.0, 1.0)
        }
    };
    let rgb = color
        .truncate()
        .map(unit)
        .map(|c| srgb::decode(c.into()) as f32);
    rgb.extend(unit(color.w))
}
