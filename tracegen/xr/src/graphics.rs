//! The graphics of a session.

use crate::vulkan::Device;

/// What a session renders with.
pub(crate) enum Graphics {
    /// Nothing: a session without pictures.
    None,
    /// A device of Vulkan.
    Vulkan(Device),
}
