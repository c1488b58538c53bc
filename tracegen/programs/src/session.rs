//! Frames, render passes and draws of a captured program.

use crate::reads::Reads;
use crate::views::{Other, Role};
use spool::openxr::ShownEye;
use spool::{DepthTests, Form, RawSample, Site, What};
use spool::{
    DispatchInfo, DrawInfo, Event, ImageInfo, PassInfo, Process, ReadError, Reader, ShaderInfo,
    Span,
};
use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::Path;
use thiserror::Error;

/// Reasons why a capture has no data for a trace.
#[derive(Debug, Error)]
pub enum SessionError {
    /// The files cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The program did not load the layer.
    #[error("{0} never used Vulkan through the layer")]
    NoProcess(String),
    /// The program opened no device.
    #[error("{0} opened no Vulkan device")]
    NoDevice(String),
    /// Recording is not possible on the device.
    #[error("{program}: {why}")]
    Refused {
        /// Name of the program.
        program: String,
        /// The layer's message.
        why: String,
    },
    /// None of the requested frames was rendered.
    #[error(
        "{program}: frames {first} to {last} were asked for, and it ended {counted} frames (--frames, --frames-by)"
    )]
    TooFew {
        /// Name of the program.
        program: String,
        /// First requested frame.
        first: u32,
        /// Last requested frame.
        last: u32,
        /// Number of frames that the program ended.
        counted: u32,
    },
    /// A frame without draws.
    #[error(
        "frame {0}: nothing was drawn. A page may still be loading: try a later frame. A page that waits for a click never draws: it must start its session itself"
    )]
    NotDrawn(u32),
    /// Records were lost.
    #[error(
        "frame {frame}: expected records of {room} bytes or less in a submission, found {lost} bytes more; raise --records"
    )]
    Lost {
        /// Frame.
        frame: u32,
        /// Number of bytes that were lost.
        lost: u64,
        /// Size of the record buffer in bytes.
        room: u64,
    },
}

/// An executed draw.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Executed {
    /// Number of the draw.
    pub draw: u32,
    /// Number of its render pass.
    pub pass: u32,
    /// Number of fragments counted by an occlusion query.
    pub occlusion: Option<u64>,
    /// Whether a submission executed it several times, so that its records are those of all executions.
    pub repeated: bool,
}

/// A frame of a program.
#[derive(Clone, Debug, Default)]
pub struct ProgramFrame {
    /// Number.
    pub frame: u32,
    /// Draws in the order of execution.
    pub draws: Vec<Executed>,
    /// Spans of its records, each with the new numbers of draws that were executed before.
    spans: Vec<(Span, HashMap<u32, u32>)>,
    /// Numbers of its draws.
    numbers: HashSet<u32>,
    /// Source and destination of each copy between images.
    pub copies: Vec<[u32; 2]>,
    /// The same by array layer.
    pub copied_layers: Vec<[u32; 4]>,
    /// Images of which one texel alone was copied to a buffer.
    pub probed: Vec<u32>,
    /// Number of bytes of records that did not fit the buffer.
    pub lost_bytes: u64,
    /// Whether the program ended the frame.
    pub ended: bool,
    /// Microseconds since the end of the previous frame.
    pub took_us: u64,
}

/// A process of a captured program.
#[derive(Debug, Default)]
pub struct Session {
    /// Command line of the process.
    pub command: Vec<String>,
    /// Name of the device.
    pub device: String,
    /// Driver and version.
    pub driver: String,
    /// Reason why recording is not possible on the device, if any.
    pub refused: Option<String>,
    /// Whether the process is a browser with a page. The script in the page reads one pixel of each
    /// canvas after each frame. The browser reads its whole window.
    pub is_page: bool,
    /// Problems that make the capture incomplete.
    pub troubles: Vec<String>,
    /// Frames by number.
    pub frames: BTreeMap<u32, ProgramFrame>,
    /// Microseconds of each frame that was not recorded.
    pub before_us: Vec<u64>,
    /// Texture reads that are not recorded.
    pub reads: Reads,
    /// Whether the program's waits separate its frames.
    pub by_waits: bool,
    /// Number of frames that ended, up to the last requested one.
    pub ended: u32,
    /// The pictures that an OpenXR program showed to the eyes, by frame.
    pub shown: BTreeMap<u32, [ShownEye; 2]>,
    draws: HashMap<u32, DrawInfo>,
    passes: HashMap<u32, PassInfo>,
    images: HashMap<u32, ImageInfo>,
    shaders: HashMap<u32, ShaderInfo>,
    /// Size of the picture of each render pass that has one.
    pictures: HashMap<u32, [u32; 2]>,
    /// Whether the program draws through OpenGL on Vulkan.
    opengl: bool,
    process: Option<Process>,
    records: Option<Reader>,
    /// Number of draws with new numbers.
    renumbered: u32,
}

impl Session {
    /// Reads the files of a process.
    ///
    /// # Errors
    /// The files cannot be read.
    pub fn read(process: &Process) -> Result<Self, ReadError> {
        let mut session = Self {
            records: Some(process.records()?),
            process: Some(process.clone()),
            ..Self::default()
        };
        let events = process.events()?;
        let is_frame = |event: &Event| matches!(event, Event::Frame { .. });
        let is_wait = |event: &Event| matches!(event, Event::Waited { .. });
        // Presents or readbacks separate the frames of a program that has any.
        session.by_waits = events.iter().any(is_wait) && !events.iter().any(is_frame);
        for event in events {
            session.take(event);
        }
        Ok(session)
    }

    /// The process of a capture that rendered the most draws.
    ///
    /// # Errors
    /// The files cannot be read, or no process opened a device.
    pub fn of_capture(folder: &Path, program: &str) -> Result<Self, SessionError> {
        let mut sessions = Vec::new();
        for process in Process::all(folder)? {
            sessions.push(Self::read(&process)?);
        }
        if sessions.is_empty() {
            return Err(SessionError::NoProcess(program.to_owned()));
        }
        let work = |session: &Self| {
            let draws: usize = session.frames.values().map(|frame| frame.draws.len()).sum();
            (draws, session.refused.is_none(), !session.device.is_empty())
        };
        let session = sessions.into_iter().max_by_key(work).unwrap_or_default();
        if session.device.is_empty() {
            return Err(SessionError::NoDevice(program.to_owned()));
        }
        match &session.refused {
            Some(why) if work(&session).0 == 0 => Err(SessionError::Refused {
                program: program.to_owned(),
                why: why.clone(),
            }),
            _ => Ok(session),
        }
    }

    pub(crate) fn take(&mut self, event: Event) {
        match event {
            Event::Process { command, .. } => self.command = command,
            Event::Device {
                name,
                driver,
                refused,
                opengl,
                ..
            } => {
                // The program may have opened other devices without rendering on them.
                if self.device.is_empty() || self.refused.is_some() {
                    (self.device, self.driver, self.refused) = (name, driver, refused);
                    self.opengl = opengl;
                }
            }
            Event::Shader(shader) => drop(self.shaders.insert(shader.shader, shader)),
            Event::Image(image) => drop(self.images.insert(image.image, image)),
            Event::Pass(pass) => drop(self.passes.insert(pass.pass, pass)),
            Event::Draw(draw) => drop(self.draws.insert(draw.draw, draw)),
            Event::Submit {
                frame,
                frame_by_waits,
                draws,
                records,
                lost_bytes,
                occlusion,
                dispatches,
            } => {
                let Some(frame) = (if self.by_waits {
                    frame_by_waits
                } else {
                    Some(frame)
                }) else {
                    return;
                };
                self.count_reads(frame, &draws, &dispatches);
                if draws.is_empty() {
                    return;
                }
                self.submission(frame, &draws, &occlusion.into_iter().collect(), records);
                self.frames.entry(frame).or_default().lost_bytes += lost_bytes;
            }
            Event::Copies {
                frame,
                pairs,
                layers,
                probed,
            } => {
                let of = self.frames.entry(frame).or_default();
                of.frame = frame;
                of.copies.extend(pairs);
                of.copied_layers.extend(layers);
                of.probed.extend(probed);
            }
            Event::Frame { frame, took_us } => self.end_frame(frame, took_us),
            Event::Waited { frame, took_us } => {
                if self.by_waits {
                    self.end_frame(frame, took_us);
                }
            }
            Event::Shown { frame, eyes } => drop(self.shown.insert(frame, eyes)),
            Event::Picture { pass, size } => drop(self.pictures.insert(pass, size)),
            Event::Trouble { what } => self.troubles.push(what),
            Event::Closed => {}
        }
    }

    fn end_frame(&mut self, frame: u32, took_us: u64) {
        self.ended += 1;
        match self.frames.get_mut(&frame) {
            Some(of) => (of.ended, of.took_us) = (true, took_us),
            None => self.before_us.push(took_us),
        }
    }

    /// Counts the texture reads of a submission that are not recorded.
    fn count_reads(&mut self, frame: u32, draws: &[[u32; 2]], dispatches: &[DispatchInfo]) {
        for [draw, pass] in draws {
            let views = self.passes.get(pass).map_or(0, |of| of.view_mask);
            if let Some(draw) = self.draws.get(draw) {
                self.reads.draw(frame, draw, views.count_ones().max(1));
            }
        }
        for dispatch in dispatches {
            self.reads.dispatch(frame, dispatch);
        }
    }

    /// Adds the draws of a submission. A command buffer may be executed several times: each further execution
    /// in a frame is a draw with a new number. Those in one submission share their records.
    fn submission(
        &mut self,
        frame: u32,
        draws: &[[u32; 2]],
        counted: &HashMap<u32, u64>,
        records: Span,
    ) {
        let mut passes: HashMap<u32, Vec<u32>> = HashMap::new();
        for [draw, pass] in draws {
            passes.entry(*draw).or_default().push(*pass);
        }
        let mut new_numbers: HashMap<u32, u32> = HashMap::new();
        for &[draw, pass] in draws {
            let of = &passes[&draw];
            let repeated = of.len() > 1;
            let in_one_pass = of.iter().all(|other| *other == pass);
            if repeated && in_one_pass && new_numbers.contains_key(&draw) {
                continue;
            }
            let mut number = draw;
            if repeated
                || self
                    .frames
                    .get(&frame)
                    .is_some_and(|f| f.numbers.contains(&draw))
            {
                // The layer numbers draws from 0.
                number = u32::MAX - self.renumbered;
                self.renumbered += 1;
                new_numbers.insert(draw, number);
                if let Some(mut info) = self.draws.get(&draw).cloned() {
                    info.draw = number;
                    if repeated && in_one_pass {
                        info.caveats.push(REPEATED.to_owned());
                    } else if repeated && info.unrecorded.is_none() {
                        // The records do not tell the passes apart.
                        info.unrecorded = Some(REPEATED.to_owned());
                        info.shader = None;
                    }
                    self.draws.insert(number, info);
                }
            }
            let of = self.frames.entry(frame).or_default();
            of.numbers.insert(number);
            of.draws.push(Executed {
                draw: number,
                pass,
                occlusion: counted.get(&draw).copied(),
                repeated,
            });
        }
        let of = self.frames.entry(frame).or_default();
        of.frame = frame;
        of.spans.push((records, new_numbers));
    }

    /// The draw with a number.
    pub fn draw(&self, number: u32) -> Option<&DrawInfo> {
        self.draws.get(&number)
    }

    /// The render pass with a number.
    pub fn pass(&self, number: u32) -> Option<&PassInfo> {
        self.passes.get(&number)
    }

    /// Whether a draw fills its image from the lowest row: OpenGL draws like that, except into a window. A browser's
    /// window is an image of its own.
    pub fn is_bottom_up(&self, draw: &DrawInfo, role: Option<Role>) -> bool {
        let is_browser = role == Some(Role::Other(Other::Browser));
        self.opengl && (draw.viewport[3] > 0.0 || is_browser)
    }

    /// Size and RGBA texels of the picture of a render pass.
    pub fn picture(&self, pass: u32) -> Option<([u32; 2], Vec<u8>)> {
        let size = *self.pictures.get(&pass)?;
        Some((size, self.process.as_ref()?.picture(pass).ok()?))
    }

    /// The image with a number.
    pub fn image(&self, number: u32) -> Option<&ImageInfo> {
        self.images.get(&number)
    }

    /// The recording shader with a number.
    pub fn shader(&self, number: u32) -> Option<&ShaderInfo> {
        self.shaders.get(&number)
    }

    /// Recording shader of a draw.
    pub fn shader_of(&self, draw: &DrawInfo) -> Option<&ShaderInfo> {
        self.shader(draw.shader?)
    }

    /// A frame with at least one draw.
    ///
    /// # Errors
    /// Nothing was drawn in the frame.
    pub fn drawn(&self, number: u32) -> Result<ProgramFrame, SessionError> {
        let frame = self.frames.get(&number).cloned();
        frame
            .filter(|frame| !frame.draws.is_empty())
            .ok_or(SessionError::NotDrawn(number))
    }

    /// Whether the fragment shader of a draw affects anything: colours, or the fragments that pass. Graphics
    /// hardware does not run other fragment shaders.
    pub fn is_shaded(&self, executed: &Executed) -> bool {
        let Some(draw) = self.draw(executed.draw) else {
            return false;
        };
        let colors = self.pass(executed.pass).map_or(0, |pass| pass.colors.len());
        let shader = self.shader_of(draw);
        (0..colors).any(|place| writes_color(draw, place))
            || draw.twice
            || shader.is_some_and(|shader| shader.tests != DepthTests::Either)
    }

    /// Records of fragments of a frame by draw, in recording order.
    ///
    /// # Errors
    /// The records cannot be read.
    pub fn records(&mut self, frame: u32) -> Result<HashMap<u32, Vec<RawSample>>, ReadError> {
        self.records_with(frame, |record| !record.is_vertex())
    }

    /// Records of vertices of a frame by draw, in recording order.
    ///
    /// # Errors
    /// The records cannot be read.
    pub fn vertex_records(
        &mut self,
        frame: u32,
    ) -> Result<HashMap<u32, Vec<RawSample>>, ReadError> {
        self.records_with(frame, RawSample::is_vertex)
    }

    fn records_with(
        &mut self,
        frame: u32,
        is_wanted: impl Fn(&RawSample) -> bool,
    ) -> Result<HashMap<u32, Vec<RawSample>>, ReadError> {
        let mut by_draw: HashMap<u32, Vec<RawSample>> = HashMap::new();
        let spans = self
            .frames
            .get(&frame)
            .map_or(&[][..], |frame| &frame.spans);
        let Some(reader) = &mut self.records else {
            return Ok(by_draw);
        };
        for (span, new_numbers) in spans {
            reader.read(*span, |mut record| {
                if !is_wanted(&record) {
                    return;
                }
                record.draw = *new_numbers.get(&record.draw).unwrap_or(&record.draw);
                by_draw.entry(record.draw).or_default().push(record);
            })?;
        }
        Ok(by_draw)
    }
}

/// Whether a draw writes a colour attachment.
pub fn writes_color(draw: &DrawInfo, place: usize) -> bool {
    draw.color_masks.get(place).is_none_or(|mask| *mask != 0)
}

/// Reason why the records of a draw are less exact, or missing if its passes differ.
pub const REPEATED: &str = "a submission executed the draw several times";

/// Coordinate group whose records contain every started fragment of a shader.
pub fn coverage_group(shader: &ShaderInfo) -> Option<u16> {
    let covers = |site: &&Site| site.unconditional && site.form == Form::Quad;
    let sites = &shader.sites;
    // A separate coverage site also has the depth.
    let own = sites.iter().find(|site| site.what == What::Coverage);
    let found = own.or_else(|| sites.iter().find(covers));
    found.map(|site| site.group)
}

/// Coordinate group whose records contain every fragment that was not discarded, if fragments may be
/// discarded.
pub fn survival_group(shader: &ShaderInfo) -> Option<u16> {
    let mut sites = shader.sites.iter();
    let found = sites.find(|site| site.what == What::Survival);
    found.map(|site| site.group)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn submit(session: &mut Session, draws: &[[u32; 2]]) {
        session.take(Event::Submit {
            frame: 0,
            draws: draws.to_vec(),
            records: Span::default(),
            lost_bytes: 0,
            occlusion: Vec::new(),
            frame_by_waits: None,
            dispatches: Vec::new(),
        });
    }

    #[test]
    fn further_executions_of_a_draw_in_a_frame_are_draws_of_their_own() {
        let mut session = Session::default();
        let shader = Some(0);
        session.take(Event::Draw(DrawInfo {
            draw: 7,
            shader,
            ..DrawInfo::default()
        }));
        // Twice in two submissions; twice in one pass of a submission; in two passes of a submission.
        submit(&mut session, &[[7, 0]]);
        submit(&mut session, &[[7, 0]]);
        submit(&mut session, &[[7, 1], [7, 1]]);
        submit(&mut session, &[[7, 2], [7, 3]]);
        let draws = &session.frames[&0].draws;
        let found: Vec<_> = draws
            .iter()
            .map(|draw| (draw.pass, draw.repeated))
            .collect();
        assert_eq!(
            found,
            [(0, false), (0, false), (1, true), (2, true), (3, true)]
        );
        let mut numbers: Vec<u32> = draws.iter().map(|draw| draw.draw).collect();
        let infos: Vec<_> = numbers
            .iter()
            .map(|number| session.draw(*number).unwrap())
            .collect();
        assert!(
            infos
                .iter()
                .zip(&numbers)
                .all(|(info, number)| info.draw == *number)
        );
        let recorded: Vec<_> = infos.iter().map(|info| info.shader.is_some()).collect();
        assert_eq!(recorded, [true, true, true, false, false]);
        assert_eq!(infos[2].caveats, [REPEATED]);
        numbers.sort_unstable();
        numbers.dedup();
        assert_eq!(numbers.len(), 5);
    }

    #[test]
    fn a_shader_that_neither_writes_colours_nor_discards_has_no_effect() {
        let mut session = Session::default();
        let view = spool::ViewInfo {
            image: 1,
            format: 37,
            kind: 1,
            levels: [0, 1],
            layers: [0, 1],
            min_lod_256ths: 0,
        };
        session.take(Event::Pass(PassInfo {
            colors: vec![view; 2],
            ..PassInfo::default()
        }));
        for tests in [DepthTests::Either, DepthTests::Late] {
            session.take(Event::Shader(ShaderInfo {
                shader: tests as u32,
                tests,
                sites: Vec::new(),
            }));
        }
        let cases = [
            ([0, 0], false, DepthTests::Either, false),
            ([0, 15], false, DepthTests::Either, true),
            ([0, 0], true, DepthTests::Either, true),
            ([0, 0], false, DepthTests::Late, true),
        ];
        for (masks, twice, tests, expected) in cases {
            session.take(Event::Draw(DrawInfo {
                color_masks: masks.to_vec(),
                twice,
                shader: Some(tests as u32),
                ..DrawInfo::default()
            }));
            let executed = Executed {
                draw: 0,
                pass: 0,
                occlusion: None,
                repeated: false,
            };
            assert_eq!(
                session.is_shaded(&executed),
                expected,
                "{masks:?} {tests:?}"
            );
        }
    }
}
