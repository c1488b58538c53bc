//! Kinds of draws that do not belong to an eye.

use super::images::Images;
use super::{Drawn, Role, viewport};
use std::collections::HashSet;

/// A draw that is not in the trace.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Other {
    /// Renders a picture that the eyes' draws read as a texture: a reflection, a probe, a screen.
    Reflection,
    /// Processes earlier pictures: reads the picture of an eye, or tests no depth and reads another picture of the
    /// frame.
    PostProcessing,
    /// Writes neither colour nor depth: a stencil mask, or the proxy of an occlusion query.
    Mask,
    /// Writes depth alone, for no single eye, and no eye samples it.
    Depth,
    /// Renders into another target for an unknown purpose.
    Elsewhere,
    /// Drawn by a browser itself, or not read for a canvas of its page.
    Browser,
    /// Assigned by a file of rules.
    Ignored,
}

impl Other {
    /// Name in messages.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Reflection => "reflections and other pictures of scenes that the eyes read",
            Self::PostProcessing => "post-processing",
            Self::Mask => "masks and occlusion queries",
            Self::Depth => "depth of no single eye, which no eye samples",
            Self::Browser => "the browser's own drawing",
            Self::Elsewhere => "draws into other targets",
            Self::Ignored => "passes that the file of rules ignores",
        }
    }
}

/// Classifies the draws whose role is still [`Other::Elsewhere`]. `later` are the draws of the next frame.
///
/// - A draw that writes no colour, but into the targets and the viewport of an eye, belongs to the eye: a depth
///   pre-pass, or a mask whose shader discards.
/// - A shadow map is depth that is read for the picture of an eye in this frame or the next.
pub(super) fn classify(
    draws: &[Drawn<'_>],
    later: &[Drawn<'_>],
    graph: &Images,
    roles: &mut [Role],
) {
    let open = Role::Other(Other::Elsewhere);
    let is_seen = |role: Role| matches!(role, Role::Seen(_) | Role::Multiview);
    let eyes: Vec<&Drawn<'_>> = (draws.iter())
        .filter(|draw| is_seen(roles[draw.place]))
        .collect();
    let targets: HashSet<_> = (eyes.iter())
        .map(|draw| (draw.target(), viewport(draw.info)))
        .collect();
    let later =
        (later.iter()).filter(|draw| targets.contains(&(draw.target(), viewport(draw.info))));
    let read = graph.sources(
        eyes.iter()
            .copied()
            .chain(later)
            .flat_map(|draw| draw.reads()),
    );
    let rendered: HashSet<u32> = (draws.iter())
        .filter_map(|draw| Some(draw.target()?.image))
        .collect();
    let results = graph.results(
        eyes.iter()
            .flat_map(|eye| eye.colors().map(|view| view.image)),
    );
    let processed = |draw: &Drawn<'_>, image: u32| {
        results.contains(&image) || (!draw.is_of_scene() && rendered.contains(&image))
    };
    let eye_roles: Vec<Role> = eyes.iter().map(|eye| roles[eye.place]).collect();
    for draw in draws
        .iter()
        .filter(|draw| roles[draw.place] == open)
        .collect::<Vec<_>>()
    {
        let prepares = |eye: &&Drawn<'_>| {
            let same_depth = eye.depth().is_some() && eye.depth() == draw.depth();
            (same_depth || eye.pass_number == draw.pass_number)
                && viewport(eye.info) == viewport(draw.info)
        };
        // Eyes may share a target one after the other, so a draw prepares the next draw of an eye.
        let own = (eyes
            .iter()
            .position(|eye| eye.place > draw.place && prepares(eye)))
        .or_else(|| eyes.iter().rposition(&prepares));
        let depth_is_read = draw
            .written_depth()
            .is_some_and(|view| read.contains(&view.image));
        let color_is_read = draw.colors().any(|view| read.contains(&view.image));
        roles[draw.place] = match (draw.target(), own) {
            (None, Some(eye)) if draw.shaded || draw.is_depth_alone() => eye_roles[eye],
            _ if depth_is_read && !color_is_read => Role::Shadow,
            (None, _) if draw.is_depth_alone() => Role::Other(Other::Depth),
            (None, _) => Role::Other(Other::Mask),
            _ if draw.is_of_scene() && color_is_read => Role::Other(Other::Reflection),
            _ if draw.reads().any(|image| processed(draw, image)) => {
                Role::Other(Other::PostProcessing)
            }
            _ => open,
        };
    }
}
