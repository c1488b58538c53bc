//! Frames, passes and draws of a captured program.

use parallax_layer::inject::{Form, RawSample, Site, What};
use parallax_layer::spool::{
    DrawInfo, Event, ImageInfo, PassInfo, Process, ReadError, Reader, ShaderInfo, Span,
};
use std::collections::{BTreeMap, HashMap};
use std::path::Path;
use thiserror::Error;

/// Why a capture has nothing to make a trace of.
#[derive(Debug, Error)]
pub enum SessionError {
    /// Files that cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The layer was never loaded.
    #[error(
        "{0} never used Vulkan through the layer: is it a program of Vulkan, or of OpenGL on zink (--gl)?"
    )]
    NoProcess(String),
    /// No device was opened.
    #[error("{0} opened no Vulkan device")]
    NoDevice(String),
    /// The device cannot be recorded on.
    #[error("{program}: {why}")]
    Refused {
        /// The program.
        program: String,
        /// The layer's message.
        why: String,
    },
    /// None of the frames was rendered.
    #[error(
        "{program}: frames {first} to {last} were asked for, and it ended {counted} frames (--frames, --frames-by); {ended}"
    )]
    TooFew {
        /// The program.
        program: String,
        /// First requested frame.
        first: u32,
        /// Last one.
        last: u32,
        /// Frames that it ended.
        counted: u32,
        /// How it ended itself.
        ended: String,
    },
    /// A frame without a draw.
    #[error(
        "frame {0}: nothing was drawn; a page must start its session itself, because nothing clicks its buttons"
    )]
    NotDrawn(u32),
    /// Records were lost.
    #[error(
        "frame {frame}: expected records of {room} bytes or less in a submission, found {lost} bytes more; raise --records"
    )]
    Lost {
        /// Frame.
        frame: u32,
        /// Bytes without room.
        lost: u64,
        /// Bytes of room.
        room: u64,
    },
}

/// A draw as it was executed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Executed {
    /// Number of the draw.
    pub draw: u32,
    /// Number of its pass.
    pub pass: u32,
    /// Fragments that a query of the driver counted.
    pub occlusion: Option<u64>,
}

/// A frame.
#[derive(Clone, Debug, Default)]
pub struct ProgramFrame {
    /// Number.
    pub frame: u32,
    /// Draws in the order of execution.
    pub draws: Vec<Executed>,
    /// Where its records are.
    spans: Vec<Span>,
    /// Records that found no room.
    pub lost_bytes: u64,
    /// The program went on to the next frame.
    pub ended: bool,
}

/// One process of a program.
#[derive(Debug, Default)]
pub struct Session {
    /// The process's command line.
    pub command: Vec<String>,
    /// Name of the device.
    pub device: String,
    /// Driver and version.
    pub driver: String,
    /// Why the device cannot be recorded on.
    pub refused: Option<String>,
    /// Reasons why the capture is incomplete.
    pub troubles: Vec<String>,
    /// Frames by number.
    pub frames: BTreeMap<u32, ProgramFrame>,
    draws: HashMap<u32, DrawInfo>,
    passes: HashMap<u32, PassInfo>,
    images: HashMap<u32, ImageInfo>,
    shaders: HashMap<u32, ShaderInfo>,
    /// Size of the picture of each pass that has one.
    pictures: HashMap<u32, [u32; 2]>,
    process: Option<Process>,
    records: Option<Reader>,
}

impl Session {
    /// Files of a process.
    ///
    /// # Errors
    /// Files that cannot be read.
    pub fn read(process: &Process) -> Result<Self, ReadError> {
        let mut session = Self {
            records: Some(process.records()?),
            process: Some(process.clone()),
            ..Self::default()
        };
        for event in process.events()? {
            session.take(event);
        }
        Ok(session)
    }

    /// The process of a capture that rendered most.
    ///
    /// # Errors
    /// Files that cannot be read, or no process with a device.
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
            Some(why) if session.frames.is_empty() => Err(SessionError::Refused {
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
                ..
            } => {
                // A program may have opened others before and after the one that it renders on.
                if self.device.is_empty() || self.refused.is_some() {
                    (self.device, self.driver, self.refused) = (name, driver, refused);
                }
            }
            Event::Shader(shader) => drop(self.shaders.insert(shader.shader, shader)),
            Event::Image(image) => drop(self.images.insert(image.image, image)),
            Event::Pass(pass) => drop(self.passes.insert(pass.pass, pass)),
            Event::Draw(draw) => drop(self.draws.insert(draw.draw, draw)),
            Event::Submit {
                frame,
                draws,
                records,
                lost_bytes,
                occlusion,
            } => {
                let counted: HashMap<u32, u64> = occlusion.into_iter().collect();
                let of = self.frames.entry(frame).or_default();
                of.frame = frame;
                of.lost_bytes += lost_bytes;
                of.spans.push(records);
                of.draws
                    .extend(draws.into_iter().map(|[draw, pass]| Executed {
                        draw,
                        pass,
                        occlusion: counted.get(&draw).copied(),
                    }));
            }
            Event::Frame { frame } => {
                if let Some(of) = self.frames.get_mut(&frame) {
                    of.ended = true;
                }
            }
            Event::Picture { pass, size } => drop(self.pictures.insert(pass, size)),
            Event::Trouble { what } => self.troubles.push(what),
            Event::Closed => {}
        }
    }

    /// A draw.
    #[must_use]
    pub fn draw(&self, number: u32) -> Option<&DrawInfo> {
        self.draws.get(&number)
    }

    /// A pass.
    #[must_use]
    pub fn pass(&self, number: u32) -> Option<&PassInfo> {
        self.passes.get(&number)
    }

    /// Size and texels, red, green, blue and alpha, of the picture of a pass.
    #[must_use]
    pub fn picture(&self, pass: u32) -> Option<([u32; 2], Vec<u8>)> {
        let size = *self.pictures.get(&pass)?;
        Some((size, self.process.as_ref()?.picture(pass).ok()?))
    }

    /// An image.
    #[must_use]
    pub fn image(&self, number: u32) -> Option<&ImageInfo> {
        self.images.get(&number)
    }

    /// A recording shader.
    #[must_use]
    pub fn shader(&self, number: u32) -> Option<&ShaderInfo> {
        self.shaders.get(&number)
    }

    /// Recording shader of a draw.
    #[must_use]
    pub fn shader_of(&self, draw: &DrawInfo) -> Option<&ShaderInfo> {
        self.shader(draw.shader?)
    }

    /// Records of a frame, by draw, in the order in which they were written.
    ///
    /// # Errors
    /// Records that cannot be read.
    pub fn records(&mut self, frame: u32) -> Result<HashMap<u32, Vec<RawSample>>, ReadError> {
        let mut by_draw: HashMap<u32, Vec<RawSample>> = HashMap::new();
        let spans = self
            .frames
            .get(&frame)
            .map_or(&[][..], |frame| &frame.spans);
        let Some(reader) = &mut self.records else {
            return Ok(by_draw);
        };
        for span in spans {
            reader.read(*span, |record| {
                by_draw.entry(record.draw).or_default().push(record);
            })?;
        }
        Ok(by_draw)
    }
}

/// Coordinate group whose records contain every started fragment of a shader.
#[must_use]
pub fn coverage_group(shader: &ShaderInfo) -> Option<u16> {
    let covers = |site: &&Site| site.unconditional && site.form == Form::Quad;
    let sites = &shader.sites;
    // The site that was made for it has the depth as well.
    let own = sites.iter().find(|site| site.what == What::Coverage);
    let found = own.or_else(|| sites.iter().find(covers));
    found.map(|site| site.group)
}

/// Coordinate group whose records contain every fragment that was not discarded, if fragments may be
/// discarded.
#[must_use]
pub fn survival_group(shader: &ShaderInfo) -> Option<u16> {
    let mut sites = shader.sites.iter();
    let found = sites.find(|site| site.what == What::Survival);
    found.map(|site| site.group)
}
