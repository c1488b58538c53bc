//! A session from start to end.

use crate::api::{Api, Result, of};
use crate::draw::texture;
use crate::gpu::Gpu;
use crate::targets::Targets;
use crate::{Options, xr_do};
use ash::vk::{self, Handle as _};
use openxr_sys as xr;
use std::fmt::Write as _;
use xr::StructureType;

/// Longest loop of frames of a program that ignores the runtime.
const MOST_FRAMES: u32 = 100_000;

/// An instance, and a session on Vulkan.
pub struct Opened {
    pub api: Api,
    pub session: xr::Session,
    pub gpu: Gpu,
}

/// Creates an instance with extensions.
pub fn instance(names: &[&std::ffi::CStr]) -> Result<(Api, xr::SystemId)> {
    let mut api = Api::open()?;
    let names: Vec<_> = names.iter().map(|name| name.as_ptr()).collect();
    let info = Api::info(&names);
    let mut made = xr::Instance::default();
    xr_do!(api, CreateInstance(&info, &mut made));
    api.instance = made;
    let mut info: xr::SystemGetInfo = of(StructureType::SYSTEM_GET_INFO);
    info.form_factor = xr::FormFactor::HEAD_MOUNTED_DISPLAY;
    let mut system = xr::SystemId::default();
    xr_do!(api, GetSystem(api.instance, &info, &mut system));
    Ok((api, system))
}

/// A device of Vulkan, by the first or the second version of the extension.
fn gpu(
    api: &Api,
    system: xr::SystemId,
    enable: u32,
) -> Result<(Gpu, xr::GraphicsBindingVulkanKHR)> {
    // SAFETY: the loader is a Vulkan loader; what is created lives until the program ends.
    unsafe {
        let entry = ash::Entry::load().map_err(|error| error.to_string())?;
        let get = std::mem::transmute::<
            vk::PFN_vkGetInstanceProcAddr,
            xr::platform::VkGetInstanceProcAddr,
        >(entry.static_fn().get_instance_proc_addr);
        let mut requirements: xr::GraphicsRequirementsVulkanKHR =
            of(StructureType::GRAPHICS_REQUIREMENTS_VULKAN_KHR);
        let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
        let info = vk::InstanceCreateInfo::default().application_info(&application);
        let (mut instance, mut code) = (std::ptr::null(), 0);
        let mut physical = std::ptr::null();
        if enable == 1 {
            xr_do!(
                api,
                GetVulkanGraphicsRequirementsKHR(api.instance, system, &mut requirements)
            );
            let made = entry
                .create_instance(&info, None)
                .map_err(|error| error.to_string())?;
            instance = made.handle().as_raw() as xr::platform::VkInstance;
            xr_do!(
                api,
                GetVulkanGraphicsDeviceKHR(api.instance, system, instance, &mut physical)
            );
        } else {
            xr_do!(
                api,
                GetVulkanGraphicsRequirements2KHR(api.instance, system, &mut requirements)
            );
            let mut create: xr::VulkanInstanceCreateInfoKHR =
                of(StructureType::VULKAN_INSTANCE_CREATE_INFO_KHR);
            create.system_id = system;
            create.pfn_get_instance_proc_addr = Some(get);
            create.vulkan_create_info = (&raw const info).cast();
            xr_do!(
                api,
                CreateVulkanInstanceKHR(api.instance, &create, &mut instance, &mut code)
            );
            let mut which: xr::VulkanGraphicsDeviceGetInfoKHR =
                of(StructureType::VULKAN_GRAPHICS_DEVICE_GET_INFO_KHR);
            (which.system_id, which.vulkan_instance) = (system, instance);
            xr_do!(
                api,
                GetVulkanGraphicsDevice2KHR(api.instance, &which, &mut physical)
            );
        }
        let loaded =
            ash::Instance::load(entry.static_fn(), vk::Instance::from_raw(instance as u64));
        let device = vk::PhysicalDevice::from_raw(physical as u64);
        let priorities = [1.0];
        let queues = [vk::DeviceQueueCreateInfo::default()
            .queue_family_index(0)
            .queue_priorities(&priorities)];
        let mut multiview = vk::PhysicalDeviceVulkan11Features::default().multiview(true);
        let mut rendering = vk::PhysicalDeviceVulkan13Features::default().dynamic_rendering(true);
        let info = vk::DeviceCreateInfo::default()
            .queue_create_infos(&queues)
            .push_next(&mut multiview)
            .push_next(&mut rendering);
        let mut made = std::ptr::null();
        if enable == 1 {
            let created = loaded
                .create_device(device, &info, None)
                .map_err(|error| error.to_string())?;
            made = created.handle().as_raw() as xr::platform::VkDevice;
        } else {
            let mut create: xr::VulkanDeviceCreateInfoKHR =
                of(StructureType::VULKAN_DEVICE_CREATE_INFO_KHR);
            create.system_id = system;
            create.pfn_get_instance_proc_addr = Some(get);
            create.vulkan_physical_device = physical;
            create.vulkan_create_info = (&raw const info).cast();
            xr_do!(
                api,
                CreateVulkanDeviceKHR(api.instance, &create, &mut made, &mut code)
            );
        }
        let mut binding: xr::GraphicsBindingVulkanKHR =
            of(StructureType::GRAPHICS_BINDING_VULKAN_KHR);
        (binding.instance, binding.physical_device, binding.device) = (instance, physical, made);
        let opened = ash::Device::load(loaded.fp_v1_0(), vk::Device::from_raw(made as u64));
        Ok((Gpu::of_device(entry, loaded, device, opened), binding))
    }
}

impl Opened {
    pub fn new(enable: u32, more: &[&std::ffi::CStr]) -> Result<Self> {
        let vulkan = [c"XR_KHR_vulkan_enable", c"XR_KHR_vulkan_enable2"][enable as usize - 1];
        let names: Vec<_> = [vulkan].into_iter().chain(more.iter().copied()).collect();
        let (api, system) = instance(&names)?;
        let (gpu, binding) = gpu(&api, system, enable)?;
        let mut info: xr::SessionCreateInfo = of(StructureType::SESSION_CREATE_INFO);
        info.next = (&raw const binding).cast();
        info.system_id = system;
        let mut session = xr::Session::default();
        xr_do!(api, CreateSession(api.instance, &info, &mut session));
        Ok(Self { api, session, gpu })
    }

    /// Takes all events; returns the last new state of the session.
    pub fn poll(&self) -> Result<Vec<xr::SessionState>> {
        let mut states = Vec::new();
        loop {
            let mut event: xr::EventDataBuffer = of(StructureType::EVENT_DATA_BUFFER);
            let code = xr_do!(self.api, PollEvent(self.api.instance, &mut event));
            if code == xr::Result::EVENT_UNAVAILABLE {
                return Ok(states);
            }
            if event.ty == StructureType::EVENT_DATA_SESSION_STATE_CHANGED {
                // SAFETY: the type tells the structure.
                let changed =
                    unsafe { &*(&raw const event).cast::<xr::EventDataSessionStateChanged>() };
                states.push(changed.state);
            }
        }
    }

    pub fn begin(&self) -> Result<()> {
        let mut info: xr::SessionBeginInfo = of(StructureType::SESSION_BEGIN_INFO);
        info.primary_view_configuration_type = xr::ViewConfigurationType::PRIMARY_STEREO;
        xr_do!(self.api, BeginSession(self.session, &info));
        Ok(())
    }

    pub fn space(&self, kind: xr::ReferenceSpaceType) -> Result<xr::Space> {
        let mut info: xr::ReferenceSpaceCreateInfo = of(StructureType::REFERENCE_SPACE_CREATE_INFO);
        info.reference_space_type = kind;
        info.pose_in_reference_space = xr::Posef::IDENTITY;
        let mut space = xr::Space::default();
        xr_do!(
            self.api,
            CreateReferenceSpace(self.session, &info, &mut space)
        );
        Ok(space)
    }

    /// Waits for a frame and begins it.
    pub fn begin_frame(&self) -> Result<xr::FrameState> {
        let mut frame: xr::FrameState = of(StructureType::FRAME_STATE);
        xr_do!(
            self.api,
            WaitFrame(self.session, std::ptr::null(), &mut frame)
        );
        xr_do!(self.api, BeginFrame(self.session, std::ptr::null()));
        Ok(frame)
    }

    pub fn views(&self, space: xr::Space, time: xr::Time) -> Result<[xr::View; 2]> {
        let mut info: xr::ViewLocateInfo = of(StructureType::VIEW_LOCATE_INFO);
        info.view_configuration_type = xr::ViewConfigurationType::PRIMARY_STEREO;
        (info.display_time, info.space) = (time, space);
        let mut state: xr::ViewState = of(StructureType::VIEW_STATE);
        let mut views: [xr::View; 2] = [of(StructureType::VIEW), of(StructureType::VIEW)];
        let mut count = 0;
        xr_do!(
            self.api,
            LocateViews(
                self.session,
                &info,
                &mut state,
                2,
                &mut count,
                views.as_mut_ptr()
            )
        );
        Ok(views)
    }

    /// Ends a frame with a projection layer of these views, if any.
    pub fn end_frame(
        &self,
        time: xr::Time,
        space: xr::Space,
        views: &[xr::CompositionLayerProjectionView],
    ) -> xr::Result {
        let mut layer: xr::CompositionLayerProjection =
            of(StructureType::COMPOSITION_LAYER_PROJECTION);
        (layer.space, layer.view_count, layer.views) = (space, views.len() as u32, views.as_ptr());
        let layers = [(&raw const layer).cast::<xr::CompositionLayerBaseHeader>()];
        let mut info: xr::FrameEndInfo = of(StructureType::FRAME_END_INFO);
        info.display_time = time;
        info.environment_blend_mode = xr::EnvironmentBlendMode::OPAQUE;
        info.layer_count = u32::from(!views.is_empty());
        info.layers = layers.as_ptr();
        crate::xr_call!(self.api, EndFrame(self.session, &info))
    }
}

/// Writes what the runtime gave for the last frame.
fn write(file: &str, views: &[xr::View; 2]) -> Result<()> {
    let mut text = String::from("[");
    for (eye, view) in views.iter().enumerate() {
        let (q, p, f) = (view.pose.orientation, view.pose.position, view.fov);
        let comma = if eye == 0 { "" } else { "," };
        let _ = write!(
            text,
            r#"{comma}{{"orientation":[{},{},{},{}],"position":[{},{},{}],"angles":[{},{},{},{}]}}"#,
            q.x,
            q.y,
            q.z,
            q.w,
            p.x,
            p.y,
            p.z,
            f.angle_left,
            f.angle_right,
            f.angle_up,
            f.angle_down
        );
    }
    text.push(']');
    std::fs::write(file, text).map_err(|error| format!("{file}: {error}"))
}

/// Draws frames until the runtime asks the program to end.
pub fn run(options: &Options) -> Result<()> {
    let opened = Opened::new(options.enable, &[])?;
    let texture = texture(&opened.gpu)?;
    let targets = Targets::new(
        &opened.api,
        opened.session,
        &opened.gpu,
        options.layout,
        &texture,
    )?;
    let space = opened.space(options.space)?;
    let (mut running, mut last) = (false, None);
    for _ in 0..MOST_FRAMES {
        for state in opened.poll()? {
            match state {
                xr::SessionState::READY => {
                    opened.begin()?;
                    running = true;
                }
                xr::SessionState::STOPPING if options.end == "crash" => std::process::abort(),
                xr::SessionState::STOPPING if options.end == "ignore" => {}
                xr::SessionState::STOPPING => {
                    xr_do!(opened.api, EndSession(opened.session));
                    running = false;
                }
                xr::SessionState::EXITING => {
                    xr_do!(opened.api, DestroySession(opened.session));
                    if let (Some(file), Some(views)) = (&options.eyes, &last) {
                        write(file, views)?;
                    }
                    xr_do!(opened.api, DestroyInstance(opened.api.instance));
                    return Ok(());
                }
                _ => {}
            }
        }
        if running {
            last = frame(&opened, &targets, space, options)?.or(last);
        }
    }
    Err("the runtime never asked to end".to_owned())
}

/// Draws a frame, if it is to be rendered, and returns the views that the runtime gave.
fn frame(
    opened: &Opened,
    targets: &Targets,
    space: xr::Space,
    options: &Options,
) -> Result<Option<[xr::View; 2]>> {
    let frame = opened.begin_frame()?;
    let (time, api) = (frame.predicted_display_time, &opened.api);
    if frame.should_render == xr::FALSE || options.empty {
        opened.end_frame(time, space, &[]);
        return Ok(None);
    }
    let views = opened.views(space, time)?;
    let mut acquired = Vec::new();
    for chain in &targets.chains {
        let mut image = 0;
        xr_do!(
            api,
            AcquireSwapchainImage(chain.handle, std::ptr::null(), &mut image)
        );
        let mut wait: xr::SwapchainImageWaitInfo = of(StructureType::SWAPCHAIN_IMAGE_WAIT_INFO);
        wait.timeout = xr::Duration::INFINITE;
        xr_do!(api, WaitSwapchainImage(chain.handle, &wait));
        acquired.push(image as usize);
    }
    targets.draw(&opened.gpu, &acquired)?;
    for chain in &targets.chains {
        xr_do!(api, ReleaseSwapchainImage(chain.handle, std::ptr::null()));
    }
    let shown = [0, 1].map(|eye| {
        let mut view: xr::CompositionLayerProjectionView =
            of(StructureType::COMPOSITION_LAYER_PROJECTION_VIEW);
        (view.pose, view.fov) = (views[eye].pose, views[eye].fov);
        view.sub_image = targets.shown(eye);
        view
    });
    match opened.end_frame(time, space, &shown) {
        xr::Result::SUCCESS => Ok(Some(views)),
        code => Err(format!("xrEndFrame: {code:?}")),
    }
}
