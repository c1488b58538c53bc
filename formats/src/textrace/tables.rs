//! The tables of a trace as chunks: META (JSON), TEXS, SMPS, DRAW, PASS (binary), in every version.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::{
    Draw, LodRule, Pass, PassKind, Sample, SampleLevel, TILE_INDEX, TILES, Tables, TraceMeta,
    UvGroup,
};
use crate::container::{ChunkTag, Container, ContainerWriter, MAJOR_1, MAJOR_2, MAJOR_3};
use crate::error::{Broken, FormatError, Result, ensure};
use crate::json;
use crate::parse::{self, Fault, Parsed, zero};
use crate::texture::{
    ColorSpace, Filter, LodRange, MipFilter, Part, Sampler, TexelFormat, Texture, Wrap,
};
use crate::view::{Eye, TILE_SIZE_PX};
use nom::Parser;
use nom::bytes::complete::take;
use nom::error::context;
use nom::multi::count;
use nom::number::complete::{i8, le_i16, le_u16, le_u32, u8};
use std::collections::BTreeSet;
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

/// Bytes of a texture without its name.
pub const TEXTURE_BYTES: usize = 22;
/// Bytes of a sampler.
pub const SAMPLER_BYTES: usize = 5;
/// Bytes of a draw without its name and groups.
pub const DRAW_BYTES: usize = 12;
/// Bytes of a uv group without its samples.
pub const GROUP_BYTES: usize = 10;
/// Bytes of a sample.
pub const SAMPLE_BYTES: usize = 10;
/// Bytes of a sampler in version 2.
pub const SAMPLER_BYTES_V2: usize = 11;
/// Bytes of a sample in version 2.
pub const SAMPLE_BYTES_V2: usize = 14;
/// Bytes of a texture in version 3 without its name.
pub const TEXTURE_BYTES_V3: usize = 34;
/// Bytes of a sampler in version 3.
pub const SAMPLER_BYTES_V3: usize = 13;
/// Bytes of a pass.
pub const PASS_BYTES: usize = 24;

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

/// Version of the tables' layout.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Version {
    /// Tables before the tiles.
    One,
    /// Tables after the tiles, with the levels of detail, formats and wrap modes of programs.
    Two,
    /// Also the anisotropy of samplers, and textures that share memory.
    Three,
}

impl Version {
    /// The version that complete tables need.
    pub(super) fn of(tables: &Tables) -> Self {
        if tables.need_version_3() {
            Self::Three
        } else if tables.need_version_2() {
            Self::Two
        } else {
            Self::One
        }
    }

    pub(super) fn major(self) -> u16 {
        match self {
            Self::One => MAJOR_1,
            Self::Two => MAJOR_2,
            Self::Three => MAJOR_3,
        }
    }
}

/// Checks and writes the table chunks.
pub(super) fn write<W: Write + Seek>(
    version: Version,
    tables: &Tables,
    container: &mut ContainerWriter<W>,
) -> Result<()> {
    check_writable(tables)?;
    container.require_major(version.major());
    if version == Version::One && has_layers(tables) {
        container.require_minor(LAYERS_MINOR);
    }
    container.chunk(META, &json::write("trace description", &tables.meta)?)?;
    let texture = |t: &Texture, bytes: &mut Vec<u8>| write_texture(version, t, bytes);
    container.chunk(TEXTURES, &table(&tables.textures, texture)?)?;
    let sampler = |s: &Sampler, bytes: &mut Vec<u8>| write_sampler(version, s, bytes);
    container.chunk(SAMPLERS, &table(&tables.samplers, sampler)?)?;
    let draw = |d: &Draw, bytes: &mut Vec<u8>| write_draw(version, d, bytes);
    container.chunk(DRAWS, &table(&tables.draws, draw)?)?;
    container.chunk(PASSES, &table(&tables.passes, write_pass)?)
}

/// Checks tables before the work that precedes writing them.
pub(super) fn check_writable(tables: &Tables) -> Result<()> {
    check(tables).map_err(|(_, broken)| broken.unwritable())
}

/// Reads and checks the table chunks.
pub(super) fn read(container: &Container) -> Result<Tables> {
    let version = match container.version().0 {
        MAJOR_3 => Version::Three,
        MAJOR_2 => Version::Two,
        _ => Version::One,
    };
    container.expect_order(&match version {
        Version::One => [META, TEXTURES, SAMPLERS, DRAWS, PASSES, TILES, TILE_INDEX],
        _ => [TILES, TILE_INDEX, META, TEXTURES, SAMPLERS, DRAWS, PASSES],
    })?;
    let (texture_bytes, sampler_bytes) = match version {
        Version::One => (TEXTURE_BYTES, SAMPLER_BYTES),
        Version::Two => (TEXTURE_BYTES, SAMPLER_BYTES_V2),
        Version::Three => (TEXTURE_BYTES_V3, SAMPLER_BYTES_V3),
    };
    let tables = Tables {
        meta: json::read(container, META, "a trace's description")?,
        textures: container.parse_chunk(TEXTURES, |input| {
            let texture = |input| read_texture(version, input);
            read_table("texture count", texture_bytes, texture, input)
        })?,
        samplers: container.parse_chunk(SAMPLERS, |input| {
            let sampler = |input| read_sampler(version, input);
            read_table("sampler count", sampler_bytes, sampler, input)
        })?,
        draws: container.parse_chunk(DRAWS, |input| {
            let draw = |input| read_draw(version, input);
            read_table("draw count", DRAW_BYTES, draw, input)
        })?,
        passes: container.parse_chunk(PASSES, |input| {
            read_table("pass count", PASS_BYTES, read_pass, input)
        })?,
    };
    check(&tables).map_err(|(chunk, broken)| {
        let expected = format!("{}: {}", broken.what, broken.expected);
        container.malformed(chunk, 0, expected, broken.found)
    })?;
    let (major, minor) = container.version();
    if version == Version::One && has_layers(&tables) && minor < LAYERS_MINOR {
        let expected = format!("version {major}.{LAYERS_MINOR} for passes that are layers");
        return Err(container.malformed(PASSES, 0, expected, format!("{major}.{minor}")));
    }
    Ok(tables)
}

fn has_layers(tables: &Tables) -> bool {
    (tables.passes.iter()).any(|pass| pass.kind == PassKind::Layer)
}

/// Checks each table and the references between them; the error names the chunk.
fn check(tables: &Tables) -> std::result::Result<(), (ChunkTag, Broken)> {
    let located = |chunk: ChunkTag| move |broken: Broken| (chunk, broken);
    tables.meta.check().map_err(located(META))?;
    if let Some(surfaces) = &tables.meta.surfaces {
        surfaces.check(tables.draws.len()).map_err(located(META))?;
    }
    for (index, texture) in tables.textures.iter().enumerate() {
        check_texture(index, texture).map_err(located(TEXTURES))?;
        check_part(tables, index, texture).map_err(located(TEXTURES))?;
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
        ensure(is_new, || {
            Broken::new(
                format!("pass {index}"),
                "a layer number that no other layer of its frame and eye has",
                pass.layer,
            )
        })
        .map_err(located(PASSES))?;
    }
    Ok(())
}

fn check_texture(index: usize, texture: &Texture) -> std::result::Result<(), Broken> {
    let what = || format!("texture {index} ({})", texture.name);
    let [width, height] = texture.size;
    ensure(
        texture
            .size
            .iter()
            .all(|size| (1..=MAX_TEXTURE_SIZE).contains(size)),
        || {
            Broken::new(
                what(),
                format!("a size of 1 to {MAX_TEXTURE_SIZE} texels"),
                format_args!("{width}x{height}"),
            )
        },
    )?;
    let most = width.max(height).ilog2() + 1;
    ensure((1..=most).contains(&texture.levels), || {
        Broken::new(what(), format!("1 to {most} mip levels"), texture.levels)
    })?;
    ensure((1..=MAX_LAYERS).contains(&texture.layers), || {
        Broken::new(what(), format!("1 to {MAX_LAYERS} layers"), texture.layers)
    })
}

fn check_part(tables: &Tables, index: usize, texture: &Texture) -> std::result::Result<(), Broken> {
    let Some(part) = texture.part else {
        return Ok(());
    };
    let whole = usize::try_from(part.of)
        .ok()
        .and_then(|of| tables.textures.get(of));
    ensure(whole.is_some_and(|whole| texture.fits(part, whole)), || {
        Broken::new(
            format!("texture {index} ({})", texture.name),
            "a texture that is no part, with the part's levels and layers in blocks of the same kind",
            format_args!(
                "level {}, layer {} of texture {}",
                part.level, part.layer, part.of
            ),
        )
    })
}

fn check_sampler(index: usize, sampler: &Sampler) -> std::result::Result<(), Broken> {
    let range = Sampler::ISOTROPIC..=Sampler::MOST_ANISOTROPIC;
    ensure(range.contains(&sampler.max_anisotropy_256ths), || {
        Broken::new(
            format!("sampler {index}"),
            "a maximum anisotropy of 256 to 4096 (1/256)",
            sampler.max_anisotropy_256ths,
        )
    })
}

fn check_draw(tables: &Tables, index: usize, draw: &Draw) -> std::result::Result<(), Broken> {
    let what = || format!("draw {index} ({})", draw.material);
    ensure(
        draw.first_primitive.checked_add(draw.primitives).is_some(),
        || {
            Broken::new(
                what(),
                "primitive numbers below 2^32",
                format_args!("{} + {}", draw.first_primitive, draw.primitives),
            )
        },
    )?;
    ensure(draw.groups.len() <= MAX_GROUPS, || {
        Broken::new(
            what(),
            format!("at most {MAX_GROUPS} uv groups"),
            draw.groups.len(),
        )
    })?;
    for (number, group) in draw.groups.iter().enumerate() {
        let what = || format!("{} group {number}", what());
        ensure(
            group
                .extent
                .iter()
                .all(|extent| (1..=MAX_TEXTURE_SIZE).contains(extent)),
            || {
                Broken::new(
                    what(),
                    format!("an extent of 1 to {MAX_TEXTURE_SIZE} texels"),
                    format_args!("{:?}", group.extent),
                )
            },
        )?;
        for sample in &group.samples {
            check_sample(tables, &what, sample)?;
        }
        if group.has_operands() {
            let before = number.checked_sub(1).and_then(|n| draw.groups.get(n));
            let holds = before.is_some_and(|g| g.samples.is_empty() && g.extent == [1, 1]);
            ensure(holds, || {
                let expected = "a group of extent 1x1 without samples before it, for its operands";
                Broken::new(what(), expected, "another one or none")
            })?;
        }
    }
    Ok(())
}

fn check_pass(meta: &TraceMeta, index: usize, pass: &Pass) -> std::result::Result<(), Broken> {
    let what = || format!("pass {index}");
    let tiles = pass.size_px.map(|size| size.div_ceil(TILE_SIZE_PX));
    ensure(pass.tiles == tiles && !pass.tiles.contains(&0), || {
        Broken::new(
            what(),
            format!(
                "{tiles:?} tiles of {TILE_SIZE_PX} px for {:?} px, at least one",
                pass.size_px
            ),
            format_args!("{:?}", pass.tiles),
        )
    })?;
    ensure(
        meta.frames.iter().any(|views| views.frame == pass.frame),
        || Broken::new(what(), "a frame of the description", pass.frame),
    )?;
    ensure(pass.kind == PassKind::Layer || pass.layer == 0, || {
        Broken::new(what(), "layer 0 of a pass that is no layer", pass.layer)
    })?;
    let eye_size_px = meta.hmd.eye_size_px;
    ensure(
        pass.kind != PassKind::Main || pass.eye.is_none() || pass.size_px == eye_size_px,
        || {
            Broken::new(
                what(),
                format!("the size of an eye's image, {eye_size_px:?} px"),
                format_args!("{:?}", pass.size_px),
            )
        },
    )
}

fn check_sample(
    tables: &Tables,
    what: &dyn Fn() -> String,
    sample: &Sample,
) -> std::result::Result<(), Broken> {
    let texture = usize::try_from(sample.texture)
        .ok()
        .and_then(|index| tables.textures.get(index))
        .ok_or_else(|| {
            let expected = format!("a texture below {}", tables.textures.len());
            Broken::new(what(), expected, sample.texture)
        })?;
    let samplers = tables.samplers.len();
    ensure(usize::from(sample.sampler) < samplers, || {
        Broken::new(
            what(),
            format!("a sampler below {samplers}"),
            sample.sampler,
        )
    })?;
    ensure(u32::from(sample.layer) < texture.layers, || {
        Broken::new(
            what(),
            format!("a layer below {}", texture.layers),
            sample.layer,
        )
    })?;
    let SampleLevel {
        rule, lod_256ths, ..
    } = sample.level;
    ensure(rule != LodRule::Derivatives || lod_256ths == 0, || {
        let expected = "a level of 0 where the derivatives decide";
        Broken::new(what(), expected, lod_256ths)
    })
}

fn length_u32(what: &str, length: usize) -> Result<u32> {
    u32::try_from(length).map_err(|_| too_long(what, length))
}

fn length_u16(what: &str, length: usize) -> Result<u16> {
    u16::try_from(length).map_err(|_| too_long(what, length))
}

fn too_long(what: &str, length: usize) -> FormatError {
    FormatError::Unwritable {
        what: what.to_owned(),
        expected: "a length that fits its field".to_owned(),
        found: length.to_string(),
    }
}

fn table<T>(
    items: &[T],
    mut write_item: impl FnMut(&T, &mut Vec<u8>) -> Result<()>,
) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    bytes.extend(length_u32("table", items.len())?.to_le_bytes());
    for item in items {
        write_item(item, &mut bytes)?;
    }
    Ok(bytes)
}

fn read_table<'a, T>(
    what: &'static str,
    item_bytes: usize,
    item: impl Fn(&'a [u8]) -> Parsed<'a, T>,
    input: &'a [u8],
) -> Parsed<'a, Vec<T>> {
    let (rest, items) = parse::count(what, item_bytes).parse(input)?;
    count(item, items).parse(rest)
}

fn write_name(name: &str, bytes: &mut Vec<u8>) -> Result<()> {
    bytes.extend(length_u16("name", name.len())?.to_le_bytes());
    bytes.extend(name.as_bytes());
    Ok(())
}

fn read_name(input: &[u8]) -> Parsed<'_, String> {
    let (start, length) = context("a name's length", le_u16).parse(input)?;
    let (rest, name) = context("a name", take(length)).parse(start)?;
    match std::str::from_utf8(name) {
        Ok(name) => Ok((rest, name.to_owned())),
        Err(error) => Err(nom::Err::Failure(Fault::new(start, "a UTF-8 name", error))),
    }
}

/// Reads a one-byte or two-byte number of an enum with the values `all`.
fn id<'a, N: Into<u16> + Copy, E: Copy>(
    what: &'static str,
    mut number: impl Parser<&'a [u8], Output = N, Error = Fault<'a>>,
    all: &'static [(u16, E)],
) -> impl FnMut(&'a [u8]) -> Parsed<'a, E> {
    move |input| {
        let (rest, found) = number.parse(input)?;
        let found: u16 = found.into();
        match all.iter().find(|(id, _)| *id == found) {
            Some((_, value)) => Ok((rest, *value)),
            None => Err(nom::Err::Failure(Fault::new(input, what, found))),
        }
    }
}

macro_rules! ids {
    ($type:ident: $($value:ident),+) => {
        &[$(($type::$value as u16, $type::$value)),+]
    };
}

const FORMATS: &[(u16, TexelFormat)] = ids!(TexelFormat: Bc1, Bc3, Bc7, Etc2, Etc2Rgba,
    Astc4x4, Astc5x5, Astc6x6, Astc8x8, Rgba8, R32f);
const FORMATS_V2: &[(u16, TexelFormat)] = ids!(TexelFormat: Bc1, Bc2, Bc3, Bc4, Bc5, Bc6h, Bc7, Etc2,
    Etc2Rgba, EacR11, EacRg11, Astc4x4, Astc5x5, Astc6x6, Astc8x8, Rgba8, R32f, R8, Rg8, Packed16, R16,
    Rg16, Rgba16, Rg32, Rgba32, Packed32, D16);
const COLOR_SPACES: &[(u16, ColorSpace)] = ids!(ColorSpace: Linear, Srgb);
const WRAPS: &[(u16, Wrap)] = ids!(Wrap: Repeat, MirroredRepeat, ClampToEdge);
const WRAPS_V2: &[(u16, Wrap)] =
    ids!(Wrap: Repeat, MirroredRepeat, ClampToEdge, ClampToBorder, MirrorClampToEdge);
const LOD_RULES: &[(u16, LodRule)] = ids!(LodRule: Derivatives, Bias, Explicit);
const FILTERS: &[(u16, Filter)] = ids!(Filter: Nearest, Linear);
const MIP_FILTERS: &[(u16, MipFilter)] = ids!(MipFilter: None, Nearest, Linear);
const PASS_KINDS: &[(u16, PassKind)] = ids!(PassKind: Main, Shadow, Layer);
const EYES: &[(u16, Option<Eye>)] = &[
    (0, Some(Eye::Left)),
    (1, Some(Eye::Right)),
    (NO_EYE as u16, None),
];

fn write_texture(version: Version, texture: &Texture, bytes: &mut Vec<u8>) -> Result<()> {
    for number in [
        texture.size[0],
        texture.size[1],
        texture.levels,
        texture.layers,
    ] {
        bytes.extend(number.to_le_bytes());
    }
    bytes.extend((texture.format as u16).to_le_bytes());
    bytes.extend([texture.color_space as u8, 0]);
    if version >= Version::Three {
        let none = Part {
            of: NO_PART,
            level: 0,
            layer: 0,
        };
        let Part { of, level, layer } = texture.part.unwrap_or(none);
        bytes.extend([of, level, layer].iter().flat_map(|n| n.to_le_bytes()));
    }
    write_name(&texture.name, bytes)
}

fn read_texture(version: Version, input: &[u8]) -> Parsed<'_, Texture> {
    let formats = match version {
        Version::One => FORMATS,
        _ => FORMATS_V2,
    };
    let (rest, (width, height, levels, layers)) =
        context("a texture with a name", (le_u32, le_u32, le_u32, le_u32)).parse(input)?;
    let (rest, format) = id("a texel format", le_u16, formats)(rest)?;
    let (rest, color_space) = id("a colour space", u8, COLOR_SPACES)(rest)?;
    let (rest, ()) = zero(rest, 1)?;
    let (rest, part) = match version {
        Version::Three => read_part(rest)?,
        _ => (rest, None),
    };
    let (rest, name) = read_name(rest)?;
    let texture = Texture {
        name,
        size: [width, height],
        levels,
        layers,
        format,
        color_space,
        part,
    };
    Ok((rest, texture))
}

fn read_part(input: &[u8]) -> Parsed<'_, Option<Part>> {
    let place = (le_u32, le_u32, le_u32);
    let (rest, (of, level, layer)) = context("a part of 12 bytes", place).parse(input)?;
    if of != NO_PART {
        return Ok((rest, Some(Part { of, level, layer })));
    }
    match level | layer {
        0 => Ok((rest, None)),
        found => Err(nom::Err::Failure(Fault::new(
            input,
            "zeros in a texture that is no part",
            found,
        ))),
    }
}

fn write_sampler(version: Version, sampler: &Sampler, bytes: &mut Vec<u8>) -> Result<()> {
    bytes.extend(sampler.wrap.map(|wrap| wrap as u8));
    bytes.extend([sampler.mag as u8, sampler.min as u8, sampler.mip as u8]);
    if version >= Version::Two {
        let LodRange {
            bias_256ths,
            min_256ths,
            max_256ths,
        } = sampler.lod;
        for number in [bias_256ths, min_256ths, max_256ths] {
            bytes.extend(number.to_le_bytes());
        }
    }
    if version >= Version::Three {
        bytes.extend(sampler.max_anisotropy_256ths.to_le_bytes());
    }
    Ok(())
}

fn read_sampler(version: Version, input: &[u8]) -> Parsed<'_, Sampler> {
    let wraps = match version {
        Version::One => WRAPS,
        _ => WRAPS_V2,
    };
    let (rest, wrap_u) = id("a wrap mode", u8, wraps)(input)?;
    let (rest, wrap_v) = id("a wrap mode", u8, wraps)(rest)?;
    let (rest, mag) = id("a filter", u8, FILTERS)(rest)?;
    let (rest, min) = id("a filter", u8, FILTERS)(rest)?;
    let (rest, mip) = id("a mip filter", u8, MIP_FILTERS)(rest)?;
    let (rest, lod) = match version {
        Version::One => (rest, LodRange::WHOLE),
        _ => {
            let (rest, (bias_256ths, min_256ths, max_256ths)) = context(
                "bias and bounds of a level of detail",
                (le_i16, le_i16, le_i16),
            )
            .parse(rest)?;
            let lod = LodRange {
                bias_256ths,
                min_256ths,
                max_256ths,
            };
            (rest, lod)
        }
    };
    let (rest, max_anisotropy_256ths) = match version {
        Version::Three => context("a maximum anisotropy", le_u16).parse(rest)?,
        _ => (rest, Sampler::ISOTROPIC),
    };
    let sampler = Sampler {
        wrap: [wrap_u, wrap_v],
        mag,
        min,
        mip,
        lod,
        max_anisotropy_256ths,
    };
    Ok((rest, sampler))
}

fn write_draw(version: Version, draw: &Draw, bytes: &mut Vec<u8>) -> Result<()> {
    bytes.extend(draw.first_primitive.to_le_bytes());
    bytes.extend(draw.primitives.to_le_bytes());
    bytes.extend(length_u16("draw groups", draw.groups.len())?.to_le_bytes());
    write_name(&draw.material, bytes)?;
    for group in &draw.groups {
        bytes.extend(group.extent.iter().flat_map(|extent| extent.to_le_bytes()));
        bytes.extend(length_u16("group samples", group.samples.len())?.to_le_bytes());
        for sample in &group.samples {
            bytes.extend(sample.texture.to_le_bytes());
            bytes.extend(sample.sampler.to_le_bytes());
            bytes.extend(sample.layer.to_le_bytes());
            bytes.extend(sample.offset.iter().flat_map(|offset| offset.to_le_bytes()));
            if version >= Version::Two {
                let SampleLevel {
                    rule,
                    lod_256ths,
                    operands,
                } = sample.level;
                bytes.extend([rule as u8, operands.into()]);
                bytes.extend(lod_256ths.to_le_bytes());
            }
        }
    }
    Ok(())
}

fn read_draw(version: Version, input: &[u8]) -> Parsed<'_, Draw> {
    let (rest, (first_primitive, primitives, groups)) = context(
        "a draw of 12 bytes, a name and groups",
        (le_u32, le_u32, le_u16),
    )
    .parse(input)?;
    let (rest, material) = read_name(rest)?;
    let (rest, groups) =
        count(|input| read_group(version, input), usize::from(groups)).parse(rest)?;
    let draw = Draw {
        material,
        first_primitive,
        primitives,
        groups,
    };
    Ok((rest, draw))
}

fn read_group(version: Version, input: &[u8]) -> Parsed<'_, UvGroup> {
    let (rest, (width, height, samples)) = context(
        "a uv group of 10 bytes and samples",
        (le_u32, le_u32, le_u16),
    )
    .parse(input)?;
    let (rest, samples) =
        count(|input| read_sample(version, input), usize::from(samples)).parse(rest)?;
    let extent = [width, height];
    Ok((rest, UvGroup { extent, samples }))
}

fn read_sample(version: Version, input: &[u8]) -> Parsed<'_, Sample> {
    let (rest, (texture, sampler, layer, x, y)) =
        context("a sample of 10 bytes", (le_u32, le_u16, le_u16, i8, i8)).parse(input)?;
    let (rest, level) = match version {
        Version::One => (rest, SampleLevel::default()),
        _ => read_level(rest)?,
    };
    let sample = Sample {
        texture,
        sampler,
        layer,
        offset: [x, y],
        level,
    };
    Ok((rest, sample))
}

fn read_level(input: &[u8]) -> Parsed<'_, SampleLevel> {
    let (start, rule) = id("a rule of levels of detail", u8, LOD_RULES)(input)?;
    let (rest, operands) = context("a sample of 14 bytes", u8).parse(start)?;
    if operands > 1 {
        let expected = "0 or 1 for operands";
        return Err(nom::Err::Failure(Fault::new(start, expected, operands)));
    }
    let (rest, lod_256ths) = context("a sample of 14 bytes", le_i16).parse(rest)?;
    let level = SampleLevel {
        rule,
        lod_256ths,
        operands: operands == 1,
    };
    Ok((rest, level))
}

fn write_pass(pass: &Pass, bytes: &mut Vec<u8>) -> Result<()> {
    let eye = match pass.eye {
        Some(Eye::Left) => 0,
        Some(Eye::Right) => 1,
        None => NO_EYE,
    };
    bytes.extend(pass.frame.to_le_bytes());
    bytes.extend([pass.kind as u8, eye]);
    bytes.extend(pass.layer.to_le_bytes());
    for number in [pass.size_px, pass.tiles].as_flattened() {
        bytes.extend(number.to_le_bytes());
    }
    Ok(())
}

fn read_pass(input: &[u8]) -> Parsed<'_, Pass> {
    let (rest, frame) = context("a pass of 24 bytes", le_u32).parse(input)?;
    let (rest, kind) = id("a pass kind", u8, PASS_KINDS)(rest)?;
    let (rest, eye) = id("an eye (0, 1 or 255)", u8, EYES)(rest)?;
    let (rest, layer) = le_u16.parse(rest)?;
    let (rest, (width, height, columns, rows)) = (le_u32, le_u32, le_u32, le_u32).parse(rest)?;
    let pass = Pass {
        frame,
        kind,
        eye,
        layer,
        size_px: [width, height],
        tiles: [columns, rows],
    };
    Ok((rest, pass))
}
