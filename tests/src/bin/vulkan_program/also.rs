//! What the program does besides its draws.

use crate::gpu::{Gpu, Result, checked};
use crate::sets::Sets;
use crate::shaders;
use ash::{Device, vk};

/// Workgroups of the dispatch. A workgroup has 8x4 invocations, and each reads one texel.
const GROUPS: [u32; 3] = [4, 2, 1];

/// Choices by `--also`.
#[derive(Clone, Copy, Default)]
pub struct Also {
    /// Vertex shaders read a texel of a two-dimensional texture.
    pub vertex: bool,
    /// A compute shader reads texels of a two-dimensional texture.
    pub compute: bool,
    /// The host signals what a frame's commands wait for after it has submitted them.
    pub late: bool,
    /// The same with an event.
    pub event: bool,
    /// The picture is not read back.
    pub unread: bool,
}

impl Also {
    /// Parses a list of names.
    pub fn parse(text: &str) -> Result<Self> {
        let mut also = Self::default();
        for name in text.split(',') {
            *match name {
                "vertex" => &mut also.vertex,
                "compute" => &mut also.compute,
                "late" => &mut also.late,
                "event" => &mut also.event,
                "unread" => &mut also.unread,
                _ => return Err(format!("--also: {name}")),
            } = true;
        }
        Ok(also)
    }
}

/// Objects of these choices.
pub struct Extras {
    compute: Option<vk::Pipeline>,
    semaphore: Option<vk::Semaphore>,
    event: Option<vk::Event>,
}

impl Extras {
    pub fn new(gpu: &Gpu, also: Also, layout: vk::PipelineLayout) -> Result<Self> {
        let device = &gpu.device;
        let mut kind = vk::SemaphoreTypeCreateInfo::default()
            .semaphore_type(vk::SemaphoreType::TIMELINE)
            .initial_value(0);
        let info = vk::SemaphoreCreateInfo::default().push_next(&mut kind);
        // SAFETY: the device is open.
        unsafe {
            let semaphore = also.late.then(|| device.create_semaphore(&info, None));
            let info = vk::EventCreateInfo::default();
            let event = also.event.then(|| device.create_event(&info, None));
            Ok(Self {
                compute: also.compute.then(|| compute(gpu, layout)).transpose()?,
                semaphore: checked("a semaphore", semaphore.transpose())?,
                event: checked("an event", event.transpose())?,
            })
        }
    }

    /// Records the commands before a frame's render passes.
    pub fn record(&self, device: &Device, buffer: vk::CommandBuffer, sets: &Sets) {
        let point = vk::PipelineBindPoint::COMPUTE;
        let all = vk::PipelineStageFlags::ALL_COMMANDS;
        // SAFETY: the command buffer is being recorded, and all handles are the device's.
        unsafe {
            if let Some(event) = self.event {
                let host = vk::PipelineStageFlags::HOST;
                device.cmd_wait_events(buffer, &[event], host, all, &[], &[], &[]);
            }
            if let Some(pipeline) = self.compute {
                device.cmd_bind_pipeline(buffer, point, pipeline);
                device.cmd_bind_descriptor_sets(buffer, point, sets.layout, 0, &sets.sets, &[]);
                let [x, y, z] = GROUPS;
                device.cmd_dispatch(buffer, x, y, z);
            }
        }
    }

    /// Submits a frame's commands and waits for them. The host signals after the submission.
    pub fn submit(&self, gpu: &Gpu, buffer: vk::CommandBuffer, frame: u32) -> Result<()> {
        let device = &gpu.device;
        let (buffers, values) = ([buffer], [u64::from(frame) + 1]);
        let semaphores: Vec<vk::Semaphore> = self.semaphore.into_iter().collect();
        let stages = [vk::PipelineStageFlags::ALL_COMMANDS];
        let mut timeline = vk::TimelineSemaphoreSubmitInfo::default();
        let mut submit = vk::SubmitInfo::default().command_buffers(&buffers);
        if self.semaphore.is_some() {
            timeline = timeline.wait_semaphore_values(&values);
            submit = submit
                .wait_semaphores(&semaphores)
                .wait_dst_stage_mask(&stages)
                .push_next(&mut timeline);
        }
        // SAFETY: the commands are complete; the event is reset when they have ended.
        unsafe {
            let submitted = device.queue_submit(gpu.queue, &[submit], vk::Fence::null());
            checked("a submission", submitted)?;
            if let Some(semaphore) = self.semaphore {
                let info = vk::SemaphoreSignalInfo::default()
                    .semaphore(semaphore)
                    .value(values[0]);
                checked("a signal", device.signal_semaphore(&info))?;
            }
            if let Some(event) = self.event {
                checked("an event", device.set_event(event))?;
            }
            checked("the queue", device.queue_wait_idle(gpu.queue))?;
            if let Some(event) = self.event {
                checked("an event", device.reset_event(event))?;
            }
        }
        Ok(())
    }
}

/// A compute pipeline whose shader reads texels.
fn compute(gpu: &Gpu, layout: vk::PipelineLayout) -> Result<vk::Pipeline> {
    let words = shaders::compute()?;
    let info = vk::ShaderModuleCreateInfo::default().code(&words);
    let device = &gpu.device;
    // SAFETY: the device is open, and the module exists until the pipeline is created.
    unsafe {
        let module = checked("a shader module", device.create_shader_module(&info, None))?;
        let stage = vk::PipelineShaderStageCreateInfo::default()
            .stage(vk::ShaderStageFlags::COMPUTE)
            .module(module)
            .name(c"compute");
        let info = [vk::ComputePipelineCreateInfo::default()
            .stage(stage)
            .layout(layout)];
        let made = device.create_compute_pipelines(vk::PipelineCache::null(), &info, None);
        device.destroy_shader_module(module, None);
        let made = made.map_err(|(_, error)| error);
        Ok(checked("a compute pipeline", made)?[0])
    }
}
