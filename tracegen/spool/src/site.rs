//! Sites of a recording shader: the places where it records.

use serde::{Deserialize, Serialize};

/// Descriptor that an instruction reads through.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Binding {
    /// Descriptor set.
    pub set: u32,
    /// Binding in the set.
    pub binding: u32,
    /// Element of the binding's array; `None` if it varies between fragments.
    pub element: Option<u32>,
}

/// Operation of an image instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Access {
    /// Filtered texels.
    Sample,
    /// Four texels of a bilinear footprint.
    Gather,
    /// One texel at integer coordinates.
    Fetch,
}

/// Shape of a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Shape {
    /// Two-dimensional.
    Flat,
    /// Layers of two-dimensional textures; the last coordinate selects the layer.
    Array,
    /// Six faces; the coordinate is a direction.
    Cube,
}

/// Source of the level of detail.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Lod {
    /// Derivatives of the coordinates.
    Derivatives,
    /// The derivatives and a bias, which is the same for all fragments or, if `None`, in the record.
    Bias(Option<f32>),
    /// A level specified by the instruction; the same for all fragments or, if `None`, in the record.
    Explicit(Option<f32>),
    /// Explicit derivatives, which are in the record.
    Gradients,
}

/// Form of the records of a site.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Form {
    /// One record for the active lanes of a quad.
    Quad,
    /// One record per fragment, with a third coordinate, a level and derivatives.
    Fragment,
}

/// What a site records.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum What {
    /// A texture access.
    Texture(TextureSite),
    /// The start of a fragment, with its depth as coordinate u.
    Coverage,
    /// The end of a fragment that was not discarded.
    Survival,
    /// An access that a trace cannot represent, with its name.
    LeftOut(String),
}

/// A texture access.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TextureSite {
    /// The operation.
    pub access: Access,
    /// Shape of the texture.
    pub shape: Shape,
    /// The image.
    pub image: Binding,
    /// Binding of the sampler, if any. For a combined image sampler, it equals that of the image.
    pub sampler: Option<Binding>,
    /// Source of the level of detail.
    pub lod: Lod,
    /// Texel offset.
    pub offset: [i8; 2],
}

/// A place in a shader that records.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Site {
    /// What it records.
    pub what: What,
    /// Form of its records.
    pub form: Form,
    /// Number of the coordinate group. Sites with the same coordinates in the same lanes share a group.
    pub group: u16,
    /// Whether every fragment reaches the site before any is discarded.
    pub unconditional: bool,
}

/// Order of depth test and shading, as far as the shader determines it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DepthTests {
    /// The order has no effect: the shader neither discards nor writes anything except colours.
    #[default]
    Either,
    /// The test comes first, because the shader declares it.
    Early,
    /// The test comes first, but the depth is written after shading, because the shader discards.
    EarlyLateWrite,
    /// The test comes last, because the shader writes depth, sample mask or memory.
    Late,
}
