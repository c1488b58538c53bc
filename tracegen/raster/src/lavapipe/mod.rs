//! Capture through lavapipe, Mesa's Vulkan driver on llvmpipe.

mod counter;
mod device;
mod pipelines;
mod targets;
mod uniforms;
mod upload;

use super::backend::{CaptureBackend, Region, Rendered, View};
use super::draws::{DrawCall, DrawList, DrawMode};
use super::error::RasterError;
use super::lighting::Lighting;
use device::Gpu;
use pipelines::{PipelineKey, Pipelines, Role};
use record::{DEPTH_BYTES, RECORD_BYTES, RawRecords};
use scene::Scene;
use targets::{ShadowMaps, Targets};
use textures::TextureSet;
use uniforms::ViewData;
use upload::SceneBuffers;
use wgpu::util::DeviceExt;

/// The scene uploaded to lavapipe.
pub struct Lavapipe {
    gpu: Gpu,
    pipelines: Pipelines,
    scene: SceneBuffers,
    targets: Targets,
    shadow_maps: ShadowMaps,
    /// Group 0 for the eyes.
    eye_bindings: wgpu::BindGroup,
    /// How each material is drawn.
    materials: Vec<MaterialState>,
}

#[derive(Clone, Copy)]
struct MaterialState {
    double_sided: bool,
    textures: u32,
    leaders: u32,
}

impl Lavapipe {
    /// Opens the driver and uploads the scene. Regions may produce `record_budget_bytes` of raw
    /// records before they are split, capped by the driver's limit of 128 MiB.
    ///
    /// # Errors
    /// No driver, unsupported features, sizes beyond its limits.
    pub fn new(
        scene: &Scene,
        draws: &DrawList,
        textures: &TextureSet,
        view_size_px: [u32; 2],
        record_budget_bytes: u64,
    ) -> Result<Self, RasterError> {
        let gpu = device::open()?;
        let pipelines = Pipelines::new(&gpu)?;
        let buffers = SceneBuffers::new(&gpu, &pipelines.layouts, scene, draws, textures)?;
        let masked = draws.calls.iter().any(|c| c.mode == DrawMode::Masked);
        let targets = Targets::new(&gpu, view_size_px, record_budget_bytes, masked)?;
        let shadow_maps = gpu.checked("making the shadow maps", || {
            ShadowMaps::new(&gpu, draws.cascades)
        })?;
        let eye_bindings = bind_view(
            &gpu,
            &pipelines,
            &buffers,
            &targets,
            &targets.view_uniform,
            &shadow_maps.sampled,
        );
        let materials = scene
            .materials
            .iter()
            .zip(&draws.groups)
            .map(|(material, groups)| MaterialState {
                double_sided: material.double_sided,
                textures: groups.present,
                leaders: groups.leaders,
            })
            .collect();
        let mut lavapipe = Self {
            gpu,
            pipelines,
            scene: buffers,
            targets,
            shadow_maps,
            eye_bindings,
            materials,
        };
        for call in &draws.calls {
            for key in lavapipe.keys_of(call, draws.cascades) {
                lavapipe.pipelines.prepare(&lavapipe.gpu, key)?;
            }
        }
        Ok(lavapipe)
    }

    fn key(&self, call: &DrawCall, role: Role, capture: bool, cascades: u32) -> PipelineKey {
        let material = &self.materials[call.material];
        let shadow = matches!(role, Role::Shadow | Role::ShadowMasked);
        PipelineKey {
            role,
            capture,
            // A shadow caster without alpha test is drawn alike whatever its material.
            textures: if role == Role::Shadow {
                0
            } else {
                material.textures
            },
            leaders: if shadow || !capture {
                0
            } else {
                material.leaders
            },
            cascades: if shadow { 0 } else { cascades },
            double_sided: shadow || material.double_sided,
            mirrored: !shadow && call.mirrored,
        }
    }

    /// Pipelines of a draw in the order in which it uses them.
    fn roles(call: &DrawCall, capture: bool) -> &'static [(Role, bool)] {
        match (call.mode, capture) {
            (DrawMode::Opaque, false) => &[(Role::Opaque, false)],
            (DrawMode::Opaque, true) => &[(Role::Opaque, true)],
            (DrawMode::Blended, false) => &[(Role::Blended, false)],
            (DrawMode::Blended, true) => &[(Role::Blended, true)],
            (DrawMode::Masked, false) => &[(Role::Masked, false)],
            (DrawMode::Masked, true) => &[(Role::MaskedRecord, true), (Role::Masked, false)],
        }
    }

    fn shadow_role(call: &DrawCall) -> Option<Role> {
        match call.mode {
            DrawMode::Opaque => Some(Role::Shadow),
            DrawMode::Masked => Some(Role::ShadowMasked),
            DrawMode::Blended => None,
        }
    }

    fn keys_of(&self, call: &DrawCall, cascades: u32) -> Vec<PipelineKey> {
        let roles = [false, true]
            .into_iter()
            .flat_map(|capture| Self::roles(call, capture));
        let mut keys: Vec<PipelineKey> = roles
            .map(|&(role, capture)| self.key(call, role, capture, cascades))
            .collect();
        if cascades > 0 {
            keys.extend(Self::shadow_role(call).map(|role| self.key(call, role, false, cascades)));
        }
        keys
    }

    /// Issues one draw through one pipeline, setting only the state that changes.
    fn issue(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        state: &mut PassState,
        index: u32,
        call: &DrawCall,
        key: PipelineKey,
    ) {
        let (Some(mesh), Some(pipeline)) =
            (&self.scene.meshes[call.mesh], self.pipelines.get(&key))
        else {
            // Every draw's mesh is uploaded and its pipelines prepared when the backend is made.
            return;
        };
        if state.key.replace(key) != Some(key) {
            pass.set_pipeline(pipeline);
        }
        if state.material.replace(call.material) != Some(call.material) {
            pass.set_bind_group(1, &self.scene.materials[call.material], &[]);
        }
        if state.mesh.replace(call.mesh) != Some(call.mesh) {
            pass.set_vertex_buffer(0, mesh.vertices.slice(..));
            pass.set_index_buffer(mesh.indices.slice(..), wgpu::IndexFormat::Uint32);
        }
        pass.draw_indexed(0..mesh.index_count, 0, index..index + 1);
    }
}

/// State that the last draw of a pass left.
#[derive(Default)]
struct PassState {
    key: Option<PipelineKey>,
    material: Option<usize>,
    mesh: Option<usize>,
}

impl CaptureBackend for Lavapipe {
    fn name(&self) -> &'static str {
        "lavapipe"
    }

    fn driver(&self) -> &str {
        &self.gpu.driver
    }

    fn record_capacity(&self) -> u64 {
        self.targets.capacity.into()
    }

    fn render_shadows(&mut self, draws: &DrawList, lighting: &Lighting) -> Result<(), RasterError> {
        // The map cannot be bound while it is rendered: the casters get a stand-in.
        let stand_in = ShadowMaps::new(&self.gpu, 0);
        for (cascade, layer) in lighting.cascades.iter().zip(&self.shadow_maps.layers) {
            let uniform = self
                .gpu
                .device
                .create_buffer_init(&wgpu::util::BufferInitDescriptor {
                    label: Some("cascade"),
                    contents: bytemuck::bytes_of(&ViewData::of_cascade(cascade, lighting)),
                    usage: wgpu::BufferUsages::UNIFORM,
                });
            let bindings = bind_view(
                &self.gpu,
                &self.pipelines,
                &self.scene,
                &self.targets,
                &uniform,
                &stand_in.sampled,
            );
            let visible = draws.visible(cascade.clip_from_world);
            self.gpu.checked("rendering a shadow cascade", || {
                let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
                let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                    depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                        view: layer,
                        depth_ops: Some(wgpu::Operations {
                            load: wgpu::LoadOp::Clear(1.0),
                            store: wgpu::StoreOp::Store,
                        }),
                        stencil_ops: None,
                    }),
                    ..Default::default()
                });
                pass.set_bind_group(0, &bindings, &[]);
                let mut state = PassState::default();
                for &index in &visible {
                    let call = &draws.calls[index as usize];
                    if let Some(role) = Self::shadow_role(call) {
                        let key = self.key(call, role, false, 0);
                        self.issue(&mut pass, &mut state, index, call, key);
                    }
                }
                drop(pass);
                self.gpu.queue.submit([encoder.finish()]);
            })?;
        }
        self.gpu.wait("rendering the shadow cascades")
    }

    fn render(
        &mut self,
        draws: &DrawList,
        view: &View<'_>,
        region: Region,
        capture: bool,
        sink: &mut dyn FnMut(RawRecords<'_>) -> Result<(), RasterError>,
    ) -> Result<Rendered, RasterError> {
        let gpu = &self.gpu;
        let targets = &self.targets;
        let data = ViewData::of_eye(view, targets.capacity);
        gpu.queue
            .write_buffer(&targets.view_uniform, 0, bytemuck::bytes_of(&data));
        gpu.queue.write_buffer(&targets.counter, 0, &[0; 4]);
        gpu.checked("rendering a view", || {
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                // Regions add up to a picture: everything is loaded, and the background clears
                // what the scissor leaves open.
                color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                    view: &targets.color_view,
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations {
                        load: wgpu::LoadOp::Load,
                        store: wgpu::StoreOp::Store,
                    },
                })],
                depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                    view: &targets.depth_view,
                    depth_ops: Some(wgpu::Operations {
                        load: wgpu::LoadOp::Load,
                        store: wgpu::StoreOp::Store,
                    }),
                    stencil_ops: None,
                }),
                ..Default::default()
            });
            pass.set_scissor_rect(
                region.origin_px[0],
                region.origin_px[1],
                region.size_px[0],
                region.size_px[1],
            );
            pass.set_bind_group(0, &self.eye_bindings, &[]);
            if let Some(any) = self.scene.materials.first() {
                pass.set_bind_group(1, any, &[]);
            }
            pass.set_pipeline(&self.pipelines.background);
            pass.draw(0..3, 0..1);
            let mut state = PassState::default();
            for &index in view.visible {
                let call = &draws.calls[index as usize];
                for &(role, capture) in Self::roles(call, capture) {
                    let key = self.key(call, role, capture, draws.cascades);
                    self.issue(&mut pass, &mut state, index, call, key);
                }
            }
            drop(pass);
            gpu.queue.submit([encoder.finish()]);
        })?;
        if !capture {
            gpu.wait("rendering a view")?;
            return Ok(Rendered::Complete { records: 0 });
        }
        let needed = u64::from(gpu.read(&targets.counter, 0..4, |bytes| {
            Ok(bytemuck::pod_read_unaligned::<u32>(bytes))
        })?);
        if needed > u64::from(targets.capacity) {
            return Ok(Rendered::Overflow { needed });
        }
        if needed > 0 {
            let depths = if targets.has_depths {
                needed * DEPTH_BYTES
            } else {
                0
            };
            gpu.read(&targets.records, 0..needed * RECORD_BYTES, |quads| {
                let quads = records_of(quads)?;
                if depths == 0 {
                    return sink(RawRecords { quads, depths: &[] });
                }
                gpu.read(&targets.depths, 0..depths, |depths| {
                    let depths = records_of(depths)?;
                    sink(RawRecords { quads, depths })
                })
            })?;
        }
        Ok(Rendered::Complete { records: needed })
    }

    fn picture(&mut self) -> Result<Vec<u8>, RasterError> {
        self.targets.read_picture(&self.gpu)
    }
}

fn records_of<T: bytemuck::Pod>(bytes: &[u8]) -> Result<&[T], RasterError> {
    bytemuck::try_cast_slice(bytes).map_err(|e| RasterError::Driver {
        doing: "reading the records",
        message: e.to_string(),
    })
}

fn bind_view(
    gpu: &Gpu,
    pipelines: &Pipelines,
    scene: &SceneBuffers,
    targets: &Targets,
    uniform: &wgpu::Buffer,
    shadow_map: &wgpu::TextureView,
) -> wgpu::BindGroup {
    let sampler = gpu.device.create_sampler(&wgpu::SamplerDescriptor {
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        compare: Some(wgpu::CompareFunction::LessEqual),
        ..Default::default()
    });
    let resources = [
        uniform.as_entire_binding(),
        scene.instances.as_entire_binding(),
        targets.counter.as_entire_binding(),
        targets.records.as_entire_binding(),
        wgpu::BindingResource::TextureView(shadow_map),
        wgpu::BindingResource::Sampler(&sampler),
        targets.depths.as_entire_binding(),
    ];
    let entries: Vec<wgpu::BindGroupEntry<'_>> = (0..)
        .zip(resources)
        .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
        .collect();
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("view"),
        layout: &pipelines.layouts.view,
        entries: &entries,
    })
}
