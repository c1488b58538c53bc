//! Builds the draws of a frame, their groups, and the records of each eye.

use super::DrainError;
use super::images::ImageTextures;
use super::pass;
use super::places::Placement;
use super::portions::{GroupKey, Groups, OfPrimitives, portions, size};
use super::quads::{Declared, DeclaredDraw, DeclaredPortion, Records, place, quads, site};
use crate::groups::{Bound, Group};
use crate::session::{Executed, Session};
use crate::texture::{FETCH, gathering, sampler};
use crate::views::{Other, Role, Views, viewport};
use ash::vk;
use formats::textrace::{Draw, LeftOut, PassKind, Surfaces, TraceMeta, UvGroup};
use formats::textrace::{TextraceWriter, tables::MAX_GROUPS};
use formats::view::Eye;
use record::{CaptureCounts, DepthReplay, RawRecords, RecordError, Recorder};
use spool::{Access, DepthTests, RawSample, TextureSite, What};
use spool::{DrawInfo, ShaderInfo, TextureInfo};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::io::{Seek, Write};

/// A draw of the trace and the executed draws that it consists of.
#[derive(Clone, Copy, Debug)]
pub enum StereoDraw {
    /// A draw into a shadow map.
    Shadow(Executed),
    /// A draw into a picture that both eyes use.
    Mono(Executed),
    /// A draw for both eyes at once, with the numbers of their views.
    Multiview(Executed, [u32; 2]),
    /// Draws for the left and the right eye.
    Eyes([Option<Executed>; 2]),
}

impl StereoDraw {
    /// The executed draws, and the targets of their records.
    fn parts(&self) -> Vec<(Executed, RecordTarget)> {
        match *self {
            Self::Shadow(draw) => vec![(draw, RecordTarget::Pass(draw.pass))],
            Self::Mono(draw) => vec![(draw, RecordTarget::Both)],
            Self::Multiview(draw, layers) => vec![(draw, RecordTarget::Layers(layers))],
            Self::Eyes(eyes) => (eyes.into_iter().zip([Eye::Left, Eye::Right]))
                .filter_map(|(draw, eye)| Some((draw?, RecordTarget::Eye(eye))))
                .collect(),
        }
    }
}

/// Destination of the records of a draw.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum RecordTarget {
    Eye(Eye),
    Both,
    Layers([u32; 2]),
    Pass(u32),
}

/// A render pass of the trace: the picture of an eye, or a shadow map by its pass in the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum TargetPass {
    Shadow(u32),
    Left,
    Right,
    Both,
}

/// Draws of the eyes and of shadow maps that have no records in the trace; see [`Session::is_shaded`].
const UNSHADED: &str =
    "draws that write no colour and discard nothing, so their fragment shader has no effect";

/// Fragments of quads that sample at more coordinates than a draw of the trace has groups.
const DIVIDED: &str = "fragments of quads that sample at more than 15 coordinates: several draws of the trace count them";

/// Builds a trace frame by frame.
pub struct Builder<W: Write + Seek> {
    recorder: Recorder<W>,
    pub counts: CaptureCounts,
    /// Fragments of the left and of the right eye.
    pub eye_fragments: [u64; 2],
    textures: ImageTextures,
    next_primitive: u32,
    /// Numbers of the program's pipelines, from 1 in the order in which the trace uses them. The program's own
    /// numbers differ from run to run.
    pipelines: HashMap<u32, u32>,
    /// Whether all fragments of each draw hide those behind them.
    opaque: Vec<bool>,
    left_out: BTreeMap<String, [u64; 2]>,
}

impl<W: Write + Seek> Builder<W> {
    /// Starts an empty trace.
    pub fn new(recorder: Recorder<W>) -> Self {
        Self {
            recorder,
            counts: CaptureCounts::default(),
            eye_fragments: [0; 2],
            textures: ImageTextures::default(),
            next_primitive: 0,
            pipelines: HashMap::new(),
            opaque: Vec::new(),
            left_out: BTreeMap::new(),
        }
    }

    /// Texture accesses that are not in the trace so far.
    pub fn left_out(&self) -> Vec<LeftOut> {
        let of = |(what, [draws, fragments]): (&String, &[u64; 2])| LeftOut {
            what: what.clone(),
            draws: *draws,
            fragments: *fragments,
        };
        self.left_out.iter().map(of).collect()
    }

    /// Ranges of draws that are not opaque.
    pub fn not_opaque(&self) -> Vec<[u32; 2]> {
        Surfaces::ranges(self.opaque.iter().copied())
    }

    /// Completes the trace with its description.
    pub fn finish(mut self, meta: TraceMeta) -> Result<TextraceWriter<W>, DrainError> {
        self.textures.join(&mut self.recorder)?;
        let mut writer = self.recorder.into_writer()?;
        writer.set_meta(meta).map_err(RecordError::from)?;
        Ok(writer)
    }

    /// Counts draws that are in no render pass of the trace, and draws with caveats.
    pub fn count_ignored(
        &mut self,
        session: &Session,
        draws: &[Executed],
        views: &Views,
        weights: &[u64],
    ) {
        for ((executed, role), weight) in draws.iter().zip(&views.roles).zip(weights) {
            let info = session.draw(executed.draw);
            if *role == Role::Other(Other::Browser) {
                // A browser draws its window at any time, so the numbers vary between runs.
                continue;
            }
            if let Role::Other(other) = role {
                self.leave_out(other.name(), 1, *weight);
            } else if let Some(why) = info.and_then(|info| info.unrecorded.as_ref()) {
                self.leave_out(why, 1, *weight);
            } else if !session.is_shaded(executed) {
                self.leave_out(UNSHADED, 1, *weight);
            } else if let Some(info) = info {
                for caveat in &info.caveats {
                    self.leave_out(caveat, 1, *weight);
                }
            }
        }
    }

    fn leave_out(&mut self, what: &str, draws: u64, fragments: u64) {
        let of = self.left_out.entry(what.to_owned()).or_default();
        of[0] += draws;
        of[1] += fragments;
    }

    /// Adds a frame. Returns its number of triangles.
    pub fn frame(
        &mut self,
        session: &Session,
        number: u32,
        merged: &[StereoDraw],
        records: &HashMap<u32, Vec<RawSample>>,
        placements: [Placement; 2],
        size_px: [u32; 2],
    ) -> Result<u64, DrainError> {
        let mut passes: BTreeMap<TargetPass, Records> = BTreeMap::new();
        let eyes = match merged {
            _ if merged
                .iter()
                .any(|draw| matches!(draw, StereoDraw::Mono(_))) =>
            {
                &[TargetPass::Both][..]
            }
            _ => &[TargetPass::Left, TargetPass::Right],
        };
        for eye in eyes {
            passes.insert(*eye, Records::default());
        }
        let mut shadow_sizes: HashMap<u32, (Placement, [u32; 2])> = HashMap::new();
        let mut triangles = 0;
        for draw in merged {
            if let StereoDraw::Shadow(executed) = draw
                && let Some(info) = session.draw(executed.draw)
            {
                let view = viewport(info);
                let of = (
                    Placement::new(view),
                    super::places::both([Placement::new(view); 2]),
                );
                shadow_sizes.entry(executed.pass).or_insert(of);
            }
            triangles += self.draw(
                session,
                draw,
                records,
                placements,
                &shadow_sizes,
                &mut passes,
            )?;
        }
        for (into, of) in passes {
            let (kind, eye, size_px) = match into {
                TargetPass::Left => (PassKind::Main, Some(Eye::Left), size_px),
                TargetPass::Right => (PassKind::Main, Some(Eye::Right), size_px),
                TargetPass::Both => (PassKind::Main, None, size_px),
                TargetPass::Shadow(pass) => {
                    let size = shadow_sizes.get(&pass).map_or(size_px, |(_, size)| *size);
                    (PassKind::Shadow, None, size)
                }
            };
            if kind == PassKind::Shadow && of.quads.is_empty() {
                continue;
            }
            self.recorder.begin_pass(pass(number, kind, eye, size_px))?;
            self.recorder.records(RawRecords {
                quads: &of.quads,
                depths: &of.depths,
            })?;
            let counts = self.recorder.end_pass()?.counts;
            if let Some(eye) = eye {
                self.eye_fragments[eye as usize] += counts.fragments;
            }
            self.counts += counts;
        }
        Ok(triangles)
    }

    /// Adds a draw and its records. Returns its number of triangles.
    fn draw(
        &mut self,
        session: &Session,
        merged: &StereoDraw,
        records: &HashMap<u32, Vec<RawSample>>,
        placements: [Placement; 2],
        shadows: &HashMap<u32, (Placement, [u32; 2])>,
        passes: &mut BTreeMap<TargetPass, Records>,
    ) -> Result<u64, DrainError> {
        let parts = merged.parts();
        let Some((info, shader)) = parts.iter().find_map(|(executed, _)| {
            let info = session.draw(executed.draw)?;
            Some((info, session.shader_of(info)?))
        }) else {
            return Ok(0);
        };
        let of_part = |executed: &Executed| -> &[RawSample] {
            records.get(&executed.draw).map_or(&[], Vec::as_slice)
        };
        let parts_records: Vec<&[RawSample]> = parts
            .iter()
            .map(|(executed, _)| of_part(executed))
            .collect();
        let mut used = Groups::new();
        let mut most = 0;
        for record in parts_records.iter().copied().flatten() {
            used.extend(site(shader, record).map(|(_, key)| key));
            most = most.max(record.primitive.saturating_add(1));
        }
        self.count_left_out(shader, parts_records.iter().copied().flatten());
        let triangles = most.max(primitives(info).saturating_mul(info.instances.max(1)));
        let draws = self.declare(session, info, shader, &used, &parts_records, triangles)?;
        let replay = draws.replay;
        for (executed, part) in &parts {
            let quads = quads(shader, &draws, of_part(executed));
            for (view, quad) in quads {
                let (into, placement) = match *part {
                    RecordTarget::Eye(Eye::Left) => (TargetPass::Left, placements[0]),
                    RecordTarget::Eye(Eye::Right) => (TargetPass::Right, placements[1]),
                    RecordTarget::Both => (TargetPass::Both, placements[0]),
                    RecordTarget::Layers(layers) => {
                        match layers.iter().position(|layer| *layer == view) {
                            Some(0) => (TargetPass::Left, placements[0]),
                            Some(_) => (TargetPass::Right, placements[1]),
                            None => continue,
                        }
                    }
                    RecordTarget::Pass(pass) => match shadows.get(&pass) {
                        Some((placement, _)) => (TargetPass::Shadow(pass), *placement),
                        None => continue,
                    },
                };
                quad.place(placement, replay, passes.entry(into).or_default());
            }
        }
        Ok(triangles.into())
    }

    /// Counts texture accesses that a trace cannot represent.
    fn count_left_out<'r>(
        &mut self,
        shader: &ShaderInfo,
        records: impl Iterator<Item = &'r RawSample>,
    ) {
        let mut counts: BTreeMap<u16, u64> = BTreeMap::new();
        for record in records {
            *counts.entry(record.group()).or_default() += u64::from(record.lanes().count_ones());
        }
        for site in &shader.sites {
            if let (What::LeftOut(what), Some(fragments)) = (&site.what, counts.get(&site.group)) {
                self.leave_out(what, 1, *fragments);
            }
        }
    }

    /// Adds the draws for a draw of the program. There are several if it has more groups than fit one draw.
    fn declare(
        &mut self,
        session: &Session,
        info: &DrawInfo,
        shader: &ShaderInfo,
        used: &Groups,
        records: &[&[RawSample]],
        primitives: u32,
    ) -> Result<Declared, DrainError> {
        let mut made: BTreeMap<GroupKey, (Group, Vec<UvGroup>)> = BTreeMap::new();
        for &key in used {
            match self.group(session, info, shader, key) {
                Ok(group) => {
                    made.insert(key, group);
                }
                Err(why) => self.leave_out(&why, 1, 0),
            }
        }
        let sizes: BTreeMap<GroupKey, usize> = (made.iter())
            .map(|(key, (_, groups))| (*key, groups.len()))
            .collect();
        let quads = if size(used, &sizes) <= MAX_GROUPS {
            OfPrimitives::from([(0, BTreeSet::from([used.clone()]))])
        } else {
            self.groups_of_quads(shader, records, &sizes)
        };
        let mut declared = Declared {
            portions: Vec::new(),
            replay: replay(info, shader.tests),
        };
        let next = self.pipelines.len() as u32 + 1;
        let pipeline = *self.pipelines.entry(info.pipeline).or_insert(next);
        for portion in portions(&quads, &sizes, primitives) {
            let mut draws = Vec::new();
            for keys in portion.draws {
                let is_first = declared.portions.is_empty() && draws.is_empty();
                let rest = if is_first { "" } else { ", more coordinates" };
                let mut groups = HashMap::new();
                let mut uv_groups: Vec<UvGroup> = Vec::new();
                for key in keys {
                    let Some((group, of)) = made.get(&key) else {
                        continue;
                    };
                    let mut group = group.clone();
                    group.number += uv_groups.len() as u8;
                    uv_groups.extend(of.iter().cloned());
                    groups.insert(key, group);
                }
                let first = self.next_primitive;
                let primitives = portion.primitives.len() as u32;
                self.next_primitive = first.saturating_add(primitives);
                let draw = Draw {
                    material: format!("pipeline {pipeline}{rest}"),
                    first_primitive: first,
                    primitives,
                    groups: uv_groups,
                };
                let index = self.recorder.draw(draw, declared.replay)?;
                self.opaque.push(!info.twice && !info.blends);
                draws.push(DeclaredDraw {
                    index,
                    first,
                    groups,
                });
            }
            declared.portions.push(DeclaredPortion {
                start: portion.primitives.start,
                draws,
            });
        }
        Ok(declared)
    }

    /// The groups of the quads of each primitive. Names the fragments of quads with too many for one draw.
    fn groups_of_quads(
        &mut self,
        shader: &ShaderInfo,
        records: &[&[RawSample]],
        sizes: &BTreeMap<GroupKey, usize>,
    ) -> OfPrimitives {
        let mut of_primitives = OfPrimitives::new();
        let mut divided = 0;
        for records in records {
            let mut keys: Vec<_> = (records.iter())
                .filter_map(|record| Some((place(record), site(shader, record)?.1, record.lanes())))
                .collect();
            keys.sort_unstable();
            for quad in keys.chunk_by(|a, b| a.0 == b.0) {
                let groups: Groups = quad.iter().map(|(_, key, _)| *key).collect();
                if size(&groups, sizes) > MAX_GROUPS {
                    let lanes = quad.iter().fold(0, |lanes, (_, _, of)| lanes | of);
                    divided += u64::from(lanes.count_ones());
                }
                let primitive = (quad[0].0 >> 32) as u32;
                of_primitives.entry(primitive).or_default().insert(groups);
            }
        }
        if divided > 0 {
            self.leave_out(DIVIDED, 1, divided);
        }
        of_primitives
    }

    fn group(
        &mut self,
        session: &Session,
        info: &DrawInfo,
        shader: &ShaderInfo,
        (coordinates, element): GroupKey,
    ) -> Result<(Group, Vec<UvGroup>), String> {
        Group::new(shader, coordinates, element, |texture| {
            self.bound(session, &info.textures, texture, element)
        })
    }

    /// The texture and sampler that a site reads, among the textures of a draw.
    pub fn bound(
        &mut self,
        session: &Session,
        textures: &[TextureInfo],
        site: &TextureSite,
        element: Option<u32>,
    ) -> Result<Bound, String> {
        let find = |binding: &spool::Binding| {
            let wanted = binding.element.or(element).unwrap_or(0);
            textures.iter().find(|texture| {
                (texture.set, texture.binding, texture.element)
                    == (binding.set, binding.binding, wanted)
            })
        };
        let view = find(&site.image).and_then(|texture| texture.view);
        let view = view.ok_or("textures whose descriptor is not known")?;
        let image = session
            .image(view.image)
            .ok_or("textures whose image is not known")?;
        let format = || format!("textures of format {:?}", vk::Format::from_raw(view.format));
        let found = self.textures.get(&mut self.recorder, &view, image);
        let (index, size) = found.map_err(|e| e.to_string())?.ok_or_else(format)?;
        let state = site.sampler.as_ref().and_then(|s| find(s)?.sampler);
        let unnormalized = state.is_some_and(|state| state.unnormalized);
        let state = match (site.access, state) {
            (Access::Fetch, _) => FETCH,
            (Access::Gather, Some(state)) => gathering(sampler(&state, &view)),
            (_, Some(state)) => sampler(&state, &view),
            (_, None) => return Err("textures whose sampler is not known".to_owned()),
        };
        Ok(Bound {
            texture: index,
            sampler: self.recorder.sampler(state).map_err(|e| e.to_string())?,
            size,
            unnormalized,
            anisotropic: state.is_anisotropic(),
        })
    }
}

/// Number of primitives of a draw call; 0 for indirect draws.
pub fn primitives(info: &DrawInfo) -> u32 {
    use vk::PrimitiveTopology as Kind;
    let vertices = info.vertices;
    match Kind::from_raw(info.topology) {
        Kind::POINT_LIST => vertices,
        Kind::LINE_LIST => vertices / 2,
        Kind::LINE_STRIP => vertices.saturating_sub(1),
        Kind::TRIANGLE_LIST => vertices / 3,
        Kind::TRIANGLE_STRIP | Kind::TRIANGLE_FAN => vertices.saturating_sub(2),
        _ => 0,
    }
}

/// Depth test between the primitives of a draw that must be repeated. If fragments may be discarded, the
/// recording draw writes no depth, so the driver has not tested its primitives against each other. The same holds
/// with alpha to coverage, but there no record tells which samples a fragment covers, so it hides none.
fn replay(info: &DrawInfo, tests: DepthTests) -> DepthReplay {
    if tests != DepthTests::EarlyLateWrite || !info.depth.tests || !info.depth.writes {
        return DepthReplay::None;
    }
    match vk::CompareOp::from_raw(info.depth.compare) {
        vk::CompareOp::LESS => DepthReplay::Less,
        vk::CompareOp::LESS_OR_EQUAL => DepthReplay::LessOrEqual,
        vk::CompareOp::GREATER => DepthReplay::Greater,
        vk::CompareOp::GREATER_OR_EQUAL => DepthReplay::GreaterOrEqual,
        // With these comparisons, written depths do not affect the test.
        _ => DepthReplay::None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use spool::DepthInfo;

    #[test]
    fn only_draws_that_may_discard_repeat_the_depth_test() {
        let info = DrawInfo {
            twice: true,
            depth: DepthInfo {
                tests: true,
                writes: true,
                compare: vk::CompareOp::LESS.as_raw(),
                stencil: false,
            },
            ..DrawInfo::default()
        };
        assert_eq!(replay(&info, DepthTests::EarlyLateWrite), DepthReplay::Less);
        // Alpha to coverage: the sites of such a shader need not record depth.
        assert_eq!(replay(&info, DepthTests::Either), DepthReplay::None);
    }
}
