//! KHR_draco_mesh_compression: a primitive's triangles and attributes.

use super::accessors::Buffers;
use crate::SceneError;
use draco_core::{DataType, DecodeLimits, DecoderBuffer, Mesh, MeshDecoder};
use gltf::json::mesh::{Primitive, Semantic};
use serde::Deserialize;
use serde_json::Value;
use std::collections::BTreeMap;

const NAME: &str = "KHR_draco_mesh_compression";

/// Most points and triangles per compressed byte. Encoders reach about two points per byte. Only a
/// mesh of equal values compresses further, and such a mesh has no use.
const MAX_POINTS_PER_BYTE: u64 = 256;

/// Points and triangles that any primitive may have, however small the file is.
const SMALL_MESH_POINTS: u64 = 1 << 16;

/// Bytes of one point's attribute: sixteen floats.
const MAX_POINT_BYTES: u64 = 64 * 16;

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Extension {
    buffer_view: usize,
    attributes: BTreeMap<String, u32>,
}

/// A decoded primitive.
pub(super) struct Compressed {
    mesh: Mesh,
    /// Draco's id of each attribute.
    attributes: BTreeMap<String, u32>,
}

/// Decodes the geometry of a compressed primitive.
pub(super) fn of_primitive(
    primitive: &Primitive,
    place: &str,
    buffers: &Buffers<'_>,
) -> Result<Option<Compressed>, SceneError> {
    let others = primitive.extensions.as_ref().map(|e| &e.others);
    let Some(value) = others.and_then(|others| others.get(NAME)) else {
        return Ok(None);
    };
    let place = format!("{place}.extensions.{NAME}");
    let invalid = |expected: &str, found: String| buffers.origin.invalid(&place, expected, found);
    let Extension {
        buffer_view,
        attributes,
    } = Extension::deserialize(value as &Value)
        .map_err(|e| invalid("a compressed primitive", e.to_string()))?;
    let stored = buffers.view(buffer_view)?;
    let points = (stored.len() as u64 * MAX_POINTS_PER_BYTE).max(SMALL_MESH_POINTS);
    let limits = DecodeLimits::default()
        .with_max_points(points)
        .with_max_faces(points)
        .with_max_decoded_bytes(points.saturating_mul(MAX_POINT_BYTES).min(1 << 29));
    let mut buffer = DecoderBuffer::new(stored).with_limits(limits);
    let mut mesh = Mesh::new();
    MeshDecoder::new()
        .decode(&mut buffer, &mut mesh)
        .map_err(|e| invalid("readable Draco data", e.to_string()))?;
    buffers.spend::<[u32; 3]>(mesh.num_faces() as u64, || place.clone())?;
    Ok(Some(Compressed { mesh, attributes }))
}

impl Compressed {
    /// Three indices per triangle.
    pub fn indices(&self) -> Vec<u32> {
        let corners = self.mesh.faces().iter().flatten();
        corners.map(|point| point.0).collect()
    }

    /// The values of an attribute, one per point; `None` if the attribute is not compressed. The
    /// accessor determines whether integers are normalized.
    pub fn floats<const N: usize>(
        &self,
        semantic: &Semantic,
        accessor: Option<usize>,
        place: &str,
        buffers: &Buffers<'_>,
    ) -> Result<Option<Vec<[f32; N]>>, SceneError> {
        let name = semantic.to_string();
        let Some(number) = self.attributes.get(&name) else {
            return Ok(None);
        };
        let place = || format!("{place}.extensions.{NAME}.attributes.{name}");
        let attribute = self.mesh.attribute_by_unique_id(*number);
        let Some(attribute) = attribute.filter(|a| usize::from(a.num_components()) >= N) else {
            return Err(buffers.origin.invalid(
                place(),
                format!("a Draco attribute of {N} components"),
                format!("none of number {number}"),
            ));
        };
        let points = self.mesh.num_points();
        buffers.spend::<[f32; N]>(points as u64, place)?;
        let one = match (buffers.is_normalized(accessor), attribute.data_type()) {
            (true, DataType::Uint8) => Some(255.0),
            (true, DataType::Int8) => Some(127.0),
            (true, DataType::Uint16) => Some(65535.0),
            (true, DataType::Int16) => Some(32767.0),
            _ => None,
        };
        let values = attribute.read_f32s(points, N);
        let float = |value: f32| one.map_or(value, |one: f32| (value / one).max(-1.0));
        let value = |values: &[f32]| std::array::from_fn(|i| float(values[i]));
        Ok(Some(values.chunks_exact(N).map(value).collect()))
    }
}
