//! Converts frames of a session to a trace.

mod frame_builder;
mod images;
mod instances;
mod places;
mod portions;
mod quads;
mod vertex_reads;

use crate::pairs::pair;
use crate::session::{Executed, Session, SessionError, coverage_group};
use crate::views::{self, DrawKey, Role, Rule, Views, ViewsError, Wanted};
use formats::textrace::{
    LeftOut, Pass, PassKind, ProgramCapture, Surfaces, TextraceWriter, TraceMeta, VertexReadCounts,
};
use formats::view::{Eye, EyeView, FovTangents, FrameViews, Hmd, TILE_SIZE_PX};
use frame_builder::{Builder, StereoDraw, primitives};
use places::Placement;
use record::{CaptureCounts, RecordError, Recorder};
use spool::FramesBy;
use spool::{RawSample, TextureInfo};
use std::collections::{BTreeMap, HashMap};
use std::io::{Seek, Write};
use thiserror::Error;
use vertex_reads::ShownDraws;

/// What is known about the eyes.
#[derive(Clone, Debug, Default)]
pub struct Cameras {
    /// Eyes by frame, if the program reported them.
    pub eyes: BTreeMap<u32, [EyeView; 2]>,
    /// The simulated display, if there is one.
    pub display: Option<Hmd>,
}

/// Options for converting a session.
pub struct Job<'a> {
    /// Requested frames, ascending.
    pub frames: &'a [u32],
    /// How the eyes are identified.
    pub eyes: &'a Wanted,
    /// How frames were counted.
    pub frames_by: FramesBy,
    /// What is known about the eyes.
    pub cameras: Cameras,
    /// Name of the program.
    pub program: String,
    /// Tool and version.
    pub tool: String,
    /// Arguments of the tool, without outputs.
    pub command_line: Vec<String>,
    /// Size of the record buffer in bytes, which holds the records of one submission.
    pub record_bytes: u64,
}

/// Summary of the resulting trace.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Drained {
    /// Number of frames.
    pub frames: usize,
    /// Rule that identified the eyes.
    pub rule: Option<Rule>,
    /// Size of an eye's picture in pixels.
    pub size_px: [u32; 2],
    /// Number of draws in the trace.
    pub draws: usize,
    /// Number of textures in the trace.
    pub textures: usize,
    /// Counts of the records.
    pub counts: CaptureCounts,
    /// Fragments of the left and of the right eye; 0 for programs with one picture.
    pub eye_fragments: [u64; 2],
    /// How the capture was divided, and which texture reads it lacks.
    pub program: ProgramCapture,
}

/// Reasons why no trace was made.
#[derive(Debug, Error)]
pub enum DrainError {
    /// An error of the session.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// The eyes could not be identified.
    #[error(transparent)]
    Views(#[from] ViewsError),
    /// The frames have pictures of different sizes.
    #[error(
        "frame {frame}: expected pictures of {expected:?} pixels as in the frames before, found {found:?}"
    )]
    Size {
        /// Frame.
        frame: u32,
        /// Size in the earlier frames.
        expected: [u32; 2],
        /// Size in this frame.
        found: [u32; 2],
    },
    /// No draw of the identified eyes has a record.
    #[error(
        "no draw of either eye was recorded; --check compares the draws with queries, --list names the passes"
    )]
    Nothing,
    /// An error while writing the trace.
    #[error(transparent)]
    Record(#[from] RecordError),
}

impl From<spool::ReadError> for DrainError {
    fn from(error: spool::ReadError) -> Self {
        Self::Session(error.into())
    }
}

/// Converts frames of a session to a trace, which the caller must finish.
///
/// # Errors
/// The eyes cannot be identified, records were lost, or reading or writing failed.
pub fn drain<W: Write + Seek>(
    session: &mut Session,
    job: &Job<'_>,
    writer: TextraceWriter<W>,
) -> Result<(TextraceWriter<W>, Drained), DrainError> {
    let mut builder = Builder::new(Recorder::new(writer, Vec::new()));
    let mut drained = Drained::default();
    let mut triangles = 0;
    let mut shown = Vec::new();
    for &number in job.frames {
        let frame = session.drawn(number)?;
        if frame.lost_bytes > 0 {
            return Err(DrainError::Session(SessionError::Lost {
                frame: number,
                lost: frame.lost_bytes,
                room: job.record_bytes,
            }));
        }
        let mut records = session.records(number)?;
        for draw in &frame.draws {
            if let Some(info) = session.draw(draw.draw)
                && let Some(shader) = session.shader_of(info)
                && let Some(records) = records.get_mut(&draw.draw)
            {
                instances::number(shader, info, primitives(info), records);
            }
        }
        let weights: Vec<u64> = frame
            .draws
            .iter()
            .map(|draw| weight(session, draw, &records))
            .collect();
        // All frames use the rule that matched the first one.
        let known = drained
            .rule
            .filter(|rule| *rule != Rule::File)
            .map(Wanted::Rule);
        let views = views::find(
            session,
            &frame,
            &weights,
            known.as_ref().unwrap_or(job.eyes),
        )?;
        drained.rule = Some(views.rule);
        let placements = views.eyes.map(Placement::new);
        let size_px = places::both(placements);
        if drained.frames > 0 && drained.size_px != size_px {
            return Err(DrainError::Size {
                frame: number,
                expected: drained.size_px,
                found: size_px,
            });
        }
        drained.size_px = size_px;
        drained.frames += 1;
        let merged = merge(session, &frame.draws, &views);
        triangles = builder.frame(session, number, &merged, &records, placements, size_px)?;
        builder.count_ignored(session, &frame.draws, &views, &weights);
        let roles = views.roles.iter().copied();
        shown.push(ShownDraws {
            frame: number,
            draws: frame.draws.iter().copied().zip(roles).collect(),
            layers: views.layers,
        });
    }
    // After all frames, so that they add their textures behind those of the fragments.
    let mut vertex_reads = Vec::new();
    for shown in &shown {
        vertex_reads.extend(vertex_reads::of_frame(session, &mut builder, shown)?);
    }
    drained.counts = builder.counts;
    drained.eye_fragments = builder.eye_fragments;
    if drained.counts.quads == 0 {
        return Err(DrainError::Nothing);
    }
    drained.program = program(session, job, drained.rule, builder.left_out());
    drained.program.vertex_reads = VertexReadCounts::of(&vertex_reads);
    let meta = meta(session, job, &drained, triangles, builder.not_opaque());
    let mut writer = builder.finish(meta)?;
    writer
        .set_vertex_reads(vertex_reads)
        .map_err(RecordError::from)?;
    drained.draws = writer.tables().draws.len();
    drained.textures = writer.tables().textures.len();
    Ok((writer, drained))
}

/// Number of recorded fragments of an executed draw. Counts of queries would make the eyes depend on `--check`.
pub(crate) fn weight(
    session: &Session,
    executed: &Executed,
    records: &HashMap<u32, Vec<RawSample>>,
) -> u64 {
    let group = session
        .draw(executed.draw)
        .and_then(|draw| coverage_group(session.shader_of(draw)?));
    match (group, records.get(&executed.draw)) {
        (Some(group), Some(records)) => {
            let of = records.iter().filter(|record| record.group() == group);
            of.map(|record| u64::from(record.lanes().count_ones()))
                .sum()
        }
        _ => 0,
    }
}

/// Key that is equal for draws that are the same draw of the trace, with their textures.
fn key(session: &Session, draw: u32) -> Option<(DrawKey, &[TextureInfo])> {
    let info = session.draw(draw)?;
    Some((DrawKey::of(info), &info.textures))
}

/// Merges the draws of both eyes in a frame. The result keeps the order of each eye.
fn merge(session: &Session, draws: &[Executed], views: &Views) -> Vec<StereoDraw> {
    let with = |wanted: Role| -> Vec<Executed> {
        let both = draws.iter().zip(&views.roles);
        both.filter(|(draw, role)| **role == wanted && session.is_shaded(draw))
            .map(|(draw, _)| *draw)
            .collect()
    };
    let mut merged: Vec<StereoDraw> = with(Role::Shadow)
        .into_iter()
        .map(StereoDraw::Shadow)
        .collect();
    let layers = views.layers;
    merged.extend(
        with(Role::Multiview)
            .into_iter()
            .map(|draw| StereoDraw::Multiview(draw, layers)),
    );
    merged.extend(with(Role::Seen(None)).into_iter().map(StereoDraw::Mono));
    let [left, right] = [Eye::Left, Eye::Right].map(|eye| with(Role::Seen(Some(eye))));
    let keys =
        |of: &[Executed]| -> Vec<_> { of.iter().map(|draw| key(session, draw.draw)).collect() };
    let pairs = pair(&keys(&left), &keys(&right));
    merged.extend(
        pairs
            .into_iter()
            .map(|(l, r)| StereoDraw::Eyes([l.map(|l| left[l]), r.map(|r| right[r])])),
    );
    merged
}

/// How the capture was divided, and which texture reads it lacks.
fn program(
    session: &Session,
    job: &Job<'_>,
    rule: Option<Rule>,
    left_out: Vec<LeftOut>,
) -> ProgramCapture {
    let frames_by = match job.frames_by {
        FramesBy::Auto if session.by_waits => "waits for the device",
        FramesBy::Auto | FramesBy::Present => "presents",
        FramesBy::Readback => "readbacks",
        FramesBy::Launcher => "the launcher",
        FramesBy::OpenXr => "xrEndFrame",
    };
    let mut frames = job.frames.iter();
    ProgramCapture {
        cameras_known: frames.all(|frame| job.cameras.eyes.contains_key(frame)),
        frames_by: frames_by.to_owned(),
        views_by: rule.map_or("", Rule::name).to_owned(),
        left_out,
        unrecorded_reads: session.reads.of_frames(job.frames),
        vertex_reads: None,
    }
}

fn meta(
    session: &Session,
    job: &Job<'_>,
    drained: &Drained,
    triangles: u64,
    not_opaque: Vec<[u32; 2]>,
) -> TraceMeta {
    let cameras_known = drained.program.cameras_known;
    let first = job
        .frames
        .first()
        .and_then(|frame| job.cameras.eyes.get(frame));
    let (fov, ipd_m) = match first.filter(|_| cameras_known) {
        Some(eyes) => (eyes.map(|eye| fov(&eye)), distance_m(eyes)),
        None => ([PLACEHOLDER_FOV; 2], 0.0),
    };
    TraceMeta {
        tool: job.tool.clone(),
        command_line: job.command_line.clone(),
        scene: job.program.clone(),
        scene_triangles: triangles,
        camera: "program".to_owned(),
        backend: "layer".to_owned(),
        driver: session.driver.clone(),
        seed: 0,
        hmd: Hmd {
            name: match (cameras_known, &job.cameras.display) {
                (true, Some(display)) => display.name.clone(),
                (true, None) => "emulated".to_owned(),
                (false, _) => "unknown".to_owned(),
            },
            source: match &job.cameras.display {
                Some(display) if cameras_known => display.source.clone(),
                _ => "a program's viewports".to_owned(),
            },
            eye_size_px: drained.size_px,
            fov,
            ipd_m,
            cant_deg: (job.cameras.display.as_ref())
                .filter(|_| cameras_known)
                .map_or(0.0, |display| display.cant_deg),
        },
        frames: (job.frames.iter())
            .map(|frame| FrameViews {
                frame: *frame,
                eyes: job.cameras.eyes.get(frame).copied().unwrap_or_default(),
            })
            .collect(),
        surfaces: Some(Surfaces {
            depth_tested: true,
            not_opaque,
        }),
        origin_m: [0.0; 3],
        techniques: None,
        program: Some(drained.program.clone()),
        ..TraceMeta::default()
    }
}

/// Field of view for eyes whose projection is unknown.
const PLACEHOLDER_FOV: FovTangents = FovTangents {
    left: 1.0,
    right: 1.0,
    up: 1.0,
    down: 1.0,
};

/// Tangents of the edges of a projection.
fn fov(eye: &EyeView) -> FovTangents {
    let m = &eye.eye_to_clip;
    let edge = |axis: usize, side: f32| (1.0 + side * m[2][axis]) / m[axis][axis];
    FovTangents {
        left: edge(0, -1.0),
        right: edge(0, 1.0),
        up: edge(1, 1.0),
        down: edge(1, -1.0),
    }
}

/// Distance between two eyes in metres.
fn distance_m(eyes: &[EyeView; 2]) -> f32 {
    let [a, b] = [eyes[0].position, eyes[1].position];
    let squared: f32 = (0..3)
        .map(|axis| (a[axis] - b[axis]) * (a[axis] - b[axis]))
        .sum();
    squared.sqrt()
}

/// A render pass of the trace.
pub(crate) fn pass(frame: u32, kind: PassKind, eye: Option<Eye>, size_px: [u32; 2]) -> Pass {
    Pass {
        frame,
        kind,
        eye,
        layer: 0,
        size_px,
        tiles: size_px.map(|size| size.div_ceil(TILE_SIZE_PX)),
    }
}
