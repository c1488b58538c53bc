//! The tables of a trace as chunks: META (JSON), TEXS, SMPS, DRAW, PASS (binary), in every version.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::{
    Draw, LodRule, Pass, PassKind, Sample, SampleLevel, TILE_INDEX, TILES, Tables, TraceMeta,
    UvGroup,
};
use crate::container::{
    ChunkTag, Container, ContainerWriter, MAJOR_1, MAJOR_2, MAJOR_3, major_of_tables,
};
use crate::error::{Broken, Result, ensure};
use crate::json;
use crate::parse::Taken;
use crate::records::{Codec, Record, parse_table, write_table};
use crate::texture::{
    ColorSpace, Filter, LodRange, MipFilter, Part, Sampler, TexelFormat, Texture, Wrap,
};
use crate::view::{Eye, TILE_SIZE_PX};
use std::collections::BTreeSet;
use std::fmt::Display;
use std::io::{Seek, Write};

/// JSON of [`TraceMeta`].
pub const META: ChunkTag = ChunkTag(*b"META");
/// Texture table.
pub const TEXTURES: ChunkTag = ChunkTag(*b"TEXS");
/// Sampler table.
pub const SAMPLERS: ChunkTag = ChunkTag(*b"SMPS");
/// Draw table.
pub const DRAWS: ChunkTag = ChunkTag(*b"DRAW");
/// Pass table.
pub const PASSES: ChunkTag = ChunkTag(*b"PASS");

/// Maximum number of groups per draw; the next number means "no group".
pub const MAX_GROUPS: usize = super::NO_GROUP as usize;
/// Largest width and height of a texture in texels.
pub const MAX_TEXTURE_SIZE: u32 = 1 << 16;
/// Maximum number of array layers of a texture.
pub const MAX_LAYERS: u32 = 1 << 16;
/// Minor version that introduced layers.
const LAYERS_MINOR: u16 = 1;
/// Number for "both eyes" in a pass.
const NO_EYE: u8 = 255;
/// Index for "no texture" in a texture that is no part.
const NO_PART: u32 = u32::MAX;

/// The earliest major version that has all features of the tables: 1 has the tables before the tiles; 2 has them
/// after the tiles, with the levels of detail, formats and wrap modes of programs; 3 also has the anisotropy of
/// samplers, and textures that share memory.
pub(super) fn major_of(tables: &Tables) -> u16 {
    if tables.need_version_3() {
        MAJOR_3
    } else if tables.need_version_2() {
        MAJOR_2
    } else {
        MAJOR_1
    }
}

/// Checks and writes the table chunks.
pub(super) fn write<W: Write + Seek>(
    major: u16,
    tables: &Tables,
    container: &mut ContainerWriter<W>,
) -> Result<()> {
    check_writable(tables)?;
    container.require_major(major);
    if major == MAJOR_1 && has_layers(tables) {
        container.require_minor(LAYERS_MINOR);
    }
    container.chunk(META, &json::write("trace description", &tables.meta)?)?;
    container.chunk(TEXTURES, &write_table(major, &tables.textures)?)?;
    container.chunk(SAMPLERS, &write_table(major, &tables.samplers)?)?;
    container.chunk(DRAWS, &write_table(major, &tables.draws)?)?;
    container.chunk(PASSES, &write_table(major, &tables.passes)?)
}

/// Checks tables before the work that precedes writing them.
pub(super) fn check_writable(tables: &Tables) -> Result<()> {
    check(tables).map_err(|(_, broken)| broken.unwritable())
}

/// Reads and checks the table chunks.
pub(super) fn read(container: &Container) -> Result<Tables> {
    let version = container.version().0;
    let major = major_of_tables(version);
    container.expect_order(&match major {
        MAJOR_1 => [META, TEXTURES, SAMPLERS, DRAWS, PASSES, TILES, TILE_INDEX],
        _ => [TILES, TILE_INDEX, META, TEXTURES, SAMPLERS, DRAWS, PASSES],
    })?;
    fn table<T: Record>(
        container: &Container,
        tag: ChunkTag,
        what: &'static str,
    ) -> Result<Vec<T>> {
        let major = major_of_tables(container.version().0);
        container.parse_chunk(tag, |input| parse_table(major, what, input))
    }
    let tables = Tables {
        meta: json::read(container, META, "a trace's description")?,
        textures: table(container, TEXTURES, "texture count")?,
        samplers: table(container, SAMPLERS, "sampler count")?,
        draws: table(container, DRAWS, "draw count")?,
        passes: table(container, PASSES, "pass count")?,
    };
    check(&tables).map_err(|(chunk, broken)| container.broken(chunk, 0, broken))?;
    if version == MAJOR_1 && has_layers(&tables) {
        container.expect_minor(LAYERS_MINOR, PASSES, "passes that are layers")?;
    }
    Ok(tables)
}

fn has_layers(tables: &Tables) -> bool {
    (tables.passes.iter()).any(|pass| pass.kind == PassKind::Layer)
}

/// Checks each table and the references between them; the error names the chunk.
fn check(tables: &Tables) -> Result<(), (ChunkTag, Broken)> {
    let located = |chunk: ChunkTag| move |broken: Broken| (chunk, broken);
    tables.meta.check().map_err(located(META))?;
    if let Some(surfaces) = &tables.meta.surfaces {
        surfaces.check(tables.draws.len()).map_err(located(META))?;
    }
    for (index, texture) in tables.textures.iter().enumerate() {
        check_texture(tables, index, texture).map_err(located(TEXTURES))?;
    }
    for (index, sampler) in tables.samplers.iter().enumerate() {
        check_sampler(index, sampler).map_err(located(SAMPLERS))?;
    }
    for (index, draw) in tables.draws.iter().enumerate() {
        check_draw(tables, index, draw).map_err(located(DRAWS))?;
    }
    let mut layers = BTreeSet::new();
    for (index, pass) in tables.passes.iter().enumerate() {
        check_pass(&tables.meta, index, pass).map_err(located(PASSES))?;
        let key = (pass.frame, pass.eye.map(|eye| eye as u8), pass.layer);
        let is_new = pass.kind != PassKind::Layer || layers.insert(key);
        let expected = "a layer number that no other layer of its frame and eye has";
        ensure(is_new, format_args!("pass {index}"), expected, pass.layer)
            .map_err(located(PASSES))?;
    }
    Ok(())
}

fn check_texture(tables: &Tables, index: usize, texture: &Texture) -> Result<(), Broken> {
    let what = format_args!("texture {index} ({})", texture.name);
    let [width, height] = texture.size;
    let sizes = 1..=MAX_TEXTURE_SIZE;
    ensure(
        sizes.contains(&width) && sizes.contains(&height),
        what,
        format_args!("a size of 1 to {MAX_TEXTURE_SIZE} texels"),
        format_args!("{width}x{height}"),
    )?;
    let most = width.max(height).ilog2() + 1;
    ensure(
        (1..=most).contains(&texture.levels),
        what,
        format_args!("1 to {most} mip levels"),
        texture.levels,
    )?;
    ensure(
        (1..=MAX_LAYERS).contains(&texture.layers),
        what,
        format_args!("1 to {MAX_LAYERS} layers"),
        texture.layers,
    )?;
    let Some(part) = texture.part else {
        return Ok(());
    };
    let Part { of, level, layer } = part;
    let whole = tables.textures.get(of as usize);
    ensure(
        whole.is_some_and(|whole| texture.fits(part, whole)),
        what,
        "a texture that is no part, with the part's levels and layers in blocks of the same kind",
        format_args!("level {level}, layer {layer} of texture {of}"),
    )
}

fn check_sampler(index: usize, sampler: &Sampler) -> Result<(), Broken> {
    let range = Sampler::ISOTROPIC..=Sampler::MOST_ANISOTROPIC;
    ensure(
        range.contains(&sampler.max_anisotropy_256ths),
        format_args!("sampler {index}"),
        "a maximum anisotropy of 256 to 4096 (1/256)",
        sampler.max_anisotropy_256ths,
    )
}

fn check_draw(tables: &Tables, index: usize, draw: &Draw) -> Result<(), Broken> {
    let what = format_args!("draw {index} ({})", draw.material);
    ensure(
        draw.first_primitive.checked_add(draw.primitives).is_some(),
        what,
        "primitive numbers below 2^32",
        format_args!("{} + {}", draw.first_primitive, draw.primitives),
    )?;
    ensure(
        draw.groups.len() <= MAX_GROUPS,
        what,
        format_args!("at most {MAX_GROUPS} uv groups"),
        draw.groups.len(),
    )?;
    let mut before: Option<&UvGroup> = None;
    for (number, group) in draw.groups.iter().enumerate() {
        let what = format_args!("{what} group {number}");
        ensure(
            (group.extent.iter()).all(|extent| (1..=MAX_TEXTURE_SIZE).contains(extent)),
            what,
            format_args!("an extent of 1 to {MAX_TEXTURE_SIZE} texels"),
            format_args!("{:?}", group.extent),
        )?;
        for sample in &group.samples {
            check_sample(tables, what, sample)?;
        }
        ensure(
            !group.has_operands()
                || before.is_some_and(|g| g.samples.is_empty() && g.extent == [1, 1]),
            what,
            "a group of extent 1x1 without samples before it, for its operands",
            "another one or none",
        )?;
        before = Some(group);
    }
    Ok(())
}

fn check_sample(tables: &Tables, what: impl Display, sample: &Sample) -> Result<(), Broken> {
    let Some(texture) = tables.textures.get(sample.texture as usize) else {
        let expected = format!("a texture below {}", tables.textures.len());
        return Err(Broken::new(what.to_string(), expected, sample.texture));
    };
    let samplers = tables.samplers.len();
    ensure(
        usize::from(sample.sampler) < samplers,
        &what,
        format_args!("a sampler below {samplers}"),
        sample.sampler,
    )?;
    ensure(
        u32::from(sample.layer) < texture.layers,
        &what,
        format_args!("a layer below {}", texture.layers),
        sample.layer,
    )?;
    let level = sample.level;
    ensure(
        level.rule != LodRule::Derivatives || level.lod_256ths == 0,
        &what,
        "a level of 0 where the derivatives decide",
        level.lod_256ths,
    )
}

fn check_pass(meta: &TraceMeta, index: usize, pass: &Pass) -> Result<(), Broken> {
    let what = format_args!("pass {index}");
    let Pass { size_px, kind, .. } = *pass;
    let tiles = size_px.map(|size| size.div_ceil(TILE_SIZE_PX));
    ensure(
        pass.tiles == tiles && !pass.tiles.contains(&0),
        what,
        format_args!("{tiles:?} tiles of {TILE_SIZE_PX} px for {size_px:?} px, at least one"),
        format_args!("{:?}", pass.tiles),
    )?;
    ensure(
        meta.frames.iter().any(|views| views.frame == pass.frame),
        what,
        "a frame of the description",
        pass.frame,
    )?;
    ensure(
        kind == PassKind::Layer || pass.layer == 0,
        what,
        "layer 0 of a pass that is no layer",
        pass.layer,
    )?;
    let eye_size_px = meta.hmd.eye_size_px;
    ensure(
        kind != PassKind::Main || pass.eye.is_none() || size_px == eye_size_px,
        what,
        format_args!("the size of an eye's image, {eye_size_px:?} px"),
        format_args!("{size_px:?}"),
    )
}

macro_rules! ids {
    ($number:ident $type:ident: $($value:ident),+) => {
        &[$(($type::$value as $number, $type::$value)),+]
    };
}

const FORMATS: &[(u16, TexelFormat)] = ids!(u16 TexelFormat: Bc1, Bc3, Bc7, Etc2, Etc2Rgba,
    Astc4x4, Astc5x5, Astc6x6, Astc8x8, Rgba8, R32f);
const FORMATS_V2: &[(u16, TexelFormat)] = ids!(u16 TexelFormat: Bc1, Bc2, Bc3, Bc4, Bc5, Bc6h, Bc7,
    Etc2, Etc2Rgba, EacR11, EacRg11, Astc4x4, Astc5x5, Astc6x6, Astc8x8, Rgba8, R32f, R8, Rg8, Packed16,
    R16, Rg16, Rgba16, Rg32, Rgba32, Packed32, D16);
const COLOR_SPACES: &[(u8, ColorSpace)] = ids!(u8 ColorSpace: Linear, Srgb);
const WRAPS: &[(u8, Wrap)] = ids!(u8 Wrap: Repeat, MirroredRepeat, ClampToEdge);
const WRAPS_V2: &[(u8, Wrap)] =
    ids!(u8 Wrap: Repeat, MirroredRepeat, ClampToEdge, ClampToBorder, MirrorClampToEdge);
const LOD_RULES: &[(u8, LodRule)] = ids!(u8 LodRule: Derivatives, Bias, Explicit);
const FILTERS: &[(u8, Filter)] = ids!(u8 Filter: Nearest, Linear);
const MIP_FILTERS: &[(u8, MipFilter)] = ids!(u8 MipFilter: None, Nearest, Linear);
const PASS_KINDS: &[(u8, PassKind)] = ids!(u8 PassKind: Main, Shadow, Layer);
const EYES: &[(u8, Option<Eye>)] = &[(0, Some(Eye::Left)), (1, Some(Eye::Right)), (NO_EYE, None)];

impl Tables {
    /// Whether the tables have features that version 2 lacks.
    pub fn need_version_3(&self) -> bool {
        self.samplers.iter().any(Sampler::is_anisotropic)
            || self.textures.iter().any(|t| t.part.is_some())
    }

    /// Whether the tables have features that version 1 lacks.
    pub fn need_version_2(&self) -> bool {
        let has_format = |t: &Texture| FORMATS.iter().any(|(_, format)| *format == t.format);
        let has_wrap = |wrap: &Wrap| WRAPS.iter().any(|(_, known)| known == wrap);
        let has_sampler = |s: &Sampler| s.wrap.iter().all(has_wrap) && s.lod.is_whole();
        self.meta.program.is_some()
            || self.need_version_3()
            || !self.textures.iter().all(has_format)
            || !self.samplers.iter().all(has_sampler)
            || (self.draws.iter().flat_map(|draw| &draw.groups))
                .flat_map(|group| &group.samples)
                .any(|sample| !sample.level.is_default())
    }
}

impl Record for Texture {
    fn fields<'a>(&mut self, codec: &mut Codec<'a>) -> Taken<'a> {
        let formats = match codec.major {
            MAJOR_1 => FORMATS,
            _ => FORMATS_V2,
        };
        codec.record = "a texture with a name";
        codec.number(&mut self.size)?;
        codec.number(&mut self.levels)?;
        codec.number(&mut self.layers)?;
        codec.id("a texel format", formats, &mut self.format)?;
        codec.id("a colour space", COLOR_SPACES, &mut self.color_space)?;
        codec.reserved::<1>()?;
        if codec.major >= MAJOR_3 {
            let place = |Part { of, level, layer }| [of, level, layer];
            let mut part = self.part.map_or([NO_PART, 0, 0], place);
            codec.named("a part of 12 bytes", &mut part)?;
            let [of, level, layer] = part;
            let is_sound = of != NO_PART || level | layer == 0;
            codec.check(
                is_sound,
                "zeros in a texture that is no part",
                level | layer,
            )?;
            self.part = (of != NO_PART).then_some(Part { of, level, layer });
        }
        codec.name(&mut self.name)
    }
}

impl Record for Sampler {
    fn fields<'a>(&mut self, codec: &mut Codec<'a>) -> Taken<'a> {
        let wraps = match codec.major {
            MAJOR_1 => WRAPS,
            _ => WRAPS_V2,
        };
        for wrap in &mut self.wrap {
            codec.id("a wrap mode", wraps, wrap)?;
        }
        codec.id("a filter", FILTERS, &mut self.mag)?;
        codec.id("a filter", FILTERS, &mut self.min)?;
        codec.id("a mip filter", MIP_FILTERS, &mut self.mip)?;
        if codec.major >= MAJOR_2 {
            codec.record = "bias and bounds of a level of detail";
            let LodRange {
                bias_256ths,
                min_256ths,
                max_256ths,
            } = &mut self.lod;
            codec.number(bias_256ths)?;
            codec.number(min_256ths)?;
            codec.number(max_256ths)?;
        }
        if codec.major >= MAJOR_3 {
            codec.named("a maximum anisotropy", &mut self.max_anisotropy_256ths)?;
        }
        Ok(())
    }
}

impl Record for Draw {
    fn fields<'a>(&mut self, codec: &mut Codec<'a>) -> Taken<'a> {
        codec.record = "a draw of 12 bytes, a name and groups";
        codec.number(&mut self.first_primitive)?;
        codec.number(&mut self.primitives)?;
        let groups = codec.length("draw groups", self.groups.len())?;
        codec.name(&mut self.material)?;
        codec.items(groups, &mut self.groups)
    }
}

impl Record for UvGroup {
    fn fields<'a>(&mut self, codec: &mut Codec<'a>) -> Taken<'a> {
        codec.record = "a uv group of 10 bytes and samples";
        codec.number(&mut self.extent)?;
        let samples = codec.length("group samples", self.samples.len())?;
        codec.items(samples, &mut self.samples)
    }
}

impl Record for Sample {
    fn fields<'a>(&mut self, codec: &mut Codec<'a>) -> Taken<'a> {
        codec.record = "a sample of 10 bytes";
        codec.number(&mut self.texture)?;
        codec.number(&mut self.sampler)?;
        codec.number(&mut self.layer)?;
        codec.number(&mut self.offset)?;
        if codec.major >= MAJOR_2 {
            codec.record = "a sample of 14 bytes";
            let SampleLevel {
                rule,
                lod_256ths,
                operands,
            } = &mut self.level;
            codec.id("a rule of levels of detail", LOD_RULES, rule)?;
            codec.id("0 or 1 for operands", &[(0u8, false), (1, true)], operands)?;
            codec.number(lod_256ths)?;
        }
        Ok(())
    }
}

impl Record for Pass {
    fn fields<'a>(&mut self, codec: &mut Codec<'a>) -> Taken<'a> {
        codec.record = "a pass of 24 bytes";
        codec.number(&mut self.frame)?;
        codec.id("a pass kind", PASS_KINDS, &mut self.kind)?;
        codec.id("an eye (0, 1 or 255)", EYES, &mut self.eye)?;
        codec.number(&mut self.layer)?;
        codec.number(&mut self.size_px)?;
        codec.number(&mut self.tiles)
    }
}
