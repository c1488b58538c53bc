//! Kinds of draws that belong to no eye.

use super::{Drawn, Role, viewport};
use std::collections::HashSet;

/// A draw that the trace leaves out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Other {
    /// A scene that the eyes' draws read as a texture: a reflection, a probe, a screen.
    Reflection,
    /// A picture composed of earlier ones: it tests no depth and reads the frame's pictures.
    PostProcessing,
    /// Whatever else renders elsewhere.
    Elsewhere,
    /// Assigned by a file of rules.
    Ignored,
}

impl Other {
    /// In words.
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

/// Tells the roles of draws that no eye sees, in which `roles` has [`Other::Elsewhere`].
pub(super) fn tell(draws: &[Drawn<'_>], roles: &mut [Role]) {
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
            // Depth that is used for an eye's picture afterwards belongs to that eye.
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
