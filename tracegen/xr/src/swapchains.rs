//! Swapchains: images that a program renders into and shows.

use crate::chain::{input, structures, values};
use crate::graphics::Image;
use crate::state::{Answer, Code, DONE, INVALID, Instance};
use crate::system::{MOST_SAMPLES, MOST_SIZE_PX};
use openxr_sys as xr;
use std::collections::VecDeque;
use xr::{Handle, StructureType, SwapchainCreateFlags, SwapchainUsageFlags};

/// Number of images of a swapchain whose content changes.
const IMAGES: usize = 3;
/// Most mip levels, array layers.
const MOST_LEVELS: u32 = 15;
const MOST_LAYERS: u32 = 2048;

/// A swapchain.
pub(crate) struct Swapchain {
    images: Vec<Image>,
    size_px: [u32; 2],
    layers: u32,
    is_static: bool,
    /// Images that the program holds, in the order in which it acquired them.
    acquired: VecDeque<usize>,
    /// Whether it has waited for the first of them.
    waited: bool,
    /// Number of images that were acquired in all.
    count: usize,
    /// Image that was released last.
    released: Option<usize>,
}

/// A part of an image that a layer shows.
pub(crate) struct Shown {
    pub image: u64,
    pub layer: u32,
    pub rect: [i32; 4],
}

impl Swapchain {
    fn acquire(&mut self) -> Result<u32, Code> {
        let used_up = self.is_static && self.count > 0;
        if used_up || self.acquired.len() == self.images.len() {
            return Err(Code::ERROR_CALL_ORDER_INVALID);
        }
        let image = self.count % self.images.len();
        self.count += 1;
        self.acquired.push_back(image);
        Ok(image as u32)
    }

    fn wait(&mut self) -> Answer {
        if self.acquired.is_empty() || self.waited {
            return Err(Code::ERROR_CALL_ORDER_INVALID);
        }
        self.waited = true;
        DONE
    }

    fn release(&mut self) -> Answer {
        if !std::mem::replace(&mut self.waited, false) {
            return Err(Code::ERROR_CALL_ORDER_INVALID);
        }
        self.released = self.acquired.pop_front();
        DONE
    }
}

impl Instance {
    /// The part of an image that a layer shows, after a check.
    pub fn shown(&self, part: &xr::SwapchainSubImage) -> Result<Shown, Code> {
        let swapchain = self.swapchains.get(&part.swapchain.into_raw());
        let swapchain = swapchain.ok_or(Code::ERROR_HANDLE_INVALID)?;
        let (at, size) = (part.image_rect.offset, part.image_rect.extent);
        let fits = |at: i32, size: i32, most: u32| {
            at >= 0 && size > 0 && i64::from(at) + i64::from(size) <= i64::from(most)
        };
        let [width, height] = swapchain.size_px;
        if !fits(at.x, size.width, width) || !fits(at.y, size.height, height) {
            return Err(Code::ERROR_SWAPCHAIN_RECT_INVALID);
        }
        if part.image_array_index >= swapchain.layers {
            return Err(INVALID);
        }
        let released = swapchain.released.ok_or(Code::ERROR_LAYER_INVALID)?;
        Ok(Shown {
            image: swapchain.images[released].raw(),
            layer: part.image_array_index,
            rect: [at.x, at.y, size.width, size.height],
        })
    }
}

/// Refuses a swapchain that no session can have.
fn check(info: &xr::SwapchainCreateInfo) -> Result<(), Code> {
    let flags = info.create_flags;
    let known_flags = SwapchainCreateFlags::STATIC_IMAGE | SwapchainCreateFlags::PROTECTED_CONTENT;
    let known_usage = SwapchainUsageFlags::COLOR_ATTACHMENT
        | SwapchainUsageFlags::DEPTH_STENCIL_ATTACHMENT
        | SwapchainUsageFlags::UNORDERED_ACCESS
        | SwapchainUsageFlags::TRANSFER_SRC
        | SwapchainUsageFlags::TRANSFER_DST
        | SwapchainUsageFlags::SAMPLED
        | SwapchainUsageFlags::MUTABLE_FORMAT
        | SwapchainUsageFlags::INPUT_ATTACHMENT;
    let within = |value: u32, most: u32| (1..=most).contains(&value);
    let fits = known_flags.contains(flags)
        && known_usage.contains(info.usage_flags)
        && within(info.width, MOST_SIZE_PX)
        && within(info.height, MOST_SIZE_PX)
        && within(info.mip_count, MOST_LEVELS)
        && within(info.array_size, MOST_LAYERS)
        && [1, 6].contains(&info.face_count)
        && info.sample_count > 0;
    match fits {
        false => Err(INVALID),
        true if flags.contains(SwapchainCreateFlags::PROTECTED_CONTENT) => {
            Err(Code::ERROR_FEATURE_UNSUPPORTED)
        }
        true if ![1, MOST_SAMPLES].contains(&info.sample_count) => {
            Err(Code::ERROR_FEATURE_UNSUPPORTED)
        }
        true => Ok(()),
    }
}

api! {
    fn enumerate_swapchain_formats(session: xr::Session, capacity: u32, count: *mut u32, into: *mut i64) |state| {
        let formats = state.session(session)?.graphics.formats();
        values(&formats, capacity, count, into)
    }

    fn create_swapchain(session: xr::Session, info: *const xr::SwapchainCreateInfo, swapchain: *mut xr::Swapchain) |state| {
        let of = state.session(session)?;
        let info = input(info, StructureType::SWAPCHAIN_CREATE_INFO)?;
        let swapchain = swapchain.as_mut().ok_or(INVALID)?;
        let graphics = &of.graphics;
        check(info)?;
        if !graphics.formats().contains(&info.format) {
            return Err(Code::ERROR_SWAPCHAIN_FORMAT_UNSUPPORTED);
        }
        let is_static = info.create_flags.contains(SwapchainCreateFlags::STATIC_IMAGE);
        let count = if is_static { 1 } else { IMAGES };
        let images = (0..count).map(|_| graphics.image(info)).collect::<Result<Vec<_>, _>>()?;
        let made = Swapchain {
            images,
            size_px: [info.width, info.height],
            layers: info.array_size,
            is_static,
            acquired: VecDeque::new(),
            waited: false,
            count: 0,
            released: None,
        };
        let handle = state.handle();
        state.any_instance()?.swapchains.insert(handle, made);
        *swapchain = xr::Swapchain::from_raw(handle);
        DONE
    }

    fn destroy_swapchain(swapchain: xr::Swapchain) |state| {
        let removed = state.any_instance()?.swapchains.remove(&swapchain.into_raw());
        removed.map(|_| Code::SUCCESS).ok_or(Code::ERROR_HANDLE_INVALID)
    }

    fn enumerate_swapchain_images(
        swapchain: xr::Swapchain, capacity: u32, count: *mut u32, into: *mut xr::SwapchainImageBaseHeader,
    ) |state| {
        let images = &state.swapchain(swapchain)?.images;
        match images.first() {
            Some(Image::OpenGl(_)) => {
                let into = into.cast::<xr::SwapchainImageOpenGLKHR>();
                let fill = |place: usize, of: &mut xr::SwapchainImageOpenGLKHR| {
                    if let Image::OpenGl(texture) = &images[place] {
                        of.image = texture.name;
                    }
                };
                structures(images.len(), StructureType::SWAPCHAIN_IMAGE_OPENGL_KHR, capacity, count, into, fill)
            }
            _ => {
                let into = into.cast::<xr::SwapchainImageVulkanKHR>();
                let fill = |place: usize, of: &mut xr::SwapchainImageVulkanKHR| of.image = images[place].raw();
                structures(images.len(), StructureType::SWAPCHAIN_IMAGE_VULKAN_KHR, capacity, count, into, fill)
            }
        }
    }

    fn acquire_swapchain_image(swapchain: xr::Swapchain, info: *const xr::SwapchainImageAcquireInfo, index: *mut u32) |state| {
        let swapchain = state.swapchain(swapchain)?;
        if !info.is_null() {
            input(info, StructureType::SWAPCHAIN_IMAGE_ACQUIRE_INFO)?;
        }
        let index = index.as_mut().ok_or(INVALID)?;
        *index = swapchain.acquire()?;
        DONE
    }

    fn wait_swapchain_image(swapchain: xr::Swapchain, info: *const xr::SwapchainImageWaitInfo) |state| {
        let swapchain = state.swapchain(swapchain)?;
        input(info, StructureType::SWAPCHAIN_IMAGE_WAIT_INFO)?;
        swapchain.wait()
    }

    fn release_swapchain_image(swapchain: xr::Swapchain, info: *const xr::SwapchainImageReleaseInfo) |state| {
        let swapchain = state.swapchain(swapchain)?;
        if !info.is_null() {
            input(info, StructureType::SWAPCHAIN_IMAGE_RELEASE_INFO)?;
        }
        swapchain.release()
    }
}
