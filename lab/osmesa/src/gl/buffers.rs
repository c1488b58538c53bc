//! Buffers.

use super::{Gl, made};
use glow::HasContext;
use raster::error::RasterError;

/// A buffer and its length.
#[derive(Clone, Copy, Debug)]
pub struct Buffer {
    pub(super) name: glow::NativeBuffer,
    /// Length in bytes.
    pub bytes: u64,
}

impl Gl {
    /// Creates a buffer with contents.
    ///
    /// # Errors
    /// Driver errors.
    pub fn buffer(&self, contents: &[u8]) -> Result<Buffer, RasterError> {
        let buffer = self.empty_buffer(contents.len() as u64)?;
        self.write(buffer, 0, contents);
        self.check("filling a buffer")?;
        Ok(buffer)
    }

    /// Creates a buffer of this size.
    ///
    /// # Errors
    /// Driver errors, and sizes beyond the driver's integer type.
    pub fn empty_buffer(&self, bytes: u64) -> Result<Buffer, RasterError> {
        let size = i32::try_from(bytes).map_err(|_| RasterError::TooLarge {
            what: "bytes of a buffer".into(),
            found: bytes,
            limit: i32::MAX as u64,
        })?;
        // SAFETY: see the module.
        let name = unsafe {
            let name = self.gl.create_buffer().map_err(made("a buffer"))?;
            self.gl.bind_buffer(glow::COPY_WRITE_BUFFER, Some(name));
            self.gl
                .buffer_data_size(glow::COPY_WRITE_BUFFER, size, glow::DYNAMIC_DRAW);
            name
        };
        self.check("making a buffer")?;
        Ok(Buffer { name, bytes })
    }

    /// Writes into a buffer.
    pub fn write(&self, buffer: Buffer, offset: u64, bytes: &[u8]) {
        // SAFETY: see the module. The driver refuses writes beyond the end.
        unsafe {
            self.gl
                .bind_buffer(glow::COPY_WRITE_BUFFER, Some(buffer.name));
            (self.gl).buffer_sub_data_u8_slice(glow::COPY_WRITE_BUFFER, offset as i32, bytes);
        }
    }

    /// Reads the start of a buffer after all draws have written it.
    pub fn read(&self, buffer: Buffer, into: &mut [u8]) {
        // SAFETY: see the module. The driver refuses reads beyond the end.
        unsafe {
            self.gl.memory_barrier(glow::BUFFER_UPDATE_BARRIER_BIT);
            self.gl
                .bind_buffer(glow::COPY_READ_BUFFER, Some(buffer.name));
            self.gl.get_buffer_sub_data(glow::COPY_READ_BUFFER, 0, into);
        }
    }

    /// Binds a uniform block.
    pub fn bind_uniform(&self, binding: u32, buffer: Buffer) {
        self.bind_buffer(glow::UNIFORM_BUFFER, binding, buffer);
    }

    /// Binds a storage block.
    pub fn bind_storage(&self, binding: u32, buffer: Buffer) {
        self.bind_buffer(glow::SHADER_STORAGE_BUFFER, binding, buffer);
    }

    fn bind_buffer(&self, target: u32, binding: u32, buffer: Buffer) {
        // SAFETY: see the module. Mesa bounds-checks buffer accesses of shaders.
        unsafe { self.gl.bind_buffer_base(target, binding, Some(buffer.name)) };
    }
}
