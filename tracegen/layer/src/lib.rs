//! A Vulkan layer that records the texture samples of an unmodified program.

mod capture;
mod hooks;
pub mod inject;
mod record_buffer;
mod track;
