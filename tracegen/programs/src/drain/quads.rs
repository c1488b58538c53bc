//! The records of a quad of a primitive, in the draws of the trace.

use super::places::Placement;
use super::portions::GroupKey;
use crate::groups::Group;
use crate::lanes::visits;
use crate::session::{coverage_group, survival_group};
use formats::textrace::NO_GROUP;
use rayon::prelude::*;
use record::{DepthReplay, RawDepth, RawRecord};
use spool::ShaderInfo;
use spool::{Form, RawQuad, RawSample, Site, TextureSite, What};
use std::collections::{BTreeMap, HashMap};

/// Records of one render pass.
#[derive(Default)]
pub struct Records {
    pub quads: Vec<RawRecord>,
    pub depths: Vec<RawDepth>,
}

/// Groups the records of a draw by view, primitive and quad.
pub fn quads(shader: &ShaderInfo, declared: &Declared, records: &[RawSample]) -> Vec<(u32, Quad)> {
    let mut order: Vec<(u64, u32)> = (records.iter().enumerate())
        .map(|(index, record)| (place(record), index as u32))
        .collect();
    // Within a quad, the records stay in the order in which they were recorded.
    order.par_sort_unstable();
    let sites = Sites {
        coverage: coverage_group(shader),
        survival: survival_group(shader),
        shader,
    };
    let places: Vec<&[(u64, u32)]> = order.chunk_by(|a, b| a.0 == b.0).collect();
    places
        .par_iter()
        .map(|place| {
            let of: Vec<&RawSample> = place
                .iter()
                .map(|(_, index)| &records[*index as usize])
                .collect();
            (of[0].view(), quad(&sites, declared, &of))
        })
        .collect()
}

/// Sort key of a record: view, primitive and quad.
pub fn place(record: &RawSample) -> u64 {
    u64::from(record.primitive) << 32 | u64::from(record.place)
}

/// The site of a record that reads a texture, and its coordinate group with the element.
pub fn site<'s>(shader: &'s ShaderInfo, record: &RawSample) -> Option<(&'s Site, GroupKey)> {
    let (site, texture) = texture_of(shader, record.group())?;
    let own = texture.image.element.is_none();
    Some((site, (record.group(), own.then_some(record.element))))
}

/// The first site of a coordinate group that reads a texture.
fn texture_of(shader: &ShaderInfo, group: u16) -> Option<(&Site, &TextureSite)> {
    let mut of = shader.sites.iter().filter(|site| site.group == group);
    of.find_map(|site| match &site.what {
        What::Texture(texture) => Some((site, texture)),
        _ => None,
    })
}

/// Draws of the trace for a draw of the program.
pub struct Declared {
    /// By their first primitives, which ascend from 0.
    pub portions: Vec<DeclaredPortion>,
    pub replay: DepthReplay,
}

/// Draws of a range of primitives.
pub struct DeclaredPortion {
    /// Its first primitive in the program's draw.
    pub start: u32,
    pub draws: Vec<DeclaredDraw>,
}

/// A draw of the trace.
pub struct DeclaredDraw {
    pub index: u32,
    /// Number in the trace of the portion's first primitive.
    pub first: u32,
    pub groups: HashMap<GroupKey, Group>,
}

impl Declared {
    fn portion(&self, primitive: u32) -> &DeclaredPortion {
        let after = self.portions.partition_point(|of| of.start <= primitive);
        &self.portions[after - 1]
    }
}

impl DeclaredPortion {
    /// The draw of a quad with records of these groups: the one that has them all, or the first one.
    fn home(&self, keys: impl Iterator<Item = GroupKey> + Clone) -> &DeclaredDraw {
        if let [only] = self.draws.as_slice() {
            return only;
        }
        let known = |key: &GroupKey| self.draws.iter().any(|draw| draw.groups.contains_key(key));
        let has_all = |draw: &&DeclaredDraw| {
            keys.clone()
                .filter(known)
                .all(|key| draw.groups.contains_key(&key))
        };
        self.draws.iter().find(has_all).unwrap_or(&self.draws[0])
    }

    /// The draw for the records of a group in a quad, and the group. `None` for a group that is left out.
    fn draw<'a>(
        &'a self,
        home: &'a DeclaredDraw,
        key: &GroupKey,
    ) -> Option<(&'a DeclaredDraw, &'a Group)> {
        let mut draws = [home].into_iter().chain(&self.draws);
        draws.find_map(|draw| Some((draw, draw.groups.get(key)?)))
    }
}

struct Sites<'a> {
    coverage: Option<u16>,
    survival: Option<u16>,
    shader: &'a ShaderInfo,
}

/// Records of one quad of a primitive.
pub struct Quad {
    at: [u32; 2],
    records: Vec<RawRecord>,
    depth: RawDepth,
}

/// A record of a quad of the portion's primitive `primitive`.
fn record(draw: &DeclaredDraw, primitive: u32, mask: u8, group: u8, at: &RawQuad) -> RawRecord {
    RawRecord {
        header: RawRecord::pack(0, 0, mask, group),
        primitive: draw.first.saturating_add(primitive),
        draw: draw.index,
        passing: 0,
        uv: at.uv,
        dx: at.dx,
        dy: at.dy,
        cross: at.cross,
    }
}

/// Combines the records of a quad of a primitive.
fn quad(sites: &Sites<'_>, declared: &Declared, of: &[&RawSample]) -> Quad {
    let portion = declared.portion(of[0].primitive);
    let primitive = of[0].primitive - portion.start;
    let sampling = of.iter().filter_map(|sample| {
        let (site, key) = site(sites.shader, sample)?;
        Some((*sample, site, key))
    });
    let home = portion.home(sampling.clone().map(|(_, _, key)| key));
    let lanes_of = |group: Option<u16>| {
        let of = of.iter().filter(|record| Some(record.group()) == group);
        of.fold(0, |mask, record| mask | record.lanes())
    };
    let covered = lanes_of(sites.coverage);
    let mut records = Vec::new();
    // Lanes that sample a texture in the quad's draw, which must have records of all covered lanes.
    let mut sampled = 0;
    let mut fragments: BTreeMap<GroupKey, Vec<(u8, &RawSample)>> = BTreeMap::new();
    for (sample, site, key) in sampling {
        let Some((draw, group)) = portion.draw(home, &key) else {
            continue;
        };
        if site.form == Form::Fragment {
            let lane = sample.lanes().trailing_zeros() as u8;
            fragments.entry(key).or_default().push((lane, sample));
            continue;
        }
        let at = group.quad(sample.as_quad());
        records.push(record(draw, primitive, sample.lanes(), group.number, &at));
        sampled |= if draw.index == home.index {
            sample.lanes()
        } else {
            0
        };
    }
    for (key, of) in fragments {
        let Some((draw, group)) = portion.draw(home, &key) else {
            continue;
        };
        let lanes: Vec<_> = (of.iter())
            .map(|(lane, sample)| (*lane, group.fragment(&sample.as_fragment())))
            .collect();
        for visit in visits(&lanes, group.joins()) {
            if group.operands {
                let before = group.number - 1;
                let mut operands = record(draw, primitive, visit.mask, before, &visit.operands);
                operands.passing = RawRecord::OPERANDS;
                records.push(operands);
            }
            records.push(record(draw, primitive, visit.mask, group.number, &visit.uv));
            sampled |= if draw.index == home.index {
                visit.mask
            } else {
                0
            };
        }
    }
    let alone = covered & !sampled;
    let none = RawQuad::default();
    let mut depth = RawDepth::default();
    if declared.replay == DepthReplay::None {
        if alone != 0 {
            records.push(record(home, primitive, alone, NO_GROUP, &none));
        }
        return Quad {
            at: of[0].quad(),
            records,
            depth,
        };
    }
    // The depth test compares all covered lanes with those that survived earlier.
    let survived = lanes_of(sites.survival);
    let depths = of
        .iter()
        .find(|record| Some(record.group()) == sites.coverage);
    if let Some(depths) = depths.map(|record| record.as_quad()) {
        let [z, dx, dy, cross] = [depths.uv, depths.dx, depths.dy, depths.cross].map(|v| v[0]);
        depth.depth = [z, z + dx, z + dy, z + dx + dy + cross];
    }
    let flags = RawRecord::HAS_DEPTH | u32::from(survived);
    let whole = records.iter_mut().find(|record| {
        record.draw == home.index && record.mask() == covered && !record.is_operands()
    });
    match whole {
        Some(record) => record.passing |= flags,
        None => {
            let mut coverage = record(home, primitive, covered, NO_GROUP, &none);
            coverage.passing = flags;
            records.push(coverage);
        }
    }
    Quad {
        at: of[0].quad(),
        records,
        depth,
    }
}

impl Quad {
    /// Adds the records of the lanes inside a picture.
    pub fn place(self, placement: Placement, replay: DepthReplay, into: &mut Records) {
        let has_depths = replay != DepthReplay::None;
        for mut record in self.records {
            let Some(([x, y], mask)) = placement.quad(self.at, record.mask()) else {
                continue;
            };
            record.header = RawRecord::pack(x, y, mask, record.group());
            into.quads.push(record);
            if has_depths || !into.depths.is_empty() {
                into.depths
                    .resize(into.quads.len() - 1, RawDepth::default());
                into.depths.push(self.depth);
            }
        }
    }
}
