//! A trace of either kind.

use crate::container::{Container, Kind};
use crate::error::Result;
use crate::raytrace::Raytrace;
use crate::textrace::Textrace;
use std::path::Path;

/// An open trace; everything except the content of its tiles has been checked.
#[derive(Debug)]
pub enum Trace {
    /// Texture addresses.
    Texture(Box<Textrace>),
    /// Rays.
    Ray(Box<Raytrace>),
}

impl Trace {
    /// Opens a file or a pipe.
    ///
    /// # Errors
    /// The file cannot be read or is malformed; the error names the place.
    pub fn open(path: &Path) -> Result<Self> {
        Self::from_container(Container::open(path)?)
    }

    /// Reads a trace from memory.
    ///
    /// # Errors
    /// The bytes are malformed.
    pub fn from_bytes(bytes: Vec<u8>) -> Result<Self> {
        Self::from_container(Container::from_bytes(bytes)?)
    }

    fn from_container(container: Container) -> Result<Self> {
        Ok(match container.kind() {
            Kind::Textrace => Self::Texture(Box::new(Textrace::from_container(container)?)),
            Kind::Raytrace => Self::Ray(Box::new(Raytrace::from_container(container)?)),
        })
    }

    /// CRC-32 of the content, which identifies the trace in results.
    pub fn content_checksum(&self) -> u32 {
        match self {
            Self::Texture(trace) => trace.content_checksum(),
            Self::Ray(trace) => trace.content_checksum(),
        }
    }

    /// The container of either kind.
    pub fn container(&self) -> &Container {
        match self {
            Self::Texture(trace) => trace.container(),
            Self::Ray(trace) => trace.container(),
        }
    }
}
