//! Finds Mesa's CPU Vulkan driver and opens it.

use crate::error::RasterError;

/// An opened lavapipe.
pub struct Gpu {
    /// Logical device.
    pub device: wgpu::Device,
    /// Its queue.
    pub queue: wgpu::Queue,
    /// Driver string as it names itself.
    pub driver: String,
}

/// Lanes of a subgroup at llvmpipe's native 256-bit vectors: two quads. At 128 bits its ballot
/// corrupts memory (Mesa 22.3), so any other size is refused.
const SUBGROUP_LANES: u32 = 8;

/// Opens the llvmpipe adapter.
///
/// # Errors
/// [`RasterError::NoDriver`] with the packages to install, or [`RasterError::Unsupported`].
pub fn open() -> Result<Gpu, RasterError> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
        backends: wgpu::Backends::VULKAN,
        flags: wgpu::InstanceFlags::empty(),
        ..wgpu::InstanceDescriptor::new_without_display_handle()
    });
    let adapters = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::VULKAN));
    let infos: Vec<wgpu::AdapterInfo> = adapters.iter().map(wgpu::Adapter::get_info).collect();
    let chosen = infos.iter().position(|info| {
        info.device_type == wgpu::DeviceType::Cpu && info.name.contains("llvmpipe")
    });
    let (Some(adapter), Some(info)) = (
        chosen.and_then(|i| adapters.get(i)),
        chosen.and_then(|i| infos.get(i)),
    ) else {
        let others: Vec<&str> = infos.iter().map(|i| i.name.as_str()).collect();
        return Err(RasterError::NoDriver(if others.is_empty() {
            String::new()
        } else {
            format!(" (only: {})", others.join(", "))
        }));
    };
    let driver = format!("{} {} ({})", info.driver, info.driver_info, info.name);
    let unsupported = |what: String| RasterError::Unsupported {
        driver: driver.clone(),
        what,
    };
    if (info.subgroup_min_size, info.subgroup_max_size) != (SUBGROUP_LANES, SUBGROUP_LANES) {
        return Err(unsupported(format!(
            "subgroups of {SUBGROUP_LANES} lanes (it has {} to {}): the capture needs 256-bit vectors, that is a CPU with AVX and LP_NATIVE_VECTOR_WIDTH unset",
            info.subgroup_min_size, info.subgroup_max_size
        )));
    }
    let required_features = wgpu::Features::PRIMITIVE_INDEX
        | wgpu::Features::SHADER_EARLY_DEPTH_TEST
        | wgpu::Features::SUBGROUP
        | wgpu::Features::TEXTURE_COMPRESSION_BC
        | wgpu::Features::MAPPABLE_PRIMARY_BUFFERS;
    let missing = required_features - adapter.features();
    if !missing.is_empty() {
        return Err(unsupported(format!("{missing:?}")));
    }
    let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
        label: None,
        required_features,
        required_limits: adapter.limits(),
        experimental_features: wgpu::ExperimentalFeatures::disabled(),
        memory_hints: wgpu::MemoryHints::MemoryUsage,
        trace: wgpu::Trace::Off,
    }))
    .map_err(|e| RasterError::Driver {
        doing: "opening the device",
        message: e.to_string(),
    })?;
    Ok(Gpu {
        device,
        queue,
        driver,
    })
}

impl Gpu {
    /// Runs `work` and turns what the driver or the validation objects to into an error.
    ///
    /// # Errors
    /// [`RasterError::Driver`].
    pub fn checked<T>(
        &self,
        doing: &'static str,
        work: impl FnOnce() -> T,
    ) -> Result<T, RasterError> {
        let memory = self.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let validation = self.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let internal = self.device.push_error_scope(wgpu::ErrorFilter::Internal);
        let result = work();
        for scope in [internal, validation, memory] {
            if let Some(error) = pollster::block_on(scope.pop()) {
                return Err(RasterError::Driver {
                    doing,
                    message: error.to_string(),
                });
            }
        }
        Ok(result)
    }

    /// Waits for everything submitted.
    ///
    /// # Errors
    /// [`RasterError::Driver`].
    pub fn wait(&self, doing: &'static str) -> Result<(), RasterError> {
        self.device
            .poll(wgpu::PollType::wait_indefinitely())
            .map(|_| ())
            .map_err(|e| RasterError::Driver {
                doing,
                message: e.to_string(),
            })
    }

    /// Maps a range of a buffer for reading, waits, and calls `read` with its bytes.
    ///
    /// # Errors
    /// [`RasterError::Driver`], or what `read` returns.
    pub fn read<T>(
        &self,
        buffer: &wgpu::Buffer,
        bytes: std::ops::Range<u64>,
        read: impl FnOnce(&[u8]) -> Result<T, RasterError>,
    ) -> Result<T, RasterError> {
        let failed = |message: String| RasterError::Driver {
            doing: "mapping a buffer",
            message,
        };
        let (sender, receiver) = std::sync::mpsc::channel();
        buffer.map_async(wgpu::MapMode::Read, bytes.clone(), move |result| {
            // The receiver outlives the wait below; a failed send has nobody to tell.
            let _ = sender.send(result);
        });
        self.wait("mapping a buffer")?;
        receiver
            .recv()
            .map_err(|e| failed(e.to_string()))?
            .map_err(|e| failed(e.to_string()))?;
        let result = {
            let view = buffer
                .get_mapped_range(bytes)
                .map_err(|e| failed(e.to_string()))?;
            read(&view)
        };
        buffer.unmap();
        result
    }
}
