//! Which draws show which eye: rules for how programs render stereo pictures.

use crate::pairs::likeness;
use crate::session::{Frame, Session};
use formats::view::Eye;
use parallax_layer::spool::{DrawInfo, PassInfo, ViewInfo};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
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
    /// One target for both, one eye after the other, told apart by the channels that are written.
    Channels,
    /// One target for both: the same draws twice.
    Twice,
    /// One eye alone.
    Mono,
}

impl Rule {
    /// Every rule, in the order in which they are tried; one eye alone is not.
    pub const ALL: [Self; 5] = [
        Self::Multiview,
        Self::Halves,
        Self::Targets,
        Self::Channels,
        Self::Twice,
    ];

    /// In words.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Multiview => "multiview",
            Self::Halves => "viewport halves",
            Self::Targets => "a target per eye",
            Self::Channels => "colour channels",
            Self::Twice => "equal draws twice",
            Self::Mono => "one eye",
        }
    }
}

/// A rectangle of a target, in pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct View {
    /// Left and top edge.
    pub origin: [i32; 2],
    /// Width and height.
    pub size: [u32; 2],
}

/// What a draw shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// A view of an eye; `None` for one that belongs to both.
    Seen(Option<Eye>),
    /// Both eyes: the views of the draw tell which.
    Multiview,
    /// Depth seen from a light.
    Shadow,
    /// Nothing that a trace is of.
    Ignored,
}

/// The views of a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Views {
    /// The rule that found them.
    pub rule: Rule,
    /// Rectangle of the left and the right eye in its target.
    pub eyes: [View; 2],
    /// Views of a multiview pass that are the left and the right eye.
    pub layers: [u32; 2],
    /// Of each executed draw of the frame.
    pub roles: Vec<Role>,
}

/// No rule fits.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum ViewsError {
    /// None of the rules.
    #[error(
        "frame {0}: no two eyes were found, by none of: multiview, viewport halves, a target per eye, colour channels, equal draws \
         twice; --list shows the frame's passes, --eyes names a rule, --eyes mono takes the largest target alone"
    )]
    NoStereo(u32),
    /// The rule that was named.
    #[error("frame {frame}: no two eyes were found by the rule {rule}")]
    NotBy {
        /// Frame.
        frame: u32,
        /// Rule.
        rule: &'static str,
    },
    /// Nothing was drawn.
    #[error("frame {0}: nothing was drawn into a colour target")]
    Empty(u32),
}

/// A draw with what rules look at.
struct Drawn<'a> {
    place: usize,
    info: &'a DrawInfo,
    pass: Option<&'a PassInfo>,
    /// Fragments.
    weight: u64,
}

/// What makes a draw of one eye the same as one of the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct DrawKey {
    /// Pipeline.
    pub pipeline: u32,
    /// Vertices or indices.
    pub vertices: u32,
    /// Instances.
    pub instances: u32,
}

impl DrawKey {
    /// A draw's.
    #[must_use]
    pub fn of(draw: &DrawInfo) -> Self {
        Self {
            pipeline: draw.pipeline,
            vertices: draw.vertices,
            instances: draw.instances,
        }
    }
}

impl Drawn<'_> {
    /// First colour attachment that is written.
    fn target(&self) -> Option<ViewInfo> {
        let pass = self.pass?;
        let written = |(place, _): &(usize, &ViewInfo)| {
            self.info
                .color_masks
                .get(*place)
                .is_none_or(|mask| *mask != 0)
        };
        let mut colors = pass.colors.iter().enumerate();
        colors.find(written).map(|(_, view)| *view)
    }

    fn is_depth_alone(&self) -> bool {
        self.pass
            .is_some_and(|pass| pass.colors.is_empty() && pass.depth.is_some())
    }

    fn channels(&self) -> u32 {
        self.info.color_masks.first().copied().unwrap_or(0)
    }
}

/// The rectangle that a draw's viewport covers.
#[must_use]
pub fn viewport(draw: &DrawInfo) -> View {
    let [x, y, width, height] = draw.viewport;
    // Upside down: the corner is the lower one.
    let top = if height < 0.0 { y + height } else { y };
    let whole = |v: f32| v.round() as i32;
    let size = |v: f32| v.abs().round() as u32;
    View {
        origin: [whole(x), whole(top)],
        size: [size(width), size(height)],
    }
}

/// Finds the views of a frame by a rule, or by the first that fits. `weights` are the fragments of each executed draw.
///
/// # Errors
/// No rule fits.
pub fn find(
    session: &Session,
    frame: &Frame,
    weights: &[u64],
    wanted: Option<Rule>,
) -> Result<Views, ViewsError> {
    let draws: Vec<Drawn<'_>> = (frame.draws.iter().zip(weights).enumerate())
        .filter_map(|(place, (executed, weight))| {
            Some(Drawn {
                place,
                info: session.draw(executed.draw)?,
                pass: session.pass(executed.pass),
                weight: *weight,
            })
        })
        .collect();
    let colored: u64 = (draws.iter().filter(|d| d.target().is_some()))
        .map(|d| d.weight)
        .sum();
    if colored == 0 {
        return Err(ViewsError::Empty(frame.frame));
    }
    let rules = match wanted {
        Some(rule) => vec![rule],
        None => Rule::ALL.to_vec(),
    };
    let mut found = rules.into_iter().filter_map(|rule| {
        let found = match rule {
            Rule::Multiview => multiview(&draws),
            Rule::Halves => halves(&draws),
            Rule::Targets => targets(&draws),
            Rule::Channels => channels(&draws),
            Rule::Twice => twice(&draws),
            Rule::Mono => mono(&draws),
        }?;
        // A rule that was named may be about a small part of the frame.
        let is_main = wanted.is_some() || found.weight * 2 >= colored;
        is_main.then_some((rule, found))
    });
    let (rule, found) = found.next().ok_or(match wanted {
        Some(rule) => ViewsError::NotBy {
            frame: frame.frame,
            rule: rule.name(),
        },
        None => ViewsError::NoStereo(frame.frame),
    })?;
    let mut roles = vec![Role::Ignored; frame.draws.len()];
    for draw in draws.iter().filter(|draw| draw.is_depth_alone()) {
        roles[draw.place] = Role::Shadow;
    }
    for (place, role) in found.roles {
        roles[place] = role;
    }
    Ok(Views {
        rule,
        eyes: found.eyes,
        layers: found.layers,
        roles,
    })
}

/// What a rule found.
struct Found {
    eyes: [View; 2],
    layers: [u32; 2],
    roles: Vec<(usize, Role)>,
    /// Fragments that it explains.
    weight: u64,
}

const LEFT: Role = Role::Seen(Some(Eye::Left));
const RIGHT: Role = Role::Seen(Some(Eye::Right));

/// Largest number by a key.
fn largest<K: Copy + Eq + std::hash::Hash>(
    draws: &[&Drawn<'_>],
    key: impl Fn(&Drawn<'_>) -> Option<K>,
) -> Vec<(K, u64)> {
    let mut order: Vec<K> = Vec::new();
    let mut sums: HashMap<K, u64> = HashMap::new();
    for draw in draws {
        if let Some(key) = key(draw) {
            if !sums.contains_key(&key) {
                order.push(key);
            }
            *sums.entry(key).or_default() += draw.weight;
        }
    }
    let mut found: Vec<(K, u64)> = order.into_iter().map(|key| (key, sums[&key])).collect();
    // Equal ones stay in the order in which they were drawn.
    found.sort_by_key(|(_, weight)| std::cmp::Reverse(*weight));
    found
}

fn all<'a, 'b>(draws: &'b [Drawn<'a>]) -> Vec<&'b Drawn<'a>> {
    draws.iter().collect()
}

fn multiview(draws: &[Drawn<'_>]) -> Option<Found> {
    let broadcast = |draw: &Drawn<'_>| {
        let mask = draw.pass?.view_mask;
        let target = draw.target()?;
        (mask.count_ones() == 2).then_some((target.image, mask, viewport(draw.info)))
    };
    let ((image, mask, view), weight) = *largest(&all(draws), broadcast).first()?;
    let of = draws
        .iter()
        .filter(|draw| broadcast(draw).is_some_and(|(other, of, _)| (other, of) == (image, mask)));
    let first = mask.trailing_zeros();
    Some(Found {
        eyes: [view; 2],
        layers: [first, (mask & (mask - 1)).trailing_zeros()],
        roles: of.map(|draw| (draw.place, Role::Multiview)).collect(),
        weight,
    })
}

/// Two rectangles beside or above each other.
fn are_halves(a: View, b: View) -> bool {
    if a.size != b.size || a.size.contains(&0) {
        return false;
    }
    let [dx, dy] = [0, 1].map(|axis| (a.origin[axis] - b.origin[axis]).unsigned_abs());
    let [width, height] = a.size;
    // A gap between them may be as wide as a tenth.
    let beside = dy == 0 && dx >= width && dx - width <= width / 10;
    let above = dx == 0 && dy >= height && dy - height <= height / 10;
    beside || above
}

fn halves(draws: &[Drawn<'_>]) -> Option<Found> {
    let place = |draw: &Drawn<'_>| Some((draw.target()?, viewport(draw.info)));
    let places = largest(&all(draws), place);
    for ((target, view), weight) in &places {
        let other = places
            .iter()
            .find(|((other, of), _)| other == target && are_halves(*view, *of));
        let Some(((_, of), other_weight)) = other else {
            continue;
        };
        let mut eyes = [*view, *of];
        eyes.sort_by_key(|view| view.origin);
        let role = |draw: &Drawn<'_>| {
            let (on, view) = place(draw)?;
            let eye = eyes.iter().position(|eye| on == *target && *eye == view)?;
            Some((draw.place, [LEFT, RIGHT][eye]))
        };
        return Some(Found {
            eyes,
            layers: [0, 1],
            roles: draws.iter().filter_map(role).collect(),
            weight: weight + other_weight,
        });
    }
    None
}

/// How alike the draws of two eyes have to be.
const LIKENESS: f64 = 0.7;

fn targets(draws: &[Drawn<'_>]) -> Option<Found> {
    let on = |draw: &Drawn<'_>| draw.target();
    let places = largest(&all(draws), on);
    let keys = |target: ViewInfo| -> Vec<DrawKey> {
        let of = draws.iter().filter(|draw| on(draw) == Some(target));
        of.map(|draw| DrawKey::of(draw.info)).collect()
    };
    let main = |target: ViewInfo| {
        let of: Vec<&Drawn<'_>> = draws
            .iter()
            .filter(|draw| on(draw) == Some(target))
            .collect();
        largest(&of, |draw| Some(viewport(draw.info)))
            .first()
            .map(|(view, _)| *view)
    };
    for (number, (a, weight)) in places.iter().enumerate() {
        for (b, other_weight) in &places[number + 1..] {
            let (Some(of_a), Some(of_b)) = (main(*a), main(*b)) else {
                continue;
            };
            let alike = a.format == b.format
                && of_a.size == of_b.size
                && likeness(&keys(*a), &keys(*b)) >= LIKENESS;
            if !alike || *other_weight * 4 < *weight {
                continue;
            }
            let first = draws.iter().filter_map(on).find(|t| t == a || t == b);
            let [left, right] = if first == Some(*b) {
                [*b, *a]
            } else {
                [*a, *b]
            };
            let role = |draw: &Drawn<'_>| match on(draw)? {
                target if target == left => Some((draw.place, LEFT)),
                target if target == right => Some((draw.place, RIGHT)),
                _ => None,
            };
            return Some(Found {
                eyes: [left, right].map(|target| main(target).unwrap_or_default()),
                layers: [0, 1],
                roles: draws.iter().filter_map(role).collect(),
                weight: weight + other_weight,
            });
        }
    }
    None
}

/// The draws into the largest target, and its main view.
fn main_target<'a, 'b>(draws: &'b [Drawn<'a>]) -> Option<(Vec<&'b Drawn<'a>>, View, u64)> {
    let (target, weight) = *largest(&all(draws), |draw| draw.target()).first()?;
    let of: Vec<&Drawn<'_>> = draws
        .iter()
        .filter(|draw| draw.target() == Some(target))
        .collect();
    let (view, _) = *largest(&of, |draw| Some(viewport(draw.info))).first()?;
    Some((of, view, weight))
}

fn channels(draws: &[Drawn<'_>]) -> Option<Found> {
    const COLORS: u32 = 7;
    let (of, view, _) = main_target(draws)?;
    let seen = |draw: &&Drawn<'_>| draw.channels() & COLORS;
    let mut order: Vec<u32> = of
        .iter()
        .map(seen)
        .filter(|c| *c != 0 && *c != COLORS)
        .collect();
    order.dedup();
    let left = *order.first()?;
    let right = *order.iter().find(|other| **other & left == 0)?;
    let of_channels = |draw: &&&Drawn<'_>| [left, right].contains(&seen(draw));
    let roles = of.iter().filter(of_channels).map(|draw| {
        let eye = if seen(draw) == left { LEFT } else { RIGHT };
        (draw.place, eye)
    });
    Some(Found {
        eyes: [view; 2],
        layers: [0, 1],
        roles: roles.collect(),
        weight: of.iter().filter(of_channels).map(|draw| draw.weight).sum(),
    })
}

fn twice(draws: &[Drawn<'_>]) -> Option<Found> {
    let (of, view, weight) = main_target(draws)?;
    let keys: Vec<DrawKey> = of.iter().map(|draw| DrawKey::of(draw.info)).collect();
    // The second eye begins where a pass does.
    let starts = (1..of.len())
        .filter(|at| of[*at].pass.map(|pass| pass.pass) != of[*at - 1].pass.map(|pass| pass.pass));
    let alike = starts.map(|at| (at, likeness(&keys[..at], &keys[at..])));
    let best = alike.max_by(|a, b| a.1.total_cmp(&b.1))?;
    let (middle, _) = Some(best).filter(|(_, likeness)| *likeness >= LIKENESS)?;
    let roles = of.iter().enumerate().map(|(number, draw)| {
        let eye = if number < middle { LEFT } else { RIGHT };
        (draw.place, eye)
    });
    Some(Found {
        eyes: [view; 2],
        layers: [0, 1],
        roles: roles.collect(),
        weight,
    })
}

fn mono(draws: &[Drawn<'_>]) -> Option<Found> {
    let (of, view, weight) = main_target(draws)?;
    Some(Found {
        eyes: [view; 2],
        layers: [0, 1],
        roles: of
            .iter()
            .map(|draw| (draw.place, Role::Seen(None)))
            .collect(),
        weight,
    })
}

#[cfg(test)]
mod tests;
