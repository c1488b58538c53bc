//! Descriptor pools, sets, layouts and templates.

use super::*;

impl World {
    pub fn create_pool(&mut self, random: &mut Generator) -> Result<()> {
        let frees = random.once_in(2);
        let count = 2 * POOL_SETS as u32;
        let sizes = [IMAGE, SAMPLER, BOTH].map(|ty| vk::DescriptorPoolSize {
            ty,
            descriptor_count: count,
        });
        let mut info = vk::DescriptorPoolCreateInfo::default()
            .max_sets(POOL_SETS as u32)
            .pool_sizes(&sizes);
        if frees {
            info = info.flags(vk::DescriptorPoolCreateFlags::FREE_DESCRIPTOR_SET);
        }
        // SAFETY: the device is open.
        let made = unsafe { self.gpu.device.create_descriptor_pool(&info, None) };
        let handle = checked("a descriptor pool", made)?;
        self.pools.push(Pool {
            handle,
            frees,
            sets: Vec::new(),
        });
        Ok(())
    }

    /// Removes the sets of a pool from what uses them.
    pub fn forget_sets(&mut self, pool: usize) {
        for set in std::mem::take(&mut self.pools[pool].sets) {
            self.forget(set.handle.as_raw());
        }
    }

    /// Whether a pool has room for a set.
    pub fn has_room(pool: &Pool) -> bool {
        pool.sets.len() < POOL_SETS
    }

    /// Allocates a set.
    pub fn set(&self, pool: &Pool, kind: usize) -> Result<Set> {
        let layouts = [self.set_layouts[kind]];
        let info = vk::DescriptorSetAllocateInfo::default()
            .descriptor_pool(pool.handle)
            .set_layouts(&layouts);
        // SAFETY: the pool has room.
        let made = unsafe { self.gpu.device.allocate_descriptor_sets(&info) };
        let handle = checked("a descriptor set", made)?[0];
        Ok(Set {
            handle,
            kind,
            written: None,
        })
    }

    /// Writes a set, by a template or by writes.
    pub fn write(
        &mut self,
        pool: usize,
        set: usize,
        view: View,
        sampler: vk::Sampler,
        random: &mut Generator,
    ) {
        let of = &mut self.pools[pool].sets[set];
        of.written = Some((view, sampler));
        let (handle, kind) = (of.handle, of.kind);
        let device = &self.gpu.device;
        // SAFETY: the set is not used by commands, and its content exists.
        unsafe {
            if random.once_in(2) {
                let data = [info_of(view, sampler); 2];
                device.update_descriptor_set_with_template(
                    handle,
                    self.templates[kind],
                    data.as_ptr().cast(),
                );
            } else {
                let info = [info_of(view, sampler)];
                let writes: Vec<_> = writes(kind, &info).map(|w| w.dst_set(handle)).collect();
                device.update_descriptor_sets(&writes, &[]);
            }
        }
    }

    /// Copies a set to another one of the same kind.
    pub fn copy(&mut self, from: (usize, usize), to: (usize, usize)) {
        let (source, kind) = {
            let set = &self.pools[from.0].sets[from.1];
            (set.handle, set.kind)
        };
        let written = self.pools[from.0].sets[from.1].written;
        let target = &mut self.pools[to.0].sets[to.1];
        target.written = written;
        let copies: Vec<_> = bindings(kind)
            .map(|(binding, _)| {
                vk::CopyDescriptorSet::default()
                    .src_set(source)
                    .src_binding(binding)
                    .dst_set(target.handle)
                    .dst_binding(binding)
                    .descriptor_count(1)
            })
            .collect();
        // SAFETY: neither set is used by commands.
        unsafe { self.gpu.device.update_descriptor_sets(&[], &copies) };
    }
}

pub(super) fn info_of(view: View, sampler: vk::Sampler) -> vk::DescriptorImageInfo {
    vk::DescriptorImageInfo {
        sampler,
        image_view: view.handle,
        image_layout: vk::ImageLayout::GENERAL,
    }
}

/// Bindings of a kind of sets that programs write: an immutable sampler alone is not written.
pub(super) fn bindings(kind: usize) -> impl Iterator<Item = (u32, vk::DescriptorType)> {
    let all = (0..).zip(SET_KINDS[kind]);
    all.filter(|(_, of)| *of != (SAMPLER, true))
        .map(|(binding, of)| (binding, of.0))
}

/// Writes of both bindings of a set of a kind.
pub(super) fn writes(
    kind: usize,
    info: &[vk::DescriptorImageInfo; 1],
) -> impl Iterator<Item = vk::WriteDescriptorSet<'_>> {
    bindings(kind).map(|(binding, of)| {
        let write = vk::WriteDescriptorSet::default().dst_binding(binding);
        write.descriptor_type(of).image_info(info)
    })
}

/// The writes of a pushed set.
pub fn pushed(view: View, sampler: vk::Sampler, push: impl FnOnce(&[vk::WriteDescriptorSet<'_>])) {
    let info = [info_of(view, sampler)];
    let all: Vec<_> = writes(PUSHED, &info).collect();
    push(&all);
}

/// The data of a template.
pub fn template_data(view: View, sampler: vk::Sampler) -> [vk::DescriptorImageInfo; 2] {
    [info_of(view, sampler); 2]
}

pub(super) fn template(
    gpu: &Gpu,
    kind: usize,
    set_layout: vk::DescriptorSetLayout,
    pushed: Option<vk::PipelineLayout>,
) -> Result<vk::DescriptorUpdateTemplate> {
    let bytes = size_of::<vk::DescriptorImageInfo>();
    let entries: Vec<_> = bindings(kind)
        .map(|(binding, of)| {
            vk::DescriptorUpdateTemplateEntry::default()
                .dst_binding(binding)
                .descriptor_count(1)
                .descriptor_type(of)
                .offset(binding as usize * bytes)
                .stride(bytes)
        })
        .collect();
    let mut info = vk::DescriptorUpdateTemplateCreateInfo::default()
        .descriptor_update_entries(&entries)
        .descriptor_set_layout(set_layout);
    if let Some(layout) = pushed {
        info = info
            .template_type(vk::DescriptorUpdateTemplateType::PUSH_DESCRIPTORS_KHR)
            .pipeline_bind_point(vk::PipelineBindPoint::GRAPHICS)
            .pipeline_layout(layout)
            .set(0);
    }
    // SAFETY: the device is open.
    let made = unsafe { gpu.device.create_descriptor_update_template(&info, None) };
    checked("a template", made)
}

pub(super) fn set_layouts(
    gpu: &Gpu,
    immutable: [vk::Sampler; 2],
) -> Result<Vec<vk::DescriptorSetLayout>> {
    let make = |(number, kind): (usize, &SetKind)| {
        let bindings: Vec<_> = (0..)
            .zip(kind)
            .map(|(binding, (of, fixed))| {
                let info = vk::DescriptorSetLayoutBinding::default()
                    .binding(binding)
                    .descriptor_type(*of)
                    .descriptor_count(1)
                    .stage_flags(vk::ShaderStageFlags::FRAGMENT);
                let place = binding as usize;
                if *fixed {
                    info.immutable_samplers(&immutable[place..=place])
                } else {
                    info
                }
            })
            .collect();
        let mut info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
        if number == PUSHED {
            info = info.flags(vk::DescriptorSetLayoutCreateFlags::PUSH_DESCRIPTOR_KHR);
        }
        // SAFETY: the device is open.
        let made = unsafe { gpu.device.create_descriptor_set_layout(&info, None) };
        checked("a set layout", made)
    };
    SET_KINDS.iter().enumerate().map(make).collect()
}
