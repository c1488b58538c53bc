//! Finds and opens a Vulkan device: Mesa's CPU driver, which can capture, or a device by name.

use crate::error::RasterError;
use crate::shader::Granularity;
use mesa::SUBGROUP_LANES;
use wgpu::util::DeviceExt;

/// An opened lavapipe.
pub struct Gpu {
    /// Logical device.
    pub device: wgpu::Device,
    /// Its queue.
    pub queue: wgpu::Queue,
    /// Name of the device.
    pub adapter: String,
    /// The driver's own name and version string.
    pub driver: String,
    /// The device runs on the processor.
    pub is_software: bool,
    /// The device has a multiview, which may be defective.
    pub has_multiview: bool,
    /// Missing features for captures. Such a device can only render pictures.
    pub no_capture: Option<String>,
    /// Reason for recording fragments one by one instead of quad by quad, if they are.
    pub by_fragment: Option<String>,
}

/// Features and limits that captures require.
const CAPTURE_FEATURES: wgpu::Features = wgpu::Features::PRIMITIVE_INDEX
    .union(wgpu::Features::SHADER_EARLY_DEPTH_TEST)
    .union(wgpu::Features::MAPPABLE_PRIMARY_BUFFERS);
/// Features and limits that every picture requires.
const PICTURE_FEATURES: wgpu::Features = wgpu::Features::TEXTURE_COMPRESSION_BC;

/// Opens an adapter: the first whose name contains `wanted`, ignoring case, or else llvmpipe, which
/// must be able to capture.
///
/// # Errors
/// [`RasterError::NoDriver`] with the packages to install, [`RasterError::NotLoaded`] if they are
/// installed, [`RasterError::NoAdapter`] with the names of the available adapters, or
/// [`RasterError::Unsupported`].
pub fn open(wanted: Option<&str>) -> Result<Gpu, RasterError> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
        backends: wgpu::Backends::VULKAN,
        flags: wgpu::InstanceFlags::empty(),
        ..wgpu::InstanceDescriptor::new_without_display_handle()
    });
    let adapters = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::VULKAN));
    let infos: Vec<wgpu::AdapterInfo> = adapters.iter().map(wgpu::Adapter::get_info).collect();
    let names: Vec<&str> = infos.iter().map(|i| i.name.as_str()).collect();
    if names.is_empty()
        && let Some(reason) = super::missing::reason()
    {
        return Err(RasterError::NotLoaded(reason));
    }
    let chosen = match wanted {
        Some(wanted) => named(&names, wanted).ok_or_else(|| RasterError::NoAdapter {
            wanted: wanted.to_owned(),
            known: names.join(", "),
        })?,
        None => (infos.iter()).position(is_llvmpipe).ok_or_else(|| {
            RasterError::NoDriver(if names.is_empty() {
                String::new()
            } else {
                format!(" (only: {})", names.join(", "))
            })
        })?,
    };
    let (adapter, info) = (&adapters[chosen], &infos[chosen]);
    let driver = format!("{} {} ({})", info.driver, info.driver_info, info.name);
    let missing = (PICTURE_FEATURES | CAPTURE_FEATURES) - adapter.features();
    let by_fragment = no_ballots(adapter, info);
    // Only llvmpipe is known to compute derivatives per lane, which recording single fragments requires.
    let no_capture = if missing.is_empty() {
        by_fragment.clone().filter(|_| !is_llvmpipe(info))
    } else {
        let names: Vec<&str> = missing.iter_names().map(|(name, _)| name).collect();
        Some(names.join(", "))
    };
    let no_picture = missing.intersects(PICTURE_FEATURES);
    if let Some(what) = no_capture
        .as_ref()
        .filter(|_| wanted.is_none() || no_picture)
    {
        return Err(RasterError::Unsupported {
            driver,
            what: what.clone(),
        });
    }
    let wanted_too =
        wgpu::Features::MULTIVIEW | wgpu::Features::SUBGROUP | wgpu::Features::FLOAT32_FILTERABLE;
    let extra = adapter.features() & wanted_too;
    let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
        label: None,
        required_features: ((PICTURE_FEATURES | CAPTURE_FEATURES) - missing) | extra,
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
        adapter: info.name.clone(),
        driver,
        is_software: info.device_type == wgpu::DeviceType::Cpu,
        has_multiview: extra.contains(wgpu::Features::MULTIVIEW),
        no_capture,
        by_fragment,
    })
}

fn is_llvmpipe(info: &wgpu::AdapterInfo) -> bool {
    info.device_type == wgpu::DeviceType::Cpu && info.name.contains("llvmpipe")
}

/// Reason why the lanes of a quad cannot exchange their coverage, if they cannot.
fn no_ballots(adapter: &wgpu::Adapter, info: &wgpu::AdapterInfo) -> Option<String> {
    let lanes = [info.subgroup_min_size, info.subgroup_max_size];
    if !adapter.features().contains(wgpu::Features::SUBGROUP) {
        Some("subgroup operations".to_owned())
    } else if lanes != [SUBGROUP_LANES; 2] {
        Some(format!(
            "subgroups of {SUBGROUP_LANES} lanes (it has {} to {})",
            lanes[0], lanes[1]
        ))
    } else {
        None
    }
}

/// Position of the first name that contains `wanted`, ignoring case.
fn named(names: &[&str], wanted: &str) -> Option<usize> {
    let wanted = wanted.to_lowercase();
    (names.iter()).position(|name| name.to_lowercase().contains(&wanted))
}

impl Gpu {
    /// How fragments are recorded.
    pub(crate) fn granularity(&self) -> Granularity {
        match (&self.no_capture, &self.by_fragment) {
            (Some(_), _) => Granularity::None,
            (None, None) => Granularity::Quads,
            (None, Some(_)) => Granularity::Fragments,
        }
    }

    /// Runs `work`. Errors of the driver or of the validation are returned.
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

    /// Encodes commands and submits them.
    ///
    /// # Errors
    /// As [`Self::checked`].
    pub fn submit(
        &self,
        doing: &'static str,
        encode: impl FnOnce(&mut wgpu::CommandEncoder),
    ) -> Result<(), RasterError> {
        self.checked(doing, || {
            let mut encoder = self.device.create_command_encoder(&Default::default());
            encode(&mut encoder);
            self.queue.submit([encoder.finish()]);
        })
    }

    /// A buffer without contents.
    pub fn buffer(&self, size: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
        self.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size,
            usage,
            mapped_at_creation: false,
        })
    }

    /// A buffer with contents.
    pub fn buffer_of<T: bytemuck::NoUninit>(
        &self,
        contents: &[T],
        usage: wgpu::BufferUsages,
    ) -> wgpu::Buffer {
        let contents = bytemuck::cast_slice(contents);
        (self.device).create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: None,
            contents,
            usage,
        })
    }

    /// A texture to sample, with the texels of all its levels.
    pub fn texture_of(
        &self,
        [width, height]: [u32; 2],
        levels: u32,
        format: wgpu::TextureFormat,
        texels: &[u8],
    ) -> wgpu::TextureView {
        let descriptor = wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d {
                width,
                height,
                depth_or_array_layers: 1,
            },
            mip_level_count: levels,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        };
        let order = wgpu::util::TextureDataOrder::LayerMajor;
        (self.device)
            .create_texture_with_data(&self.queue, &descriptor, order, texels)
            .create_view(&Default::default())
    }

    /// Compiles a shader.
    pub fn module<'s>(
        &self,
        label: &str,
        source: impl Into<std::borrow::Cow<'s, str>>,
    ) -> wgpu::ShaderModule {
        let source = wgpu::ShaderSource::Wgsl(source.into());
        (self.device).create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(label),
            source,
        })
    }

    /// Waits for all submitted work.
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
            // The receiver outlives the wait below, so a failed send can be ignored.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_adapter_is_found_by_a_part_of_its_name_ignoring_case() {
        let names = ["NVIDIA H200", "llvmpipe (LLVM 15.0.6, 256 bits)"];
        assert_eq!(named(&names, "nvidia"), Some(0));
        assert_eq!(named(&names, "LLVM"), Some(1));
        assert_eq!(named(&names, "radeon"), None);
    }

    #[test]
    fn the_error_for_an_absent_adapter_lists_those_present() {
        let Err(error) = open(Some("no such adapter")) else {
            panic!("opened an adapter that does not exist");
        };
        let message = error.to_string();
        assert!(message.contains("'no such adapter'"), "{message}");
        assert!(message.contains("llvmpipe"), "{message}");
    }
}
