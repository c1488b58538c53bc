//! Refuses KHR_draco_mesh_compression in programs that are built without its decoder.

use super::accessors::Buffers;
use crate::SceneError;
use crate::error::without_feature;
use gltf::json::mesh::{Primitive, Semantic};

const NAME: &str = "KHR_draco_mesh_compression";

/// A decoded primitive, of which there is none.
pub(super) enum Compressed {}

/// Refuses a compressed primitive.
pub(super) fn of_primitive(
    primitive: &Primitive,
    place: &str,
    buffers: &Buffers<'_>,
) -> Result<Option<Compressed>, SceneError> {
    let others = primitive.extensions.as_ref().map(|e| &e.others);
    if others.is_none_or(|others| !others.contains_key(NAME)) {
        return Ok(None);
    }
    let (expected, found) = without_feature("draco");
    Err(buffers
        .origin
        .invalid(format!("{place}.extensions.{NAME}"), expected, found))
}

impl Compressed {
    /// See the decoder.
    pub fn indices(&self) -> Vec<u32> {
        match *self {}
    }

    /// See the decoder.
    pub fn floats<const N: usize>(
        &self,
        _semantic: &Semantic,
        _accessor: Option<usize>,
        _place: &str,
        _buffers: &Buffers<'_>,
    ) -> Result<Option<Vec<[f32; N]>>, SceneError> {
        match *self {}
    }
}
