//! Bindings of the shaders.

use super::device::Gpu;

/// A whole buffer.
pub fn buffer(ty: wgpu::BufferBindingType) -> wgpu::BindingType {
    wgpu::BindingType::Buffer {
        ty,
        has_dynamic_offset: false,
        min_binding_size: None,
    }
}

/// A uniform buffer.
pub fn uniform() -> wgpu::BindingType {
    buffer(wgpu::BufferBindingType::Uniform)
}

/// A texture of one layer.
pub fn texture(sample_type: wgpu::TextureSampleType) -> wgpu::BindingType {
    wgpu::BindingType::Texture {
        sample_type,
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    }
}

/// A group of what each stage reads: numbers, stages and kinds of its bindings.
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

/// A group of what fragments read.
pub fn fragment_layout(
    gpu: &Gpu,
    label: &str,
    bindings: impl IntoIterator<Item = (u32, wgpu::BindingType)>,
) -> wgpu::BindGroupLayout {
    let read = |(binding, ty)| (binding, wgpu::ShaderStages::FRAGMENT, ty);
    layout(gpu, label, bindings.into_iter().map(read))
}

/// Resources in the group that a layout describes, by the numbers of their bindings.
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
