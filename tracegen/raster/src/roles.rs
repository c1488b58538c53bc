//! Roles of a draw in each render pass, and the keys of their pipelines.

use crate::backend::Fragments;
use crate::backend::RecordRequest;
use crate::draws::{DrawCall, DrawMode};
use crate::groups::MaterialGroups;
use scene::Material;

/// Role of a draw in a render pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Role {
    /// Colour and depth with forced early depth test.
    Opaque,
    /// Colour blended over earlier draws; depth tested early, not written.
    Blended,
    /// Colour and late depth of an alpha-masked draw.
    Masked,
    /// Records of an alpha-masked draw; writes neither colour nor depth.
    MaskedRecord,
    /// Records and early depth of an opaque draw.
    OpaqueRecord,
    /// Records of fragments in front of the stored depth. Writes no depth.
    Record,
    /// Depth of a shadow caster.
    Shadow,
    /// Depth of an alpha-masked shadow caster.
    ShadowMasked,
    /// Additive count of the fragments of an opaque draw.
    Count,
    /// Additive count of the fragments of a blended draw.
    CountBlended,
    /// Only depth.
    Depth,
    /// Only depth of an alpha-masked draw.
    DepthMasked,
    /// Marks the draw if a fragment is not farther than the stored depth.
    Mark,
    /// Like `Mark`, for an alpha-masked draw.
    MarkMasked,
    /// Records the samples of one texture of the material, and the primitive.
    Texel,
    /// Like `Texel`, for an alpha-masked draw.
    TexelMasked,
}

impl Role {
    /// The shader's fragment entry point, unless only depth is written.
    pub fn fragment_entry_point(self) -> Option<&'static str> {
        match self {
            Self::Opaque | Self::Blended => Some("fragment_early"),
            Self::Masked => Some("fragment_masked"),
            Self::MaskedRecord => Some("fragment_masked_record"),
            Self::Record | Self::OpaqueRecord => Some("fragment_record"),
            Self::Shadow | Self::Depth => None,
            Self::ShadowMasked | Self::DepthMasked => Some("fragment_shadow"),
            Self::Mark => Some("fragment_mark"),
            Self::MarkMasked => Some("fragment_mark_masked"),
            Self::Count | Self::CountBlended => Some("fragment_count"),
            Self::Texel => Some("fragment_texel"),
            Self::TexelMasked => Some("fragment_texel_masked"),
        }
    }

    /// Whether it renders into a shadow map.
    pub fn casts(self) -> bool {
        matches!(self, Self::Shadow | Self::ShadowMasked)
    }

    /// Whether it never has a colour attachment.
    fn colorless(self) -> bool {
        let alone = [Self::Depth, Self::DepthMasked, Self::Mark, Self::MarkMasked];
        self.casts() || alone.contains(&self)
    }

    /// Whether it leaves colour unchanged, if there is any.
    pub fn keeps_color(self) -> bool {
        self == Self::MaskedRecord
    }

    /// Whether it writes texels and primitives instead of the picture.
    pub fn writes_texels(self) -> bool {
        matches!(self, Self::Texel | Self::TexelMasked)
    }

    /// Whether it marks draws. Fragments at the stored depth count as well.
    pub fn marks(self) -> bool {
        matches!(self, Self::Mark | Self::MarkMasked)
    }

    /// Whether neither texture nor vertex colour affects its result.
    fn is_plain(self) -> bool {
        matches!(
            self,
            Self::Record | Self::OpaqueRecord | Self::Shadow | Self::Depth | Self::Mark
        )
    }

    /// Whether depth is tested and not written.
    pub fn keeps_depth(self) -> bool {
        matches!(
            self,
            Self::Blended
                | Self::Record
                | Self::MaskedRecord
                | Self::CountBlended
                | Self::Mark
                | Self::MarkMasked
        )
    }
}

/// Purpose of a render pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// Only the picture.
    Plain,
    /// The picture and the records.
    Capture,
    /// The records of fragments that pass the depth test when drawn, and depth, without a picture.
    Trace,
    /// Only the records of fragments in front of the layer's initial depth.
    Record,
    /// A shadow map.
    Shadow,
    /// The additive count of fragments.
    Count,
    /// Depth, for occlusion culling and for marks.
    Depth,
    /// Visibility marks of draws.
    Mark,
    /// Samples of one texture slot of the materials by visible fragments.
    Texel,
}

impl Purpose {
    /// The render passes over a region, in order.
    pub fn of(recording: Option<&RecordRequest<'_, '_>>) -> &'static [Self] {
        match recording.map(|recording| (recording.fragments, recording.picture)) {
            None => &[Self::Plain],
            Some((Fragments::DepthTested, true)) => &[Self::Capture],
            Some((Fragments::DepthTested, false)) => &[Self::Trace],
            // All fragments are recorded before any draw writes depth.
            Some((Fragments::All, true)) => &[Self::Record, Self::Plain],
            Some((Fragments::All, false)) => &[Self::Record],
        }
    }

    /// Whether a picture is drawn. A render pass without one has no colour attachment, because
    /// llvmpipe would load, convert and store the colour of every pixel even if draws do not change
    /// it.
    pub fn has_picture(self) -> bool {
        matches!(self, Self::Plain | Self::Capture)
    }
}

/// Roles of a draw, in order.
pub fn roles(mode: DrawMode, purpose: Purpose) -> &'static [Role] {
    match (mode, purpose) {
        (DrawMode::Opaque, Purpose::Plain | Purpose::Capture) => &[Role::Opaque],
        (DrawMode::Blended, Purpose::Plain | Purpose::Capture) => &[Role::Blended],
        (DrawMode::Masked, Purpose::Plain) => &[Role::Masked],
        (DrawMode::Masked, Purpose::Capture) => &[Role::MaskedRecord, Role::Masked],
        (DrawMode::Opaque, Purpose::Trace) => &[Role::OpaqueRecord],
        (DrawMode::Masked, Purpose::Trace) => &[Role::MaskedRecord, Role::DepthMasked],
        (DrawMode::Blended, Purpose::Trace) | (_, Purpose::Record) => &[Role::Record],
        (DrawMode::Opaque, Purpose::Shadow) => &[Role::Shadow],
        (DrawMode::Masked, Purpose::Shadow) => &[Role::ShadowMasked],
        (DrawMode::Opaque, Purpose::Count) => &[Role::Count],
        (DrawMode::Blended, Purpose::Count) => &[Role::CountBlended],
        (DrawMode::Opaque, Purpose::Depth) => &[Role::Depth],
        (DrawMode::Masked, Purpose::Depth) => &[Role::DepthMasked],
        (DrawMode::Opaque | DrawMode::Blended, Purpose::Mark) => &[Role::Mark],
        (DrawMode::Masked, Purpose::Mark) => &[Role::MarkMasked],
        (DrawMode::Opaque, Purpose::Texel) => &[Role::Texel],
        (DrawMode::Masked, Purpose::Texel) => &[Role::TexelMasked],
        // Blended draws cast no shadow and write no depth. Alpha tests cannot be counted without
        // the alpha-test replay.
        (DrawMode::Blended, Purpose::Shadow | Purpose::Depth | Purpose::Texel)
        | (DrawMode::Masked, Purpose::Count) => &[],
    }
}

/// Draw state of a material.
#[derive(Clone, Copy, Debug)]
pub struct MaterialState {
    double_sided: bool,
    textures: u32,
    leaders: u32,
}

impl MaterialState {
    /// The state of a material with its groups of textures.
    pub fn new(material: &Material, groups: &MaterialGroups) -> Self {
        Self {
            double_sided: material.double_sided,
            textures: groups.present,
            leaders: groups.leaders,
        }
    }
}

/// Key of a pipeline.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct PipelineKey {
    /// Role of the draw.
    pub role: Role,
    /// Records are written.
    pub capture: bool,
    /// True without a colour attachment.
    pub colorless: bool,
    /// One bit per texture.
    pub textures: u32,
    /// One bit per texture that is the first of its uv group.
    pub leaders: u32,
    /// Shadow cascades.
    pub cascades: u32,
    /// Vertices have colours.
    pub colored: bool,
    /// Both faces are drawn.
    pub double_sided: bool,
    /// Front faces wind clockwise.
    pub mirrored: bool,
}

impl PipelineKey {
    /// Values of the shader's overrides.
    pub fn constants(&self) -> [(&'static str, f64); 7] {
        let flag = |set: bool| f64::from(u8::from(set));
        [
            ("CAPTURE", flag(self.capture)),
            ("TEXTURES", f64::from(self.textures)),
            ("LEADERS", f64::from(self.leaders)),
            ("CASCADES", f64::from(self.cascades)),
            ("COLORED", flag(self.colored)),
            ("BLENDED", flag(self.role == Role::Blended)),
            ("MASKED", flag(self.role == Role::Masked)),
        ]
    }

    /// The key of the pipeline for `role` of `call` in a frame with `cascades`.
    pub fn new(
        call: &DrawCall,
        material: &MaterialState,
        role: Role,
        purpose: Purpose,
        cascades: u32,
    ) -> Self {
        // The second role of a masked draw records nothing.
        let records = matches!(purpose, Purpose::Capture | Purpose::Trace | Purpose::Record);
        let capture = records && !matches!(role, Role::Masked | Role::DepthMasked);
        let lit = capture || role == Role::Masked || purpose == Purpose::Plain;
        Self {
            role,
            capture,
            colorless: role.colorless() || matches!(purpose, Purpose::Trace | Purpose::Record),
            textures: if role.is_plain() {
                0
            } else {
                material.textures
            },
            leaders: if capture { material.leaders } else { 0 },
            cascades: if lit { cascades } else { 0 },
            colored: !role.is_plain() && call.colored,
            // Shadow maps hold both faces: walls that are modelled from one side block light.
            double_sided: role.casts() || material.double_sided,
            mirrored: !role.casts() && call.mirrored,
        }
    }
}
