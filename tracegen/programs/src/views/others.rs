//! Kinds of draws that do not belong to an eye.

use super::{Drawn, Role, viewport};
use std::collections::HashSet;

/// A draw that is not in the trace.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Other {
    /// Renders a picture that the eyes' draws read as a texture: a reflection, a probe, a screen.
    Reflection,
    /// Processes earlier pictures: tests no depth and reads a picture of the frame.
    PostProcessing,
    /// Renders into another target for an unknown purpose.
    Elsewhere,
    /// Assigned by a file of rules.
    Ignored,
}

impl Other {
    /// Name in messages.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Reflection => "reflections and other pictures of scenes that the eyes read",
            Self::PostProcessing => "post-processing",
            Self::Elsewhere => "draws into other targets",
            Self::Ignored => "passes that the file of rules ignores",
        }
    }
}

/// Classifies the draws whose role is still [`Other::Elsewhere`].
pub(super) fn classify(draws: &[Drawn<'_>], roles: &mut [Role]) {
    let open = Role::Other(Other::Elsewhere);
    let is_seen = |role: Role| matches!(role, Role::Seen(_) | Role::Multiview);
    let (mut read, mut rendered) = (HashSet::new(), HashSet::new());
    for draw in draws {
        let views = draw.info.textures.iter().filter_map(|texture| texture.view);
        if is_seen(roles[draw.place]) {
            read.extend(views.map(|view| view.image));
        }
        rendered.extend(draw.target().map(|view| view.image));
    }
    for draw in draws {
        if roles[draw.place] != open {
            continue;
        }
        roles[draw.place] = if draw.is_depth_alone() {
            // Depth that an eye's picture uses later belongs to that eye.
            let own = draws.iter().find(|seen| {
                is_seen(roles[seen.place])
                    && seen.depth() == draw.depth()
                    && viewport(seen.info) == viewport(draw.info)
            });
            own.map_or(Role::Shadow, |seen| roles[seen.place])
        } else {
            let target = draw.target().map(|view| view.image);
            let mut textures = draw.info.textures.iter().filter_map(|of| of.view);
            if draw.is_of_scene() && target.is_some_and(|image| read.contains(&image)) {
                Role::Other(Other::Reflection)
            } else if !draw.is_of_scene() && textures.any(|of| rendered.contains(&of.image)) {
                Role::Other(Other::PostProcessing)
            } else {
                open
            }
        };
    }
}
