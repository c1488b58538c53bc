//! Buffers shared by the rendering of all layers: records for readback, and the view's data.

use super::device::Gpu;
use crate::error::RasterError;
use crate::uniforms::ViewData;
use record::{DEPTH_BYTES, RECORD_BYTES};

/// Record buffers, and the uniform of the current layer.
pub struct RecordBuffers {
    /// Raw records.
    pub records: wgpu::Buffer,
    /// Raw depths, one per record.
    pub depths: wgpu::Buffer,
    /// True if `depths` is as long as `records`. Without masked draws it is a placeholder.
    pub has_depths: bool,
    /// Number of appended records, including those beyond the capacity.
    pub counter: wgpu::Buffer,
    /// Number of records that fit.
    pub capacity: u32,
    /// The layer's `View`.
    pub view_uniform: wgpu::Buffer,
}

impl RecordBuffers {
    /// Creates a record buffer of at most `budget_bytes`, within the device's limit for one
    /// binding, and a depth buffer if `has_depths`.
    ///
    /// # Errors
    /// Driver errors.
    pub fn new(gpu: &Gpu, budget_bytes: u64, has_depths: bool) -> Result<Self, RasterError> {
        let limits = gpu.device.limits();
        let binding = u64::from(limits.max_storage_buffer_binding_size as u32);
        // A device that cannot capture gets placeholders.
        let captures = gpu.no_capture.is_none();
        let budget_bytes = if captures { budget_bytes } else { 0 };
        let capacity =
            (budget_bytes.min(binding).min(limits.max_buffer_size) / RECORD_BYTES).max(1);
        let depths = if has_depths { capacity } else { 1 };
        gpu.checked("making the record buffers", || {
            use wgpu::BufferUsages as Usage;
            let recorded = if captures {
                Usage::STORAGE | Usage::MAP_READ
            } else {
                Usage::STORAGE
            };
            Self {
                records: gpu.buffer(capacity * RECORD_BYTES, recorded),
                depths: gpu.buffer(depths * DEPTH_BYTES, recorded),
                has_depths,
                counter: gpu.buffer(4, recorded | Usage::COPY_DST),
                capacity: capacity as u32,
                view_uniform: gpu.buffer(
                    size_of::<ViewData>() as u64,
                    Usage::UNIFORM | Usage::COPY_DST,
                ),
            }
        })
    }
}
