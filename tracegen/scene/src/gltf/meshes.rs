//! Primitives to meshes: attributes, indices, and computed values for missing attributes.

use super::accessors::Buffers;
use super::draco::{self, Compressed};
use super::materials::Table;
use super::variants;
use crate::Mesh;
use crate::SceneError;
use crate::animation::{Movers, Shape};
use crate::files::shown;
use crate::geometry::{complete_vertices, triangulate_fan, triangulate_strip};
use crate::warnings::Warnings;
use glam::{Vec2, Vec3, Vec4};
use gltf::json::accessor::Type;
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;

/// The morph targets and skin that move the vertices of a mesh.
#[derive(Clone, Copy, Default)]
pub(super) struct Moving {
    /// Number of joints of its skin.
    pub joints: Option<usize>,
    /// True if its morph targets have weights.
    pub morphs: bool,
}

/// Reads every triangle primitive of a glTF mesh, with the shapes of those whose vertices move.
pub(super) fn read(
    index: usize,
    variant: Option<u32>,
    moving: Moving,
    buffers: &Buffers<'_>,
    materials: &mut Table<'_>,
    warnings: &mut Warnings,
) -> Result<Vec<(Mesh, Option<Shape>)>, SceneError> {
    let mesh = &buffers.root.meshes[index];
    let given = mesh.name.as_deref().map(shown);
    let mut meshes = Vec::with_capacity(mesh.primitives.len());
    for (number, primitive) in mesh.primitives.iter().enumerate() {
        let mut reader = Reader {
            buffers,
            primitive,
            variant,
            moving,
            draco: None,
            place: match &given {
                Some(name) => format!("meshes[{index}] '{name}'.primitives[{number}]"),
                None => format!("meshes[{index}].primitives[{number}]"),
            },
        };
        reader.draco = draco::of_primitive(primitive, &reader.place, buffers)?;
        if let Some((mut read, shape)) = reader.read(materials, warnings)? {
            let name = given.clone().unwrap_or_else(|| format!("mesh-{index}"));
            read.name = if mesh.primitives.len() > 1 {
                format!("{name}.{number}")
            } else {
                name
            };
            meshes.push((read, shape));
        }
    }
    Ok(meshes)
}

/// Reader of one primitive.
pub(super) struct Reader<'a> {
    pub buffers: &'a Buffers<'a>,
    pub primitive: &'a Primitive,
    /// The material variant to show.
    variant: Option<u32>,
    moving: Moving,
    /// The primitive's compressed geometry.
    pub draco: Option<Compressed>,
    /// The primitive, named in errors.
    pub place: String,
}

impl Reader<'_> {
    /// `None` for a primitive without triangles.
    fn read(
        &self,
        materials: &mut Table<'_>,
        warnings: &mut Warnings,
    ) -> Result<Option<(Mesh, Option<Shape>)>, SceneError> {
        let place = &self.place;
        let mode = match self.primitive.mode {
            Checked::Valid(mode) => mode,
            Checked::Invalid => Mode::Points,
        };
        if !matches!(
            mode,
            Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan
        ) {
            warnings.count("not triangles", || {
                format!("{place} holds {}, not triangles; skipped", mode_name(mode))
            });
            return Ok(None);
        }
        let Some(positions) = self.vectors(&Semantic::Positions, "positions: Vec3 of F32")? else {
            warnings.count("no positions", || {
                format!("{place} has no positions; skipped")
            });
            return Ok(None);
        };
        let positions: Vec<Vec3> = positions.into_iter().map(Vec3::from_array).collect();
        self.check_positions(&positions)?;
        let mut indices = self.indices(mode, positions.len(), warnings)?;
        if indices.is_empty() {
            warnings.count("no triangles", || {
                format!("{place} has no triangles; skipped")
            });
            return Ok(None);
        }

        let material = variants::material(self.primitive, self.variant);
        let (material, uses) = materials.index(material)?;
        let count = positions.len();
        let [(set0, uses0), (set1, uses1)] = uses.sets;
        let uv0 = self.texture_coordinates(set0, count, warnings)?;
        let uv1 = if uses1 {
            self.texture_coordinates(set1, count, warnings)?
        } else {
            None
        };
        for (set, missing) in [
            (set0, uses0 && uv0.is_none()),
            (set1, uses1 && uv1.is_none()),
        ] {
            if missing {
                warnings.count("no coordinates", || {
                    format!("{place} has a textured material and no TEXCOORD_{set}; (0, 0) is used")
                });
            }
        }
        let normals = self.vectors(&Semantic::Normals, "normals: Vec3 of F32")?;
        let tangents = self.vectors(&Semantic::Tangents, "tangents: Vec4 of F32")?;

        let mut mesh = Mesh {
            positions,
            uv0: uv0.unwrap_or_else(|| vec![Vec2::ZERO; count]),
            uv1: uv1.unwrap_or_default(),
            normals: normals
                .map(|n| n.into_iter().map(Vec3::from_array).collect())
                .unwrap_or_default(),
            tangents: tangents
                .map(|t| t.into_iter().map(Vec4::from_array).collect())
                .unwrap_or_default(),
            colors: self.colors()?,
            material,
            ..Mesh::default()
        };
        // Missing or empty attributes are computed.
        let given = [
            ("NORMAL", mesh.normals.len()),
            ("TANGENT", mesh.tangents.len()),
            ("COLOR_0", mesh.colors.len()),
        ];
        for (what, found) in given.into_iter().filter(|(_, found)| *found > 0) {
            self.check_length(what, found, count)?;
        }
        let mut movers = self.movers(count, &indices, warnings)?;
        compact(&mut mesh, movers.as_mut(), &mut indices);
        mesh.indices = indices;
        let shape = movers.map(|movers| Shape::new(&mesh, movers, uses.normal_map_uv));
        complete_vertices(&mut mesh, uses.normal_map_uv);
        Ok(Some((mesh, shape)))
    }

    /// The morph targets and skin of the `count` vertices, if any.
    fn movers(
        &self,
        count: usize,
        indices: &[u32],
        warnings: &mut Warnings,
    ) -> Result<Option<Movers>, SceneError> {
        let targets = match self.moving.morphs {
            true => self.targets(count)?,
            false => Vec::new(),
        };
        let influences = match self.moving.joints {
            Some(joints) => self.influences(joints, count, indices, warnings)?,
            None => None,
        };
        if targets.is_empty() && influences.is_none() {
            return Ok(None);
        }
        // The vertices at rest are stored in addition to those of the pose.
        (self.buffers).spend::<[f32; 10]>(count as u64, || self.place.clone())?;
        Ok(Some(Movers {
            targets,
            influences,
        }))
    }

    pub fn accessor(&self, semantic: &Semantic) -> Option<usize> {
        let attributes = &self.primitive.attributes;
        (attributes.iter())
            .find(|(key, _)| matches!(key, Checked::Valid(s) if s == semantic))
            .map(|(_, accessor)| accessor.value())
    }

    pub fn vectors<const N: usize>(
        &self,
        semantic: &Semantic,
        expected: &str,
    ) -> Result<Option<Vec<[f32; N]>>, SceneError> {
        let accessor = self.accessor(semantic);
        if let Some(draco) = &self.draco
            && let Some(values) =
                draco.floats::<N>(semantic, accessor, &self.place, self.buffers)?
        {
            return Ok(Some(values));
        }
        accessor
            .map(|accessor| self.buffers.floats::<N>(accessor, expected))
            .transpose()
    }

    /// Linear colours, white where they are not numbers. Empty without COLOR_0.
    fn colors(&self) -> Result<Vec<Vec4>, SceneError> {
        let semantic = Semantic::Colors(0);
        let expected = "colours: Vec3 or Vec4 of F32 or normalized U8 or U16";
        let accessor = self.accessor(&semantic);
        let rgb = accessor.and_then(|a| self.buffers.element_type(a)) == Some(Type::Vec3);
        let colors = if rgb {
            (self.vectors::<3>(&semantic, expected)?)
                .map(|colors| colors.iter().map(|&c| Vec3::from(c).extend(1.0)).collect())
        } else {
            (self.vectors::<4>(&semantic, expected)?)
                .map(|colors| colors.into_iter().map(Vec4::from).collect())
        };
        let mut colors: Vec<Vec4> = colors.unwrap_or_default();
        for color in &mut colors {
            *color = if color.is_nan() {
                Vec4::ONE
            } else {
                color.clamp(Vec4::ZERO, Vec4::ONE)
            };
        }
        Ok(colors)
    }

    fn check_positions(&self, positions: &[Vec3]) -> Result<(), SceneError> {
        let Some(vertex) = positions.iter().position(|p| !p.is_finite()) else {
            return Ok(());
        };
        let accessor = self.accessor(&Semantic::Positions).unwrap_or_default();
        Err(self.buffers.origin.invalid(
            format!("{}, accessors[{accessor}], vertex {vertex}", self.place),
            "a finite position",
            positions[vertex].to_string(),
        ))
    }

    /// Checks that an attribute has one value per position.
    pub fn check_length(&self, what: &str, found: usize, count: usize) -> Result<(), SceneError> {
        if found == count {
            return Ok(());
        }
        Err(self.buffers.origin.invalid(
            format!("{}.{what}", self.place),
            format!("{count} elements, one a position"),
            found.to_string(),
        ))
    }

    fn texture_coordinates(
        &self,
        set: u32,
        count: usize,
        warnings: &mut Warnings,
    ) -> Result<Option<Vec<Vec2>>, SceneError> {
        let expected = "texture coordinates: Vec2 of F32 or normalized integers";
        let Some(uv) = self.vectors::<2>(&Semantic::TexCoords(set), expected)? else {
            return Ok(None);
        };
        self.check_length(&format!("TEXCOORD_{set}"), uv.len(), count)?;
        let mut bad = 0;
        let uv = uv
            .into_iter()
            .map(Vec2::from_array)
            .map(|c| {
                if c.is_finite() {
                    return c;
                }
                bad += 1;
                Vec2::ZERO
            })
            .collect();
        if bad > 0 {
            warnings.count("bad coordinates", || {
                format!(
                    "{}.TEXCOORD_{set} has {bad} coordinates that are not finite; (0, 0) is used",
                    self.place
                )
            });
        }
        Ok(Some(uv))
    }

    /// Three indices per triangle, all within the vertices.
    fn indices(
        &self,
        mode: Mode,
        vertices: usize,
        warnings: &mut Warnings,
    ) -> Result<Vec<u32>, SceneError> {
        let accessor = self.primitive.indices.map(|i| i.value());
        let indices = match (&self.draco, accessor) {
            (Some(draco), _) => draco.indices(),
            (None, Some(accessor)) => self.buffers.indices(accessor)?,
            (None, None) => (0..u32::try_from(vertices).unwrap_or(u32::MAX)).collect(),
        };
        if let Some(at) = indices.iter().position(|&i| i as usize >= vertices) {
            return Err(self.buffers.origin.invalid(
                format!(
                    "{}, accessors[{}], index {at}",
                    self.place,
                    accessor.unwrap_or_default()
                ),
                format!("a vertex below {vertices}"),
                indices[at].to_string(),
            ));
        }
        Ok(match mode {
            // Compressed geometry is always a triangle list, whatever the primitive's mode.
            _ if self.draco.is_some() => indices,
            Mode::TriangleStrip => triangulate_strip(&indices),
            Mode::TriangleFan => triangulate_fan(&indices),
            _ => {
                let mut triangles = indices;
                let left_over = triangles.len() % 3;
                if left_over > 0 {
                    warnings.count("left-over indices", || {
                        format!(
                            "{} has {left_over} indices after its last triangle; ignored",
                            self.place
                        )
                    });
                    triangles.truncate(triangles.len() - left_over);
                }
                triangles
            }
        })
    }
}

/// Drops unused vertices if they are at least half of all. Otherwise files whose primitives share
/// one vertex buffer would store it once per primitive.
fn compact(mesh: &mut Mesh, movers: Option<&mut Movers>, indices: &mut [u32]) {
    let count = mesh.positions.len();
    let mut used = vec![false; count];
    for &i in indices.iter() {
        used[i as usize] = true;
    }
    let kept = used.iter().filter(|&&u| u).count();
    if kept * 2 > count {
        return;
    }
    let mut new_index = vec![0u32; count];
    let mut next = 0;
    for (slot, &used) in new_index.iter_mut().zip(&used) {
        *slot = next;
        next += u32::from(used);
    }
    for i in indices.iter_mut() {
        *i = new_index[*i as usize];
    }
    fn keep<T>(values: &mut Vec<T>, used: &[bool]) {
        let mut flags = used.iter();
        values.retain(|_| flags.next().is_some_and(|&u| u));
        values.shrink_to_fit();
    }
    keep(&mut mesh.positions, &used);
    keep(&mut mesh.normals, &used);
    keep(&mut mesh.tangents, &used);
    keep(&mut mesh.uv0, &used);
    keep(&mut mesh.uv1, &used);
    keep(&mut mesh.colors, &used);
    if let Some(movers) = movers {
        movers.keep(&used);
    }
}

/// Primitives of a mode, in words.
const fn mode_name(mode: Mode) -> &'static str {
    match mode {
        Mode::Points => "points",
        Mode::Lines => "lines",
        Mode::LineLoop => "a line loop",
        Mode::LineStrip => "a line strip",
        Mode::Triangles => "triangles",
        Mode::TriangleStrip => "a triangle strip",
        Mode::TriangleFan => "a triangle fan",
    }
}
