//! Sites of an instrumented shader, and their records.

use serde::{Deserialize, Serialize};

/// A descriptor that an instruction reads through.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Binding {
    /// Descriptor set.
    pub set: u32,
    /// Binding in the set.
    pub binding: u32,
    /// Element of the binding's array; `None` where each fragment chooses it.
    pub element: Option<u32>,
}

/// Operation of an instruction on a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Access {
    /// Filters texels.
    Sample,
    /// Takes four texels of a bilinear footprint.
    Gather,
    /// Takes one texel by its integer coordinates.
    Fetch,
}

/// Shape of a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Shape {
    /// Two-dimensional.
    Flat,
    /// Layers of two-dimensional ones; the last coordinate chooses.
    Array,
    /// Six faces; the coordinate is a direction.
    Cube,
}

/// Where the level of detail comes from.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Lod {
    /// Derivatives of the coordinates.
    Derivatives,
    /// These, and a bias: the same for all fragments or, if `None`, in the record.
    Bias(Option<f32>),
    /// The instruction names it, likewise.
    Explicit(Option<f32>),
    /// Derivatives that the instruction names; they are in the record.
    Gradients,
}

/// Form of a site's records.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Form {
    /// One for the lanes of a quad that are active together.
    Quad,
    /// One per fragment, with a third coordinate, a level and its own derivatives.
    Fragment,
}

/// Record of a site.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum What {
    /// An access of a texture.
    Texture(TextureSite),
    /// A fragment that starts, with its depth as coordinate u.
    Coverage,
    /// A fragment that ends without having been discarded.
    Survival,
    /// An access that no trace can hold, by its name.
    LeftOut(String),
}

/// An access of a texture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TextureSite {
    /// The operation.
    pub access: Access,
    /// Shape of the texture.
    pub shape: Shape,
    /// The image.
    pub image: Binding,
    /// The sampler, if any: the image's own binding where both are one.
    pub sampler: Option<Binding>,
    /// Where the level comes from.
    pub lod: Lod,
    /// Texel offset.
    pub offset: [i8; 2],
}

/// A place in a shader that records.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Site {
    /// Its record.
    pub what: What,
    /// Form of its records.
    pub form: Form,
    /// Coordinate group, which sites with the same coordinates in the same lanes share.
    pub group: u16,
    /// Every fragment comes by, before any is discarded.
    pub unconditional: bool,
}
