//! Memory accesses by client.

crate::choices! { Client = "A client of memory.":
    Texture = "texture", "Texture units.";
    Index = "index", "Index fetch of vertex processing.";
    Vertex = "vertex", "Vertex fetch.";
    ShadedVertex = "shaded-vertex", "Positions and varyings of shaded vertices, written by vertex processing and read per tile.";
    PrimitiveList = "primitive-list", "Primitive lists of the tiles.";
    Colour = "colour", "Colour attachments.";
    Depth = "depth", "Depth attachments, including shadow maps.";
    GBuffer = "g-buffer", "The G-buffer of deferred shading.";
    Composition = "composition", "Composition of layers and the lens warp.";
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
