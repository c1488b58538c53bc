//! Readback of textures.

use super::device::Gpu;
use crate::error::RasterError;
use std::cell::RefCell;

/// Reads textures through a reused buffer.
#[derive(Default)]
pub struct Readback(RefCell<Option<wgpu::Buffer>>);

impl Readback {
    /// All texels of a texture's first level: layer by layer, row by row, without padding. A texel
    /// consists of one or several `T`.
    ///
    /// # Errors
    /// Driver errors.
    pub fn texels<T: bytemuck::Pod>(
        &self,
        gpu: &Gpu,
        texture: &wgpu::Texture,
    ) -> Result<Vec<T>, RasterError> {
        let size = texture.size();
        // Every format read here has one block size.
        let texel_bytes = texture.format().block_copy_size(None).unwrap_or(0);
        let packed_bytes = (size.width * texel_bytes) as usize;
        let row_bytes =
            (size.width * texel_bytes).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let rows = size.height * size.depth_or_array_layers;
        let bytes = u64::from(row_bytes) * u64::from(rows);
        let buffer = self.of_size(gpu, bytes);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        encoder.copy_texture_to_buffer(
            texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &buffer,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(row_bytes),
                    rows_per_image: Some(size.height),
                },
            },
            size,
        );
        gpu.queue.submit([encoder.finish()]);
        gpu.read(&buffer, 0..bytes, |bytes| {
            let mut texels = vec![T::zeroed(); rows as usize * packed_bytes / size_of::<T>()];
            let packed: &mut [u8] = bytemuck::cast_slice_mut(&mut texels);
            for (to, from) in
                (packed.chunks_exact_mut(packed_bytes)).zip(bytes.chunks_exact(row_bytes as usize))
            {
                to.copy_from_slice(&from[..packed_bytes]);
            }
            Ok(texels)
        })
    }

    /// A buffer of at least `bytes` bytes.
    fn of_size(&self, gpu: &Gpu, bytes: u64) -> wgpu::Buffer {
        let mut kept = self.0.borrow_mut();
        kept.take_if(|buffer| buffer.size() < bytes);
        let buffer = kept.get_or_insert_with(|| {
            gpu.buffer(
                bytes,
                wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            )
        });
        buffer.clone()
    }
}
