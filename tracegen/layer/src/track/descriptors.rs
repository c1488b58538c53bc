//! Descriptor sets: the image and sampler of each descriptor.

use super::Images;
use ash::vk::{self, Handle};
use spool::{SamplerInfo, ViewInfo};
use std::collections::{BTreeMap, HashMap, HashSet};

/// Content of a texture descriptor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Slot {
    /// The image.
    pub view: Option<ViewInfo>,
    /// The sampler.
    pub sampler: Option<SamplerInfo>,
}

/// A write of consecutive descriptors.
#[derive(Clone, Debug)]
pub struct Written {
    /// First binding.
    pub binding: u32,
    /// First element of the binding. Elements after its last one belong to the next binding.
    pub element: u32,
    /// Descriptor type.
    pub kind: vk::DescriptorType,
    /// Image and sampler of each descriptor; empty for buffers.
    pub images: Vec<vk::DescriptorImageInfo>,
}

/// An entry of an update template.
#[derive(Clone, Copy, Debug)]
pub struct TemplateEntry {
    /// First binding.
    pub binding: u32,
    /// First element of the binding.
    pub element: u32,
    /// Number of descriptors.
    pub count: u32,
    /// Descriptor type.
    pub kind: vk::DescriptorType,
    /// Offset of the first descriptor in the data.
    pub offset: usize,
    /// Distance between descriptors in the data.
    pub stride: usize,
}

/// An update template.
#[derive(Clone, Debug, Default)]
pub struct Template {
    /// Entries that are textures.
    pub entries: Vec<TemplateEntry>,
    /// Whether the template is for graphics pipelines.
    pub graphics: bool,
}

#[derive(Clone, Debug, Default)]
struct SetLayout {
    bindings: BTreeMap<u32, LayoutBinding>,
}

#[derive(Clone, Debug)]
struct LayoutBinding {
    count: u32,
    /// Immutable samplers of the binding.
    immutable: Vec<Option<SamplerInfo>>,
}

/// The texture descriptors of a set.
#[derive(Clone, Debug, Default)]
pub struct SetState {
    layout: SetLayout,
    slots: BTreeMap<(u32, u32), Slot>,
}

impl SetState {
    fn new(layout: &SetLayout) -> Self {
        let mut slots = BTreeMap::new();
        for (&binding, of) in &layout.bindings {
            for (element, sampler) in (0..).zip(&of.immutable) {
                let slot = Slot {
                    view: None,
                    sampler: *sampler,
                };
                slots.insert((binding, element), slot);
            }
        }
        Self {
            layout: layout.clone(),
            slots,
        }
    }

    /// The written elements of a binding.
    pub fn binding(&self, binding: u32) -> Vec<(u32, Slot)> {
        let all = self.slots.range((binding, 0)..=(binding, u32::MAX));
        all.map(|((_, element), slot)| (*element, *slot)).collect()
    }

    /// Binding and element at `step` descriptors after another one.
    fn place(&self, binding: u32, element: u32, step: u32) -> (u32, u32) {
        let mut rest = element.saturating_add(step);
        for (&number, of) in self.layout.bindings.range(binding..) {
            if rest < of.count {
                return (number, rest);
            }
            rest -= of.count;
        }
        // The layout is unknown.
        (binding, element.saturating_add(step))
    }

    /// The immutable sampler of a binding's element.
    fn immutable(&self, (binding, element): (u32, u32)) -> Option<SamplerInfo> {
        let of = self.layout.bindings.get(&binding)?;
        *of.immutable.get(element as usize)?
    }

    /// Applies a write.
    pub fn write(&mut self, written: &Written, images: &Images) {
        use vk::DescriptorType as Type;
        for (step, image) in (0..).zip(&written.images) {
            let place = self.place(written.binding, written.element, step);
            let immutable = self.immutable(place);
            let sampler = || immutable.or_else(|| images.sampler(image.sampler));
            let slot = match written.kind {
                Type::SAMPLER => Slot {
                    view: None,
                    sampler: sampler(),
                },
                Type::COMBINED_IMAGE_SAMPLER => Slot {
                    view: images.view(image.image_view),
                    sampler: sampler(),
                },
                Type::SAMPLED_IMAGE | Type::STORAGE_IMAGE | Type::INPUT_ATTACHMENT => Slot {
                    view: images.view(image.image_view),
                    sampler: None,
                },
                _ => continue,
            };
            self.slots.insert(place, slot);
        }
    }
}

/// Descriptor sets, layouts and update templates by handle.
#[derive(Debug, Default)]
pub struct Descriptors {
    layouts: HashMap<u64, SetLayout>,
    sets: HashMap<u64, SetState>,
    pools: HashMap<u64, HashSet<u64>>,
    templates: HashMap<u64, Template>,
}

impl Descriptors {
    /// Adds a layout, with binding, number of descriptors and immutable samplers of each entry.
    pub fn create_layout(
        &mut self,
        layout: vk::DescriptorSetLayout,
        bindings: impl IntoIterator<Item = (u32, u32, Vec<vk::Sampler>)>,
        images: &Images,
    ) {
        let of = |(binding, count, samplers): (u32, u32, Vec<vk::Sampler>)| {
            let immutable = samplers.into_iter().map(|s| images.sampler(s)).collect();
            (binding, LayoutBinding { count, immutable })
        };
        let bindings = bindings.into_iter().map(of).collect();
        self.layouts.insert(layout.as_raw(), SetLayout { bindings });
    }

    /// Removes a layout.
    pub fn destroy_layout(&mut self, layout: vk::DescriptorSetLayout) {
        self.layouts.remove(&layout.as_raw());
    }

    /// Adds a descriptor set.
    pub fn allocate(
        &mut self,
        pool: vk::DescriptorPool,
        set: vk::DescriptorSet,
        layout: vk::DescriptorSetLayout,
    ) {
        let state = self.empty_set(layout.as_raw());
        self.sets.insert(set.as_raw(), state);
        self.pools
            .entry(pool.as_raw())
            .or_default()
            .insert(set.as_raw());
    }

    /// An unwritten set of a layout.
    pub fn empty_set(&self, layout: u64) -> SetState {
        self.layouts
            .get(&layout)
            .map_or_else(SetState::default, SetState::new)
    }

    /// Removes sets.
    pub fn free(&mut self, pool: vk::DescriptorPool, sets: &[vk::DescriptorSet]) {
        for set in sets {
            self.sets.remove(&set.as_raw());
            if let Some(of_pool) = self.pools.get_mut(&pool.as_raw()) {
                of_pool.remove(&set.as_raw());
            }
        }
    }

    /// Removes all sets of a pool.
    pub fn reset_pool(&mut self, pool: vk::DescriptorPool) {
        for set in self.pools.remove(&pool.as_raw()).unwrap_or_default() {
            self.sets.remove(&set);
        }
    }

    /// The texture descriptors of a set.
    pub fn set(&self, set: u64) -> Option<&SetState> {
        self.sets.get(&set)
    }

    /// Applies a write to a set.
    pub fn write(&mut self, set: vk::DescriptorSet, written: &Written, images: &Images) {
        let state = self.sets.entry(set.as_raw()).or_default();
        state.write(written, images);
    }

    /// Applies a copy between sets.
    pub fn copy(&mut self, copy: &vk::CopyDescriptorSet<'_>) {
        let Some(from) = self.sets.get(&copy.src_set.as_raw()) else {
            return;
        };
        let slots: Vec<Option<Slot>> = (0..copy.descriptor_count)
            .map(|step| {
                let place = from.place(copy.src_binding, copy.src_array_element, step);
                from.slots.get(&place).copied()
            })
            .collect();
        let Some(to) = self.sets.get_mut(&copy.dst_set.as_raw()) else {
            return;
        };
        for (step, slot) in (0..).zip(slots) {
            let place = to.place(copy.dst_binding, copy.dst_array_element, step);
            if let Some(mut slot) = slot {
                slot.sampler = to.immutable(place).or(slot.sampler);
                to.slots.insert(place, slot);
            }
        }
    }

    /// Adds an update template.
    pub fn create_template(&mut self, template: vk::DescriptorUpdateTemplate, of: Template) {
        self.templates.insert(template.as_raw(), of);
    }

    /// Removes an update template.
    pub fn destroy_template(&mut self, template: vk::DescriptorUpdateTemplate) {
        self.templates.remove(&template.as_raw());
    }

    /// The update template of a handle.
    pub fn template(&self, template: vk::DescriptorUpdateTemplate) -> Option<&Template> {
        self.templates.get(&template.as_raw())
    }
}
