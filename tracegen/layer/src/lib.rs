//! A Vulkan layer that records the texture samples of an unmodified program.

mod capture;
pub mod control;
mod hooks;
pub mod inject;
mod record_buffer;
pub mod spool;
mod track;
