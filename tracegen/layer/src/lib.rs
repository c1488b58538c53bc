//! A Vulkan layer that records the texture samples of an unmodified program.

pub mod inject;
