//! Texture reads of vertex shaders.

use super::DrainError;
use super::frame_builder::Builder;
use crate::session::{Executed, Session};
use crate::views::{Other, Role};
use formats::textrace::{VertexDraw, VertexRead, VertexSite};
use formats::view::Eye;
use spool::{Access, Lod, RawSample, Shape, What};
use std::collections::BTreeMap;
use std::io::{Seek, Write};

/// Draws of a frame in the order of execution, with what they show.
pub(super) struct ShownDraws {
    pub frame: u32,
    pub draws: Vec<(Executed, Role)>,
    /// Views of the left and the right eye in multiview passes.
    pub layers: [u32; 2],
}

/// Texture reads of the vertex shaders of a frame; those that a trace cannot have are counted by the session. The
/// drawing of a browser itself, which differs from run to run, is left out.
pub(super) fn of_frame<W: Write + Seek>(
    session: &mut Session,
    builder: &mut Builder<W>,
    shown: &ShownDraws,
) -> Result<Vec<VertexDraw>, DrainError> {
    let draws = shown.draws.iter();
    let draws = draws.filter(|(_, role)| *role != Role::Other(Other::Browser));
    let recorded = |session: &Session, draw| session.draw(draw)?.vertex_shader;
    if !draws
        .clone()
        .any(|(of, _)| recorded(session, of.draw).is_some())
    {
        return Ok(Vec::new());
    }
    let mut records = session.vertex_records(shown.frame)?;
    let mut all = Vec::new();
    for (number, (executed, role)) in (0..).zip(draws) {
        let Some(mut records) = records.remove(&executed.draw) else {
            continue;
        };
        // The driver shades vertices in an order of its own.
        records.sort_by_key(|of| (of.view(), of.instance(), of.primitive));
        for of_view in records.chunk_by(|a, b| a.view() == b.view()) {
            let (sites, reads, lost) = reads_of(session, builder, executed.draw, of_view);
            for (what, count) in lost {
                session.reads.lost_vertices(shown.frame, &what, count);
            }
            if !reads.is_empty() {
                all.push(VertexDraw {
                    frame: shown.frame,
                    eye: eye(session, executed, *role, shown.layers, of_view[0].view()),
                    draw: number,
                    sites,
                    reads,
                });
            }
        }
    }
    Ok(all)
}

/// The eye that a draw into a view shows.
fn eye(
    session: &Session,
    executed: &Executed,
    role: Role,
    layers: [u32; 2],
    view: u32,
) -> Option<Eye> {
    match role {
        // The records are those of several render passes.
        _ if (session.draw(executed.draw)).is_none_or(|info| info.unrecorded.is_some()) => None,
        Role::Seen(eye) => eye,
        Role::Multiview => match layers.map(|layer| layer == view) {
            [true, false] => Some(Eye::Left),
            [false, true] => Some(Eye::Right),
            _ => None,
        },
        _ => None,
    }
}

/// Sites and reads of a draw into a view, and numbers of the reads that a trace cannot have, by reason.
fn reads_of<W: Write + Seek>(
    session: &Session,
    builder: &mut Builder<W>,
    draw: u32,
    records: &[RawSample],
) -> (Vec<VertexSite>, Vec<VertexRead>, BTreeMap<String, u64>) {
    let (mut sites, mut reads) = (Vec::new(), Vec::new());
    let mut lost: BTreeMap<String, u64> = BTreeMap::new();
    // Sites of the trace by site of the shader and element, or why there is none.
    let mut known: BTreeMap<(u16, u32), Result<u32, String>> = BTreeMap::new();
    let info = session.draw(draw);
    let shader = info.and_then(|info| session.shader(info.vertex_shader?));
    for record in records {
        let found = shader.and_then(|of| of.sites.get(usize::from(record.group())));
        let (Some(info), Some(What::Texture(of))) = (info, found.map(|site| &site.what)) else {
            *lost.entry("unknown textures".to_owned()).or_default() += 1;
            continue;
        };
        let key = (
            record.group(),
            of.image.element.map_or(record.element, |_| 0),
        );
        let site = known.entry(key).or_insert_with(|| {
            let bound = builder.bound(session, &info.vertex_textures, of, Some(key.1))?;
            if bound.unnormalized {
                return Err("textures with coordinates in texels".to_owned());
            }
            sites.push(VertexSite {
                texture: bound.texture,
                sampler: bound.sampler,
                fetches: of.access == Access::Fetch,
                offset: of.offset,
            });
            Ok(sites.len() as u32 - 1)
        });
        match site {
            Ok(site) => reads.push(read(of, record, *site)),
            Err(why) => *lost.entry(why.clone()).or_default() += 1,
        }
    }
    (sites, reads, lost)
}

/// The read of a record.
fn read(of: &spool::TextureSite, record: &RawSample, site: u32) -> VertexRead {
    let values = record.as_fragment();
    let level = match of.lod {
        Lod::Explicit(Some(level)) => level,
        _ => values.lod,
    };
    let [u, v, layer] = values.at;
    let layer = if of.shape == Shape::Array { layer } else { 0.0 };
    // Integers below 2^24, more than texels and layers of any image, are exact as floats.
    let integer = |value: f32| (value as i32).cast_unsigned();
    let (at, layer, level) = match of.access {
        Access::Fetch => ([u, v].map(integer), integer(layer), integer(level)),
        // Layers below 0 become 0, as in the driver's selection of a layer.
        _ => (
            [u, v].map(f32::to_bits),
            layer.round_ties_even() as u32,
            level.to_bits(),
        ),
    };
    VertexRead {
        instance: record.instance(),
        vertex: record.primitive,
        site,
        at,
        layer,
        level,
    }
}
