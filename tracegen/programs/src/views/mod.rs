//! Finds out which draws show which eye. There are rules for common ways of stereo rendering, and files of
//! rules for other programs.

mod file;
mod images;
mod others;
mod rules;
mod shown;

pub use file::{FileError, RuleFile};
pub use others::Other;

use crate::session::{Executed, ProgramFrame, Session, writes_color};
use formats::view::Eye;
use images::Images;
use serde::{Deserialize, Serialize};
use spool::{DepthInfo, DrawInfo, PassInfo, ViewInfo};
use thiserror::Error;

/// How a program renders for two eyes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Rule {
    /// A draw is broadcast to two layers.
    Multiview,
    /// Two viewports of one target.
    Halves,
    /// A target for each eye.
    Targets,
    /// One target for both eyes, one after the other, distinguished by the written colour channels.
    Channels,
    /// One target for both eyes: the same draws twice.
    Twice,
    /// Only one eye.
    Mono,
    /// A file of rules.
    File,
    /// The images that an OpenXR program shows.
    Shown,
}

impl Rule {
    /// The rules that can identify two eyes, in the order in which they are tried.
    pub const ALL: [Self; 5] = [
        Self::Multiview,
        Self::Halves,
        Self::Targets,
        Self::Channels,
        Self::Twice,
    ];

    /// Name in messages.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Multiview => "multiview",
            Self::Halves => "viewport halves",
            Self::Targets => "a target per eye",
            Self::Channels => "colour channels",
            Self::Twice => "equal draws twice",
            Self::Mono => "one eye",
            Self::File => "a file of rules",
            Self::Shown => "the images of xrEndFrame",
        }
    }
}

/// How the eyes are to be identified.
#[derive(Clone, Debug, Default)]
pub enum Wanted {
    /// By the first rule that fits.
    #[default]
    First,
    /// By a certain rule.
    Rule(Rule),
    /// By a file of rules.
    File(RuleFile),
}

/// A rectangle of a target, in pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct View {
    /// Left and top edge.
    pub origin: [i32; 2],
    /// Width and height.
    pub size: [u32; 2],
}

/// Role of a draw in a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Renders the picture of an eye; `None` for a picture that both eyes use.
    Seen(Option<Eye>),
    /// Renders both eyes by multiview.
    Multiview,
    /// Renders a shadow map.
    Shadow,
    /// Not part of a trace.
    Other(Other),
}

impl Role {
    /// Name in messages.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Seen(Some(Eye::Left)) => "left eye",
            Self::Seen(Some(Eye::Right)) => "right eye",
            Self::Seen(None) => "one eye",
            Self::Multiview => "both eyes",
            Self::Shadow => "shadow map",
            Self::Other(other) => other.name(),
        }
    }
}

/// The eyes of a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Views {
    /// Rule that identified the eyes.
    pub rule: Rule,
    /// Rectangles of the left and the right eye in their targets.
    pub eyes: [View; 2],
    /// Numbers of the left and the right eye's view in a multiview pass.
    pub layers: [u32; 2],
    /// Role of each executed draw.
    pub roles: Vec<Role>,
}

/// The eyes of a frame cannot be identified.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum ViewsError {
    /// No rule fits.
    #[error(
        "frame {0}: no two eyes were found, by none of: multiview, viewport halves, a target per eye, colour channels, equal draws \
         twice; --list shows the frame's passes, --eyes names a rule, --eyes mono takes the largest target alone, --rules a file"
    )]
    NoStereo(u32),
    /// The requested rule does not fit.
    #[error("frame {frame}: no two eyes were found by the rule {rule}")]
    NotBy {
        /// Frame.
        frame: u32,
        /// Rule.
        rule: &'static str,
    },
    /// The frame has no draws.
    #[error("frame {0}: nothing was drawn into a colour target")]
    Empty(u32),
    /// A page has drawn nothing into its canvases.
    #[error(
        "frame {0}: the page drew nothing into a canvas of WebGL. It may still be loading: try a later frame. A page that waits for a click \
         never draws: it must start its session itself. A page whose context was lost draws nothing more"
    )]
    EmptyPage(u32),
    /// The eyes of a file's rules have different sizes.
    #[error("frame {frame}: expected eyes of one size, found {left:?} and {right:?} pixels")]
    Sizes {
        /// Frame.
        frame: u32,
        /// Size of the left eye.
        left: [u32; 2],
        /// Size of the right eye.
        right: [u32; 2],
    },
}

/// A draw with the properties that rules use.
struct Drawn<'a> {
    place: usize,
    info: &'a DrawInfo,
    pass: Option<&'a PassInfo>,
    /// Whether its fragment shader has an effect.
    shaded: bool,
    /// Number of its render pass in the frame.
    pass_number: usize,
    /// Number of fragments, used to find the main target of a frame.
    weight: u64,
}

/// Key that is equal for the draws of both eyes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct DrawKey {
    /// What it is drawn with.
    pub program: DrawProgram,
    /// Number of vertices or indices.
    pub vertices: u32,
    /// Number of instances.
    pub instances: u32,
}

/// What two draws have in common although each has a pipeline of its own. Programs create a pipeline for each target.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum DrawProgram {
    /// Number of the recording shader, topology, depth test, and whether colours are blended.
    Shader(u32, i32, DepthInfo, bool),
    /// Number of the pipeline of a draw that is not recorded.
    Pipeline(u32),
}

impl DrawKey {
    /// The key of a draw.
    pub fn of(draw: &DrawInfo) -> Self {
        let shader = |shader| DrawProgram::Shader(shader, draw.topology, draw.depth, draw.blends);
        Self {
            program: draw
                .shader
                .map_or(DrawProgram::Pipeline(draw.pipeline), shader),
            vertices: draw.vertices,
            instances: draw.instances,
        }
    }
}

impl Drawn<'_> {
    /// First colour attachment that the draw writes.
    fn target(&self) -> Option<ViewInfo> {
        self.colors().next()
    }

    /// Colour attachments that the draw writes.
    fn colors(&self) -> impl Iterator<Item = ViewInfo> {
        let colors = self.pass.map_or(&[][..], |pass| &pass.colors);
        let written =
            |(place, view): (usize, &ViewInfo)| writes_color(self.info, place).then_some(*view);
        colors.iter().enumerate().filter_map(written)
    }

    /// Depth attachment that the draw writes. A stencil test is no depth.
    fn written_depth(&self) -> Option<ViewInfo> {
        self.depth().filter(|_| self.info.depth.writes)
    }

    fn depth(&self) -> Option<ViewInfo> {
        self.pass?.depth
    }

    fn is_depth_alone(&self) -> bool {
        self.written_depth().is_some() && self.target().is_none()
    }

    /// Whether the draw is part of a 3D scene. Such draws test depth.
    fn is_of_scene(&self) -> bool {
        self.info.depth.tests && self.depth().is_some() && self.target().is_some()
    }

    fn channels(&self) -> u32 {
        self.info.color_masks.first().copied().unwrap_or(0)
    }
}

/// The rectangle of a draw's viewport.
pub fn viewport(draw: &DrawInfo) -> View {
    let [x, y, width, height] = draw.viewport;
    // With a negative height, the origin is the lower left corner.
    let top = if height < 0.0 { y + height } else { y };
    let whole = |v: f32| v.round() as i32;
    let size = |v: f32| v.abs().round() as u32;
    View {
        origin: [whole(x), whole(top)],
        size: [size(width), size(height)],
    }
}

/// Number of each draw's render pass in the frame.
pub fn pass_numbers(frame: &ProgramFrame) -> Vec<usize> {
    let mut seen: Vec<u32> = Vec::new();
    let number = |draw: &crate::session::Executed| {
        let known = seen.iter().rposition(|pass| *pass == draw.pass);
        known.unwrap_or_else(|| {
            seen.push(draw.pass);
            seen.len() - 1
        })
    };
    frame.draws.iter().map(number).collect()
}

/// The draws of a frame with their numbers of fragments, 0 where these are missing.
fn drawn<'a>(session: &'a Session, frame: &ProgramFrame, weights: &[u64]) -> Vec<Drawn<'a>> {
    let numbers = pass_numbers(frame);
    let of = |(place, executed): (usize, &Executed)| {
        Some(Drawn {
            place,
            info: session.draw(executed.draw)?,
            pass: session.pass(executed.pass),
            shaded: session.is_shaded(executed),
            pass_number: numbers[place],
            weight: weights.get(place).copied().unwrap_or(0),
        })
    };
    frame.draws.iter().enumerate().filter_map(of).collect()
}

/// Identifies the eyes of a frame. `weights` are the numbers of fragments of the executed draws.
///
/// # Errors
/// No rule fits.
pub fn find(
    session: &Session,
    frame: &ProgramFrame,
    weights: &[u64],
    wanted: &Wanted,
) -> Result<Views, ViewsError> {
    let all = drawn(session, frame, weights);
    let next = session.frames.get(&(frame.frame + 1));
    let later = next.map_or_else(Vec::new, |next| drawn(session, next, &[]));
    let mut copies = frame.copies.clone();
    copies.extend(next.iter().flat_map(|next| &next.copies));
    let graph = Images::new(all.iter().chain(&later), copies);
    let mut roles = vec![Role::Other(Other::Elsewhere); frame.draws.len()];
    let of_page = match session.is_page {
        true => graph.of_page(&frame.probed),
        false => None,
    };
    let is_browser = |draw: &Drawn<'_>| of_page.as_ref().is_some_and(|page| !page.has(draw));
    for draw in all.iter().filter(|draw| is_browser(draw)) {
        roles[draw.place] = Role::Other(Other::Browser);
    }
    let by_file = matches!(wanted, Wanted::File(_));
    let mut draws: Vec<Drawn<'_>> = (all.into_iter())
        .filter(|draw| by_file || !is_browser(draw))
        .collect();
    let of_scene = |draw: &Drawn<'_>| draw.is_of_scene() && draw.weight > 0;
    if draws.iter().any(of_scene) {
        // Draws that compose or process pictures may cover more pixels than the pictures' own draws.
        for draw in draws.iter_mut().filter(|draw| !draw.is_of_scene()) {
            draw.weight = 0;
        }
    }
    let colored = draws.iter().filter(|draw| draw.target().is_some());
    let colored: u64 = colored.map(|draw| draw.weight).sum();
    if colored == 0 {
        return Err(match session.is_page {
            true => ViewsError::EmptyPage(frame.frame),
            false => ViewsError::Empty(frame.frame),
        });
    }
    // What the program itself tells comes first.
    let by_shown = match wanted {
        Wanted::Rule(Rule::Shown) | Wanted::First => (session.shown.get(&frame.frame))
            .and_then(|eyes| shown::find(session, eyes, &draws, &frame.copied_layers)),
        _ => None,
    };
    let (rule, found) = match (by_shown, wanted) {
        (Some(found), _) => (Rule::Shown, found),
        (_, Wanted::File(file)) => (Rule::File, file.find(frame.frame, &draws)?),
        (_, Wanted::Rule(rule)) => {
            let found = rules::find(*rule, &draws).ok_or(ViewsError::NotBy {
                frame: frame.frame,
                rule: rule.name(),
            })?;
            (*rule, found)
        }
        (_, Wanted::First) => {
            let all = Rule::ALL.into_iter();
            let mut fitting = all
                .filter_map(|rule| Some((rule, rules::find(rule, &draws)?)))
                .filter(|(_, found)| found.weight * 2 >= graph.beside(&draws, found));
            fitting.next().ok_or(ViewsError::NoStereo(frame.frame))?
        }
    };
    for (place, role) in &found.roles {
        roles[*place] = *role;
    }
    if rule != Rule::File {
        others::classify(&draws, &later, &graph, &mut roles);
    }
    Ok(Views {
        rule,
        eyes: found.eyes,
        layers: found.layers,
        roles,
    })
}

/// Eyes that a rule has identified.
struct Found {
    eyes: [View; 2],
    layers: [u32; 2],
    /// Roles of draws by index.
    roles: Vec<(usize, Role)>,
    /// Number of fragments in draws with a role.
    weight: u64,
}

const LEFT: Role = Role::Seen(Some(Eye::Left));
const RIGHT: Role = Role::Seen(Some(Eye::Right));

#[cfg(test)]
mod tests;
