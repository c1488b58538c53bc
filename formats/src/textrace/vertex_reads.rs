//! Texture reads of vertex shaders, with the coordinates that the shaders computed.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::{Tables, tables};
use crate::container::{ChunkTag, Container, ContainerWriter, MAJOR_1, MAJOR_2, MAJOR_4};
use crate::error::{Broken, Result, ensure};
use crate::footprint::{Footprint, SamplingOptions, footprints, wrap_texel};
use crate::parse::{Cursor, Number, Parsed, Taken};
use crate::records::{self, Codec, Record, put_count};
use crate::textrace::{LodRule, QuadRecord, SUBTEXELS, Sample, SampleLevel};
use crate::texture::{Texture, Wrap};
use crate::varint::put_difference;
use crate::view::Eye;
use serde::Serialize;
use std::fmt::Arguments;
use std::io::{Seek, Write};

/// Texture reads of vertex shaders.
pub const VERTEX_READS: ChunkTag = ChunkTag(*b"VTXR");
/// Minor version of major versions 2, 3 and 5 that introduced the chunk.
pub const VERTEX_READS_MINOR: u16 = 1;
/// Code of an eye that is both or is not known.
const NO_EYE: u8 = 255;
/// Bytes of a draw without sites and reads, and fewest bytes of a read.
pub const LEAST_BYTES: [usize; 2] = [17, 7];

/// The vertex shader of a draw that reads textures, once executed.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct VertexDraw {
    /// Frame.
    pub frame: u32,
    /// Eye; `None` if the draw is for both eyes or for a target that is no eye's.
    pub eye: Option<Eye>,
    /// Number of the draw command among those of the frame, in the order of execution.
    pub draw: u32,
    /// Image instructions that read.
    pub sites: Vec<VertexSite>,
    /// Reads by ascending instance and vertex; those of one vertex in the order in which they were made.
    pub reads: Vec<VertexRead>,
}

/// An image instruction of a vertex shader.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct VertexSite {
    /// Index of the texture.
    pub texture: u32,
    /// Index of the sampler, which a fetch does not use.
    pub sampler: u16,
    /// Whether it fetches a texel at integer coordinates. Otherwise it samples at a level.
    pub fetches: bool,
    /// Texel offset at the level.
    pub offset: [i8; 2],
}

/// A read of a vertex.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct VertexRead {
    /// Instance, with the first instance of the draw.
    pub instance: u32,
    /// Index of the vertex, with the vertex offset of the draw.
    pub vertex: u32,
    /// Index among the sites of the draw.
    pub site: u32,
    /// Of a fetch column and row of the texel, as `i32`; of a sample u and v, as `f32`: their bits.
    pub at: [u32; 2],
    /// Array layer.
    pub layer: u32,
    /// Of a fetch the level, as `i32`; of a sample the level of detail, as `f32`: the bits.
    pub level: u32,
}

impl VertexDraw {
    /// Calls `visit` with each read, its site and its footprints, in order.
    ///
    /// A fetch outside its level, array or texture reads nothing.
    pub fn footprints(&self, tables: &Tables, mut visit: impl FnMut(&VertexSite, Footprint)) {
        for read in &self.reads {
            let Some(site) = self.sites.get(read.site as usize) else {
                continue;
            };
            let texture = tables.textures.get(site.texture as usize);
            let sampler = tables.samplers.get(usize::from(site.sampler));
            let Some((texture, sampler)) = texture.zip(sampler) else {
                continue;
            };
            if site.fetches {
                if let Some(footprint) = read.fetched(site, texture) {
                    visit(site, footprint);
                }
                continue;
            }
            let (record, operands) = read.sampled(texture);
            let sample = Sample {
                texture: site.texture,
                sampler: site.sampler,
                layer: 0,
                offset: site.offset,
                level: SampleLevel {
                    rule: LodRule::Explicit,
                    lod_256ths: 0,
                    operands: true,
                },
            };
            footprints(
                &record,
                Some(&operands),
                texture.size,
                &sample,
                texture,
                sampler,
                &SamplingOptions::default(),
                |footprint| visit(site, footprint),
            );
        }
    }

    /// Number of vertices that read: runs of reads of one instance and vertex.
    pub fn vertices(&self) -> u64 {
        let of = self
            .reads
            .chunk_by(|a, b| (a.instance, a.vertex) == (b.instance, b.vertex));
        of.count() as u64
    }
}

/// Checks the rules of the format between the reads and the tables.
fn check(draws: &[VertexDraw], tables: &Tables) -> Result<(), Broken> {
    let mut last = (0, 0);
    for (index, draw) in draws.iter().enumerate() {
        let rule = |holds, what: &str, expected: Arguments<'_>, found: Arguments<'_>| {
            let what = format_args!("{what} of draw {index} of vertex reads");
            ensure(holds, what, expected, found)
        };
        let below = |what: &str, number: usize, count: usize| {
            let expected = format_args!("an index below {count}");
            rule(number < count, what, expected, format_args!("{number}"))
        };
        let (frame, at) = (draw.frame, (draw.frame, draw.draw));
        let is_known = (tables.meta.frames.iter()).any(|views| views.frame == frame);
        let expected = format_args!("a frame of the description");
        rule(is_known, "frame", expected, format_args!("{frame}"))?;
        let expected = format_args!("frame and number from {last:?} on");
        rule(at >= last, "place", expected, format_args!("{at:?}"))?;
        last = at;
        for site in &draw.sites {
            below("texture", site.texture as usize, tables.textures.len())?;
            below("sampler", site.sampler.into(), tables.samplers.len())?;
        }
        let mut last = (0, 0);
        for read in &draw.reads {
            below("site", read.site as usize, draw.sites.len())?;
            let at = (read.instance, read.vertex);
            let expected = format_args!("instance and vertex from {last:?} on");
            rule(at >= last, "read", expected, format_args!("{at:?}"))?;
            last = at;
        }
    }
    Ok(())
}

impl VertexRead {
    /// The texel of a fetch.
    fn fetched(&self, site: &VertexSite, texture: &Texture) -> Option<Footprint> {
        let level = u8::try_from(self.level).ok()?;
        let layer = u16::try_from(self.layer).ok()?;
        if u32::from(level) >= texture.levels || u32::from(layer) >= texture.layers {
            return None;
        }
        let size = texture.level_size(level.into());
        let texel = |at: u32, offset: i8, size: u32| {
            let at = i64::from(at.cast_signed()) + i64::from(offset);
            wrap_texel(at, size, Wrap::ClampToBorder)
        };
        let ([u, v], [du, dv], [width, height]) = (self.at, site.offset, size);
        Some(Footprint {
            lane: 0,
            level,
            layer,
            i: [texel(u, du, width)?; 2],
            j: [texel(v, dv, height)?; 2],
        })
    }

    /// A record of a quad whose first lane alone samples, and its operands.
    fn sampled(&self, texture: &Texture) -> (QuadRecord, QuadRecord) {
        let subtexels = f64::from(SUBTEXELS);
        // Conversions saturate.
        #[allow(clippy::cast_possible_truncation)]
        let fixed = |value: f64| (value * subtexels).round() as i32;
        let ([u, v], [width, height]) = (self.at.map(f32::from_bits), texture.size);
        let record = |uv| QuadRecord {
            mask: 1,
            uv,
            ..QuadRecord::default()
        };
        let at = [(u, width), (v, height)].map(|(at, size)| fixed(f64::from(at) * f64::from(size)));
        let level = fixed(f32::from_bits(self.level).into());
        (record(at), record([level, fixed(self.layer.into())]))
    }
}

/// Checks and writes the reads, if there are any.
pub(super) fn write<W: Write + Seek>(
    draws: &[VertexDraw],
    tables: &Tables,
    container: &mut ContainerWriter<W>,
) -> Result<()> {
    if draws.is_empty() {
        return Ok(());
    }
    check(draws, tables).map_err(Broken::unwritable)?;
    let mut bytes = Vec::new();
    put_count("draws of vertex reads", draws.len(), &mut bytes)?;
    for draw in draws {
        put_draw(draw, &mut bytes)?;
    }
    container.require_minor(VERTEX_READS_MINOR);
    container.chunk(VERTEX_READS, &bytes)
}

fn put_draw(draw: &VertexDraw, bytes: &mut Vec<u8>) -> Result<()> {
    [draw.frame, draw.draw].put(bytes);
    draw.eye.map_or(NO_EYE, |eye| eye as u8).put(bytes);
    bytes.extend(records::write_table(MAJOR_2, &draw.sites)?);
    put_count("vertex reads", draw.reads.len(), bytes)?;
    let mut last = VertexRead::default();
    for read in &draw.reads {
        let mut read = *read;
        for (last, value) in last.columns().into_iter().zip(read.columns()) {
            put_difference(last, *value, bytes);
        }
    }
    Ok(())
}

impl Record for VertexSite {
    fn fields<'a>(&mut self, codec: &mut Codec<'a>) -> Taken<'a> {
        codec.record = "a site of vertex reads";
        codec.number(&mut self.texture)?;
        codec.number(&mut self.sampler)?;
        codec.id(
            "0 for a sample or 1 for a fetch",
            &[(0_u8, false), (1, true)],
            &mut self.fetches,
        )?;
        codec.number(&mut self.offset)
    }
}

impl VertexRead {
    fn columns(&mut self) -> [&mut u32; 7] {
        let Self {
            instance,
            vertex,
            site,
            at: [u, v],
            layer,
            level,
        } = self;
        [instance, vertex, site, u, v, layer, level]
    }
}

/// Reads and checks the reads of a trace.
pub(super) fn read(container: &Container, tables: &Tables) -> Result<Vec<VertexDraw>> {
    let has_chunk = container.entry(VERTEX_READS).is_ok();
    if matches!(container.version().0, MAJOR_1 | MAJOR_4) || !has_chunk {
        return Ok(Vec::new());
    }
    container.expect_minor(VERTEX_READS_MINOR, VERTEX_READS, "vertex reads")?;
    container.expect_order(&[tables::PASSES, VERTEX_READS])?;
    let draws = container.parse_chunk(VERTEX_READS, take_draws)?;
    let checked = check(&draws, tables);
    checked.map_err(|broken| container.broken(VERTEX_READS, 0, broken))?;
    Ok(draws)
}

fn take_draws(input: &[u8]) -> Parsed<'_, Vec<VertexDraw>> {
    let mut input = Cursor::new(input);
    let count = input.count("count of draws", LEAST_BYTES[0])?;
    let draws: Taken<'_, Vec<VertexDraw>> = (0..count).map(|_| take_draw(&mut input)).collect();
    Ok((input.rest(), draws?))
}

fn take_draw<'a>(input: &mut Cursor<'a>) -> Taken<'a, VertexDraw> {
    let [frame, draw] = input.fixed("frame and draw of vertex reads")?;
    let at = *input;
    let eye = match input.fixed("an eye")? {
        0_u8 => Some(Eye::Left),
        1 => Some(Eye::Right),
        NO_EYE => None,
        other => return Err(at.fault("an eye, 0, 1 or 255", other)),
    };
    let sites = input.parse(|input| records::parse_table(MAJOR_2, "site count", input))?;
    let count = input.count("read count", LEAST_BYTES[1])?;
    let mut reads = Vec::with_capacity(count);
    let mut last = VertexRead::default();
    for _ in 0..count {
        for value in last.columns() {
            input.difference(value, "a value of a vertex read")?;
        }
        reads.push(last);
    }
    Ok(VertexDraw {
        frame,
        eye,
        draw,
        sites,
        reads,
    })
}

#[cfg(test)]
#[allow(clippy::indexing_slicing)]
mod tests;
