//! Pipeline libraries: pipelines that consist of parts which programs create and link separately
//! (`VK_EXT_graphics_pipeline_library`).

use super::api::{find, slice};
use super::device::Device;
use crate::track::Library;
use ash::vk::{self, TaggedStructure};
use std::ffi::c_void;
use std::sync::Arc;

pub(super) use crate::track::Parts;

/// Whether a description is of a library.
///
/// # Safety
/// A valid description.
pub(super) unsafe fn is_library(info: &vk::GraphicsPipelineCreateInfo<'_>) -> bool {
    // SAFETY: as the caller promises.
    let flags2 = unsafe { find::<vk::PipelineCreateFlags2CreateInfoKHR<'_>>(info.p_next) };
    match flags2 {
        // These flags take precedence.
        Some(all) => all.flags.contains(vk::PipelineCreateFlags2KHR::LIBRARY),
        None => info.flags.contains(vk::PipelineCreateFlags::LIBRARY_KHR),
    }
}

/// Parts that a description itself has. The others come from its libraries.
///
/// # Safety
/// A valid description.
pub(super) unsafe fn own_parts(info: &vk::GraphicsPipelineCreateInfo<'_>) -> Parts {
    // SAFETY: as the caller promises.
    unsafe {
        if let Some(library) = find::<vk::GraphicsPipelineLibraryCreateInfoEXT<'_>>(info.p_next) {
            return library.flags;
        }
        let links = find::<vk::PipelineLibraryCreateInfoKHR<'_>>(info.p_next);
        if links.is_some_and(|links| links.library_count > 0) {
            return Parts::empty();
        }
    }
    Parts::VERTEX_INPUT_INTERFACE
        | Parts::PRE_RASTERIZATION_SHADERS
        | Parts::FRAGMENT_SHADER
        | Parts::FRAGMENT_OUTPUT_INTERFACE
}

/// A library of a description: its handle and, if it is tracked, its properties.
pub(super) type LinkedLibrary = (vk::Pipeline, Option<Arc<Library>>);

/// Libraries of a description.
///
/// # Safety
/// A valid description.
pub(super) unsafe fn links(
    device: &Device,
    info: &vk::GraphicsPipelineCreateInfo<'_>,
) -> Vec<LinkedLibrary> {
    // SAFETY: as the caller promises.
    let handles = unsafe {
        find::<vk::PipelineLibraryCreateInfoKHR<'_>>(info.p_next)
            .map_or(&[] as &[vk::Pipeline], |links| {
                slice(links.p_libraries, links.library_count)
            })
    };
    let tracker = device.tracker();
    let library = |handle| tracker.pipelines.library(handle);
    handles.iter().map(|h| (*h, library(*h))).collect()
}

/// Sizes of the structures that may precede the list of libraries in a chain.
const SIZES: [(vk::StructureType, usize); 6] = [
    size::<vk::GraphicsPipelineLibraryCreateInfoEXT<'_>>(),
    size::<vk::PipelineRenderingCreateInfo<'_>>(),
    size::<vk::PipelineCreateFlags2CreateInfoKHR<'_>>(),
    size::<vk::PipelineRobustnessCreateInfoEXT<'_>>(),
    size::<vk::RenderingAttachmentLocationInfoKHR<'_>>(),
    size::<vk::RenderingInputAttachmentIndexInfoKHR<'_>>(),
];

const fn size<T: TaggedStructure>() -> (vk::StructureType, usize) {
    (T::STRUCTURE_TYPE, size_of::<T>())
}

/// A chain with another list of libraries. The structures before the list are copied, and the structures after
/// it are those of the program.
pub(super) struct Chain {
    /// Copies, from the last to the first. Each starts with its type and its successor.
    _copies: Vec<Vec<u64>>,
    _list: Box<vk::PipelineLibraryCreateInfoKHR<'static>>,
    _libraries: Vec<vk::Pipeline>,
    first: *const c_void,
}

impl Chain {
    /// Replaces the list of libraries of a chain, which must have one.
    ///
    /// # Safety
    /// A valid chain, which lives as long as the result.
    pub unsafe fn new(
        p_next: *const c_void,
        libraries: Vec<vk::Pipeline>,
    ) -> Result<Self, &'static str> {
        const UNKNOWN: &str = "an unknown structure in the description of linked libraries";
        let mut before: Vec<Vec<u64>> = Vec::new();
        let mut at = p_next.cast::<vk::BaseInStructure<'_>>();
        // SAFETY: the structures of a chain have the same head; their types define their sizes.
        let mut list = unsafe {
            loop {
                let base = at.as_ref().ok_or(UNKNOWN)?;
                if base.s_type == vk::PipelineLibraryCreateInfoKHR::STRUCTURE_TYPE {
                    break Box::new(*at.cast::<vk::PipelineLibraryCreateInfoKHR<'static>>());
                }
                // Only the program reads this structure.
                if base.s_type != vk::PipelineCreationFeedbackCreateInfo::STRUCTURE_TYPE {
                    let known = SIZES.iter().find(|(s_type, _)| *s_type == base.s_type);
                    let (_, bytes) = known.ok_or(UNKNOWN)?;
                    let mut copy = vec![0_u64; bytes.div_ceil(8)];
                    std::ptr::copy_nonoverlapping(
                        at.cast::<u8>(),
                        copy.as_mut_ptr().cast(),
                        *bytes,
                    );
                    before.push(copy);
                }
                at = base.p_next;
            }
        };
        list.library_count = libraries.len() as u32;
        list.p_libraries = libraries.as_ptr();
        let mut first: *const c_void = (&raw const *list).cast();
        before.reverse();
        for copy in &mut before {
            let head = copy.as_mut_ptr().cast::<vk::BaseInStructure<'_>>();
            // SAFETY: each copy is at least as large as a head, and aligned to 8 bytes.
            unsafe { (*head).p_next = first.cast() };
            first = head.cast();
        }
        Ok(Self {
            _copies: before,
            _list: list,
            _libraries: libraries,
            first,
        })
    }

    /// First structure.
    pub fn first(&self) -> *const c_void {
        self.first
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ash::vk::Handle;

    #[test]
    fn a_description_without_libraries_has_all_parts() {
        let plain = vk::GraphicsPipelineCreateInfo::default();
        // SAFETY: valid descriptions.
        unsafe {
            assert!(own_parts(&plain).contains(Parts::FRAGMENT_SHADER));
            let libraries = [vk::Pipeline::from_raw(1)];
            let mut links = vk::PipelineLibraryCreateInfoKHR::default().libraries(&libraries);
            let linked = plain.push_next(&mut links);
            assert_eq!(own_parts(&linked), Parts::empty());
            let mut own = vk::GraphicsPipelineLibraryCreateInfoEXT::default()
                .flags(Parts::FRAGMENT_OUTPUT_INTERFACE);
            let both = linked.push_next(&mut own);
            assert_eq!(own_parts(&both), Parts::FRAGMENT_OUTPUT_INTERFACE);
        }
    }

    #[test]
    fn flags_of_64_bits_take_precedence() {
        let library = vk::PipelineCreateFlags::LIBRARY_KHR;
        let mut flags2 = vk::PipelineCreateFlags2CreateInfoKHR::default();
        // SAFETY: valid descriptions.
        unsafe {
            let info = vk::GraphicsPipelineCreateInfo::default().flags(library);
            assert!(is_library(&info));
            assert!(!is_library(&info.push_next(&mut flags2)));
        }
    }

    #[test]
    fn only_the_list_of_libraries_changes_in_a_chain() {
        let old = [vk::Pipeline::from_raw(1), vk::Pipeline::from_raw(2)];
        let formats = [vk::Format::R8_UNORM];
        let mut after = vk::PipelineRobustnessCreateInfoEXT::default();
        let mut list = vk::PipelineLibraryCreateInfoKHR::default().libraries(&old);
        let mut feedback = vk::PipelineCreationFeedbackCreateInfo::default();
        let mut before = vk::PipelineRenderingCreateInfo::default()
            .view_mask(3)
            .color_attachment_formats(&formats);
        let info = vk::GraphicsPipelineCreateInfo::default()
            .push_next(&mut after)
            .push_next(&mut list)
            .push_next(&mut feedback)
            .push_next(&mut before);
        let new = vec![vk::Pipeline::from_raw(7)];
        // SAFETY: a valid chain, which lives until the end of the test.
        unsafe {
            let chain = Chain::new(info.p_next, new.clone()).unwrap();
            let rendering = find::<vk::PipelineRenderingCreateInfo<'_>>(chain.first()).unwrap();
            assert_eq!(rendering.view_mask, 3);
            assert_eq!(*rendering.p_color_attachment_formats, formats[0]);
            let links = find::<vk::PipelineLibraryCreateInfoKHR<'_>>(chain.first()).unwrap();
            assert_eq!(slice(links.p_libraries, links.library_count), &new);
            assert!(find::<vk::PipelineRobustnessCreateInfoEXT<'_>>(chain.first()).is_some());
            let feedback = find::<vk::PipelineCreationFeedbackCreateInfo<'_>>(chain.first());
            assert!(feedback.is_none());
            let links = find::<vk::PipelineLibraryCreateInfoKHR<'_>>(info.p_next).unwrap();
            assert_eq!(slice(links.p_libraries, links.library_count), &old);
        }
    }

    #[test]
    fn a_chain_with_an_unknown_structure_is_refused() {
        let old = [vk::Pipeline::from_raw(1)];
        let mut list = vk::PipelineLibraryCreateInfoKHR::default().libraries(&old);
        let mut unknown = vk::PipelineCompilerControlCreateInfoAMD::default();
        let info = vk::GraphicsPipelineCreateInfo::default()
            .push_next(&mut list)
            .push_next(&mut unknown);
        // SAFETY: a valid chain, which lives until the end of the test.
        assert!(unsafe { Chain::new(info.p_next, Vec::new()) }.is_err());
    }
}
