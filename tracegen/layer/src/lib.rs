//! A Vulkan layer that records the texture samples of an unmodified program.

mod capture;
pub mod control;
pub mod hooks;
pub mod inject;
mod record_buffer;
pub mod spool;
pub mod track;
