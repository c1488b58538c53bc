//! The graphics of a session.

use crate::opengl::{Context, Texture};
use crate::state::Code;
use crate::vulkan::{self, Device};
use openxr_sys as xr;

/// What a session renders with.
pub(crate) enum Graphics {
    /// Nothing: a session without pictures.
    None,
    /// A device of Vulkan.
    Vulkan(Device),
    /// A context of OpenGL.
    OpenGl(Context),
}

/// An image of a swapchain.
pub(crate) enum Image {
    Vulkan(vulkan::Image),
    OpenGl(Texture),
}

impl Image {
    /// `VkImage` handle.
    pub fn raw(&self) -> u64 {
        match self {
            Self::Vulkan(image) => image.raw(),
            Self::OpenGl(texture) => texture.image,
        }
    }
}

impl Graphics {
    /// Formats of swapchains, the preferred ones first.
    pub fn formats(&self) -> Vec<i64> {
        match self {
            Self::None => Vec::new(),
            Self::Vulkan(device) => device.formats(),
            Self::OpenGl(context) => context.formats(),
        }
    }

    /// Creates an image of a swapchain.
    pub fn image(&self, info: &xr::SwapchainCreateInfo) -> Result<Image, Code> {
        match self {
            Self::None => Err(Code::ERROR_GRAPHICS_DEVICE_INVALID),
            Self::Vulkan(device) => device.image(info).map(Image::Vulkan),
            Self::OpenGl(context) => context.texture(info).map(Image::OpenGl),
        }
    }

    /// `VkDevice` handle of a session that can show images, all of whose commands are submitted.
    pub fn shown_on(&self) -> Result<Option<u64>, Code> {
        match self {
            Self::None => Ok(None),
            Self::Vulkan(device) => Ok(Some(device.raw())),
            Self::OpenGl(context) => context.finish().map(|()| context.device()),
        }
    }
}
