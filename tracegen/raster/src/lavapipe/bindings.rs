//! Bindings of the shaders.

use super::device::Gpu;

/// Binding type of a whole buffer.
pub fn buffer(ty: wgpu::BufferBindingType) -> wgpu::BindingType {
    wgpu::BindingType::Buffer {
        ty,
        has_dynamic_offset: false,
        min_binding_size: None,
    }
}

/// Binding type of a uniform buffer.
pub fn uniform() -> wgpu::BindingType {
    buffer(wgpu::BufferBindingType::Uniform)
}

/// Binding type of a texture of one layer.
pub fn texture(sample_type: wgpu::TextureSampleType) -> wgpu::BindingType {
    wgpu::BindingType::Texture {
        sample_type,
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    }
}

/// Layout of a group: numbers, stages and types of its bindings.
pub fn layout(
    gpu: &Gpu,
    label: &str,
    bindings: impl IntoIterator<Item = (u32, wgpu::ShaderStages, wgpu::BindingType)>,
) -> wgpu::BindGroupLayout {
    let entries: Vec<_> = (bindings.into_iter())
        .map(|(binding, visibility, ty)| wgpu::BindGroupLayoutEntry {
            binding,
            visibility,
            ty,
            count: None,
        })
        .collect();
    gpu.device
        .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some(label),
            entries: &entries,
        })
}

/// Layout of a group that fragments read.
pub fn fragment_layout(
    gpu: &Gpu,
    label: &str,
    bindings: impl IntoIterator<Item = (u32, wgpu::BindingType)>,
) -> wgpu::BindGroupLayout {
    let read = |(binding, ty)| (binding, wgpu::ShaderStages::FRAGMENT, ty);
    layout(gpu, label, bindings.into_iter().map(read))
}

/// The resources of a group with this layout, by the numbers of their bindings.
pub fn group<'a>(
    gpu: &Gpu,
    label: &str,
    layout: &wgpu::BindGroupLayout,
    resources: impl IntoIterator<Item = (u32, wgpu::BindingResource<'a>)>,
) -> wgpu::BindGroup {
    let entries: Vec<_> = (resources.into_iter())
        .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
        .collect();
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some(label),
        layout,
        entries: &entries,
    })
}

/// Layout of pipelines with these groups.
pub fn pipeline_layout(gpu: &Gpu, groups: &[&wgpu::BindGroupLayout]) -> wgpu::PipelineLayout {
    let groups: Vec<_> = groups.iter().map(|group| Some(*group)).collect();
    gpu.device
        .create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: None,
            bind_group_layouts: &groups,
            immediate_size: 0,
        })
}
