//! The descriptors of a field's draw: two views of the texture and two samplers.

use super::Field;
use super::list::{How, View};
use crate::gpu::{Gpu, Result, checked};
use ash::vk;
use std::ffi::CStr;

/// Extension for descriptors that a command buffer holds.
pub const PUSH: &CStr = ash::khr::push_descriptor::NAME;

const KINDS: [vk::DescriptorType; 4] = [
    vk::DescriptorType::SAMPLED_IMAGE,
    vk::DescriptorType::SAMPLER,
    vk::DescriptorType::SAMPLED_IMAGE,
    vk::DescriptorType::SAMPLER,
];

/// Descriptors, and the layout of the pipeline that uses them.
pub struct Bindings {
    pub layout: vk::PipelineLayout,
    device: ash::Device,
    infos: [vk::DescriptorImageInfo; 4],
    /// Bindings that are written: all but immutable samplers.
    written: Vec<usize>,
    /// The set, unless its descriptors are pushed.
    set: Option<vk::DescriptorSet>,
    push: ash::khr::push_descriptor::Device,
}

impl Bindings {
    pub fn new(gpu: &Gpu, texture: vk::Image, field: &Field) -> Result<Self> {
        let device = &gpu.device;
        // SAFETY: the device is open; what is created lives as long as it.
        unsafe {
            let samplers = field
                .samplers()
                .map(|info| device.create_sampler(&info, None));
            let [first, second] = samplers.map(|made| checked("a sampler", made));
            let samplers = [first?, second?];
            let [first, second] = field.views().map(|of| view(device, texture, of));
            let views = [first?, second?];
            let fixed = samplers.map(|sampler| [sampler]);
            let mut bindings = [0, 1, 2, 3].map(|number| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(number)
                    .descriptor_type(KINDS[number as usize])
                    .descriptor_count(1)
                    .stage_flags(vk::ShaderStageFlags::FRAGMENT)
            });
            let immutable = matches!(field.how, How::Immutable | How::PushedImmutable);
            if immutable {
                bindings[1] = bindings[1].immutable_samplers(&fixed[0]);
                bindings[3] = bindings[3].immutable_samplers(&fixed[1]);
            }
            let pushes = matches!(field.how, How::Pushed | How::PushedImmutable);
            let info = vk::DescriptorSetLayoutCreateInfo::default()
                .bindings(&bindings)
                .flags(match pushes {
                    true => vk::DescriptorSetLayoutCreateFlags::PUSH_DESCRIPTOR_KHR,
                    false => vk::DescriptorSetLayoutCreateFlags::empty(),
                });
            let made = device.create_descriptor_set_layout(&info, None);
            let layouts = [checked("a set layout", made)?];
            let info = vk::PipelineLayoutCreateInfo::default().set_layouts(&layouts);
            let made = device.create_pipeline_layout(&info, None);
            let mut bindings = Self {
                layout: checked("a pipeline layout", made)?,
                device: device.clone(),
                infos: std::array::from_fn(|number| match number % 2 {
                    0 => vk::DescriptorImageInfo::default()
                        .image_view(views[number / 2])
                        .image_layout(vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL),
                    _ => vk::DescriptorImageInfo::default().sampler(samplers[number / 2]),
                }),
                written: if immutable {
                    vec![0, 2]
                } else {
                    vec![0, 1, 2, 3]
                },
                set: None,
                push: ash::khr::push_descriptor::Device::new(&gpu.instance, device),
            };
            if pushes {
                // The pipeline layout keeps what it needs.
                device.destroy_descriptor_set_layout(layouts[0], None);
                return Ok(bindings);
            }
            let sizes = KINDS.map(|ty| vk::DescriptorPoolSize {
                ty,
                descriptor_count: 1,
            });
            let info = vk::DescriptorPoolCreateInfo::default()
                .max_sets(1)
                .pool_sizes(&sizes);
            let pool = checked("a pool", device.create_descriptor_pool(&info, None))?;
            let info = vk::DescriptorSetAllocateInfo::default()
                .descriptor_pool(pool)
                .set_layouts(&layouts);
            let set = checked("a set", device.allocate_descriptor_sets(&info))?[0];
            device.update_descriptor_sets(&bindings.writes(set), &[]);
            bindings.set = Some(set);
            Ok(bindings)
        }
    }

    fn writes(&self, set: vk::DescriptorSet) -> Vec<vk::WriteDescriptorSet<'_>> {
        let write = |number: &usize| {
            vk::WriteDescriptorSet::default()
                .dst_set(set)
                .dst_binding(*number as u32)
                .descriptor_type(KINDS[*number])
                .image_info(&self.infos[*number..=*number])
        };
        self.written.iter().map(write).collect()
    }

    /// Binds or pushes the descriptors.
    ///
    /// # Safety
    /// The command buffer is being recorded.
    pub unsafe fn bind(&self, buffer: vk::CommandBuffer) {
        let (graphics, layout) = (vk::PipelineBindPoint::GRAPHICS, self.layout);
        // SAFETY: as the caller promises; the set and the layout are the device's.
        unsafe {
            match self.set {
                Some(set) => {
                    let device = &self.device;
                    device.cmd_bind_descriptor_sets(buffer, graphics, layout, 0, &[set], &[]);
                }
                None => {
                    let writes = self.writes(vk::DescriptorSet::null());
                    (self.push).cmd_push_descriptor_set(buffer, graphics, layout, 0, &writes);
                }
            }
        }
    }
}

fn view(device: &ash::Device, texture: vk::Image, of: View) -> Result<vk::ImageView> {
    let info = vk::ImageViewCreateInfo::default()
        .image(texture)
        .view_type(of.kind)
        .format(of.format)
        .components(of.components)
        .subresource_range(vk::ImageSubresourceRange {
            aspect_mask: vk::ImageAspectFlags::COLOR,
            base_mip_level: of.levels[0],
            level_count: of.levels[1],
            base_array_layer: of.layers[0],
            layer_count: of.layers[1],
        });
    // SAFETY: the device is open, and the image is its own.
    checked("a view", unsafe { device.create_image_view(&info, None) })
}
