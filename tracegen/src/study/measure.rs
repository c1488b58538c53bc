//! Measures one row: first the content of its frames, then their times next to the baseline's.

use super::counted::texture_bytes;
use super::folder::{Folder, FrameRecord, RowRecord, trace_checksum};
use super::memory;
use super::rows::Row;
use super::timing::{CULL, Extent, median_s, time};
use super::world::{Shot, World};
use formats::textrace::{Encoding, Textrace, TextraceWriter};
use raster::backend::{Fragments, Marks};
use raster::culling_truth::Wrong;
use raster::frame::Frame;
use raster::lavapipe::Lavapipe;
use record::{CaptureCounts, Recorder};
use serde_json::Map;
use shell::Progress;
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::time::Duration;
use techniques::{Planner, Settings};
use visibility::Occlusion;

/// Measures rows on a device.
pub struct Bench<'a> {
    /// Scene and path.
    pub world: &'a mut World,
    /// The device.
    pub backend: &'a mut Lavapipe,
    /// Whether it can capture.
    pub captures: bool,
    /// Frames and repetitions.
    pub extent: &'a Extent,
    /// How the tiles of the traces are packed.
    pub encoding: Encoding,
    /// Draws that are really visible, by frame, as far as they were needed.
    pub truth: HashMap<u32, Vec<Vec<Marks>>>,
    /// Folder of the results.
    pub folder: &'a Folder,
    /// Progress of the study.
    pub progress: &'a Progress,
}

impl Bench<'_> {
    /// Measures a row, whose frames may have different planners.
    ///
    /// # Errors
    /// Driver errors, and errors of writing.
    pub fn measure<'s>(
        &mut self,
        row: &Row,
        planner: impl Fn(u32) -> &'s Planner,
    ) -> anyhow::Result<RowRecord> {
        let can_forget = memory::forget_peak();
        let (mut frames, trace) = self.take(row, &planner)?;
        let advance = || self.progress.advance(1);
        let times = time(self.world, self.backend, self.extent, planner, advance)?;
        for (frame, times) in frames.iter_mut().zip(times) {
            let seconds = |times: &[Duration]| times.iter().map(Duration::as_secs_f64).collect();
            frame.frame_s = seconds(&times.frame);
            frame.baseline_s = seconds(&times.baseline);
            frame.processor_s = seconds(&times.processor);
            frame.baseline_processor_s = seconds(&times.baseline_processor);
            frame.stages_s = (times.stages.iter())
                .map(|(stage, times)| ((*stage).to_owned(), median_s(times).into()))
                .collect();
            frame.cull_s = median_s(&times.stages[CULL]);
        }
        Ok(RowRecord {
            technique: row.name.clone(),
            title: row.title.clone(),
            settings: row.settings.clone(),
            parts: row.parts.iter().map(|part| part.name.to_owned()).collect(),
            lossless: row.lossless,
            frames,
            texture_bytes: Some(self.world.texture_bytes),
            peak_memory_bytes: can_forget.then(memory::peak_bytes).flatten(),
            trace_frames: trace
                .iter()
                .flat_map(|_| self.extent.trace_frames.clone())
                .filter(|frame| !row.settings.reprojects(*frame))
                .collect(),
            trace_checksum: (trace.as_ref())
                .map(|_| trace_checksum(&self.folder.trace(&row.name).1))
                .transpose()?,
            trace,
        })
    }

    /// Everything about a row's frames except their times: counts, pictures, the trace. The driver also
    /// compiles all shaders on the way.
    fn take<'s>(
        &mut self,
        row: &Row,
        planner: &impl Fn(u32) -> &'s Planner,
    ) -> anyhow::Result<(Vec<FrameRecord>, Option<String>)> {
        let extent = self.extent;
        let (kept, left_out): (Vec<u32>, Vec<u32>) = (extent.frames().into_iter())
            // A reprojected frame samples no textures of the scene.
            .filter(|frame| !row.settings.reprojects(*frame))
            .partition(|frame| extent.trace_frames.contains(frame));
        let planned = [&kept, &left_out].map(|frames| self.world.plan_all(planner, frames));
        let [in_trace, others] = planned;
        let (in_trace, others) = (in_trace?, others?);
        let tables = [&in_trace, &others].map(|frames| self.world.tables_of(frames));
        let all = in_trace.into_iter().chain(others);
        let mut planned: HashMap<u32, Frame> = all.map(|frame| (frame.number, frame)).collect();
        let (trace_name, trace_path) = self.folder.trace(&row.name);
        let mut traced = match kept.is_empty() || !self.captures {
            true => None,
            false => Some(Recorder::new(
                TextraceWriter::create(&trace_path, &tables[0])?.with_encoding(self.encoding),
                self.world.draws.replays(Fragments::DepthTested),
            )),
        };
        // Frames outside the trace are captured as well, to count what they sample.
        let mut counted = match left_out.is_empty() || !self.captures {
            true => None,
            false => Some(Recorder::new(
                TextraceWriter::in_memory(&tables[1])?,
                self.world.draws.replays(Fragments::DepthTested),
            )),
        };
        let mut frames = Vec::new();
        let mut memory = Occlusion::default();
        for (number, measured) in extent.rendered(row.settings.remembers()) {
            let (world, backend) = (&mut *self.world, &mut *self.backend);
            let shot = match planned.remove(&number) {
                Some(frame) => world.draw(backend, planner(number), frame, &mut memory)?,
                None => world.shoot(backend, planner(number), number, &mut memory)?,
            };
            if !measured {
                continue;
            }
            let pictures = self.world.pictures(self.backend, &shot)?;
            let size_px = self.world.hmd.eye_size_px;
            let [images, image_checksums] = self
                .folder
                .write_images(&row.name, number, &pictures, size_px)?;
            let job = self.world.job(planner(number));
            let (backend, frame) = (&mut *self.backend, &shot.frame);
            let captured = match (&mut traced, &mut counted) {
                _ if shot.reprojection.is_some() => None,
                (Some(recorder), _) if kept.contains(&number) => {
                    Some(job.capture_frame(backend, frame, recorder)?)
                }
                (_, Some(recorder)) => Some(job.capture_frame(backend, frame, recorder)?),
                _ => None,
            };
            let counts = (self.captures)
                .then(|| captured.map_or_else(CaptureCounts::default, |frame| frame.counts));
            let wrong = self.wrong(number, &shot)?;
            let multiview = row.settings.multiview;
            frames.push(FrameRecord {
                images,
                image_checksums: Some(image_checksums),
                ..frame_record(number, &shot, counts, wrong, multiview)
            });
            self.progress.advance(1);
        }
        let trace = match traced {
            Some(traced) => {
                traced.into_writer()?.finish()?;
                count_textures(&mut frames, &Textrace::open(&trace_path)?)?;
                Some(trace_name)
            }
            None => None,
        };
        if let Some(counted) = counted {
            let trace = Textrace::from_bytes(counted.into_writer()?.into_bytes()?)?;
            count_textures(&mut frames, &trace)?;
        }
        Ok((frames, trace))
    }

    /// Errors of a frame's draw lists compared with what is visible through the lenses, both eyes; none if
    /// the device cannot count fragments.
    fn wrong(&mut self, number: u32, shot: &Shot) -> anyhow::Result<Option<Wrong>> {
        if !self.captures || shot.reprojection.is_some() {
            return Ok(None);
        }
        let planner = self.world.planner(&Settings::default())?;
        let job = self.world.job(&planner);
        let truth = match self.truth.entry(number) {
            Entry::Occupied(known) => known.into_mut(),
            Entry::Vacant(open) => open.insert(job.culling_truth(self.backend, &shot.frame)?),
        };
        let mut wrong = Wrong::default();
        for judgement in job.judge_against(&shot.frame, truth) {
            wrong += judgement.lens;
        }
        Ok(Some(wrong))
    }
}

/// Adds the texture bytes of a trace's frames to their counts.
fn count_textures(frames: &mut [FrameRecord], trace: &Textrace) -> anyhow::Result<()> {
    let bytes = texture_bytes(trace)?;
    for (views, bytes) in trace.tables().meta.frames.iter().zip(bytes) {
        let of_frame = frames.iter_mut().find(|frame| frame.frame == views.frame);
        let Some(frame) = of_frame else { continue };
        if let Some(counted) = &mut frame.counted {
            counted.texture_bytes = bytes;
            frame.memory_bytes = Some(counted.bytes());
            frame.energy_mj = Some(counted.energy_mj());
        }
    }
    Ok(())
}

/// Counts of a rendered frame; its times and images are added later.
fn frame_record(
    number: u32,
    shot: &Shot,
    counts: Option<CaptureCounts>,
    wrong: Option<Wrong>,
    multiview: bool,
) -> FrameRecord {
    let work = &shot.work;
    let targets = shot.frame.plan.target_bytes(multiview);
    FrameRecord {
        frame: number,
        cull_tests: shot.frame.cull_tests + shot.frame.occlusion_tests,
        cull_s: 0.0,
        false_negatives: wrong.map(|wrong| wrong.negatives),
        false_positives: wrong.map(|wrong| wrong.positives),
        draws: work.draws,
        draw_calls: work.calls,
        state_changes: work.state_changes,
        vertices: work.vertices,
        triangles: work.triangles,
        quads: counts.map(|counts| counts.quads),
        fragments: counts.map(|counts| counts.fragments),
        bytes_uploaded: work.bytes_uploaded,
        counted: counts.map(|counts| shot.counted(counts.fragments)),
        // Textures are added when the trace is complete.
        memory_bytes: counts.map(|counts| shot.counted(counts.fragments).bytes()),
        energy_mj: counts.map(|counts| shot.counted(counts.fragments).energy_mj()),
        target_color_bytes: Some(targets.color),
        target_depth_bytes: Some(targets.depth),
        bytes_reprojected: (shot.reprojection.as_ref()).map_or(0, |made| made.bytes),
        frame_s: Vec::new(),
        baseline_s: Vec::new(),
        processor_s: Vec::new(),
        baseline_processor_s: Vec::new(),
        stages_s: Map::new(),
        images: Default::default(),
        image_checksums: Default::default(),
        predicted: shot.frame.plan.predicted,
    }
}
