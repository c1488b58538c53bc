//! Memory accesses by client.

use serde::{Deserialize, Serialize};

/// A client of memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Client {
    /// Texture units.
    Texture,
    /// Index fetch of vertex processing.
    Index,
    /// Vertex fetch.
    Vertex,
    /// Positions and varyings of shaded vertices, written by vertex processing and read per tile.
    ShadedVertex,
    /// Primitive lists of the tiles.
    PrimitiveList,
    /// Colour attachments.
    Colour,
    /// Depth attachments, including shadow maps.
    Depth,
    /// The G-buffer of deferred shading.
    GBuffer,
    /// Composition of layers and the lens warp.
    Composition,
}

impl Client {
    /// Every client, in table order.
    pub const ALL: [Self; 9] = [
        Self::Texture,
        Self::Index,
        Self::Vertex,
        Self::ShadedVertex,
        Self::PrimitiveList,
        Self::Colour,
        Self::Depth,
        Self::GBuffer,
        Self::Composition,
    ];

    /// Name in tables and files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Texture => "texture",
            Self::Index => "index",
            Self::Vertex => "vertex",
            Self::ShadedVertex => "shaded-vertex",
            Self::PrimitiveList => "primitive-list",
            Self::Colour => "colour",
            Self::Depth => "depth",
            Self::GBuffer => "g-buffer",
            Self::Composition => "composition",
        }
    }
}

/// A read or write by a client, in whole lines of that client.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Access {
    /// The client.
    pub client: Client,
    /// True for a write.
    pub write: bool,
    /// First byte.
    pub address: u64,
    /// Number of bytes.
    pub bytes: u64,
}
