//! The culling techniques by name.

use serde::{Deserialize, Serialize};

/// How a frame's lists of draws are found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Culling {
    /// Everything is drawn.
    None,
    /// The frustum of each eye: the baseline.
    #[default]
    PerEye,
    /// One frustum around both eyes', one list.
    Superfrustum,
    /// One eye's frustum, the other eye's in the next frame, one list.
    RoundRobin,
    /// The cone of each eye's lens.
    Conical,
    /// One eye's cone, the other eye's in the next frame, one list.
    ConicalRoundRobin,
    /// One cone around both eyes', one list.
    ConicalSuperfrustum,
}
