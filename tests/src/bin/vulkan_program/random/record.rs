//! Records random commands into command buffers. Several threads may record at the same time.

use super::generator::Generator;
use super::world::{
    COUNTS_AT, Class, Contents, FORMATS, INDEXED_AT, INDICES_AT, INDIRECT_AT, PUSHED, Pipeline,
    QUERIES, SHAPES, Target, View, World, pushed, template_data,
};
use crate::gpu::{Result, checked};
use ash::vk::{self, Handle};

const GRAPHICS: vk::PipelineBindPoint = vk::PipelineBindPoint::GRAPHICS;
const GENERAL: vk::ImageLayout = vk::ImageLayout::GENERAL;

/// Records one command buffer.
pub struct Recorder<'w> {
    world: &'w World,
    pub random: Generator,
    buffer: vk::CommandBuffer,
    pub contents: Contents,
}

/// Where draws go.
#[derive(Clone, Copy)]
struct Inside {
    class: Class,
    dynamic: bool,
    /// The target's image, which the draws must not read; null in a secondary command buffer.
    image: vk::Image,
    size: [u32; 2],
    /// Whether the target is the picture of the frame.
    main: bool,
}

fn layers(level: u32, layer: u32) -> vk::ImageSubresourceLayers {
    vk::ImageSubresourceLayers {
        aspect_mask: vk::ImageAspectFlags::COLOR,
        mip_level: level,
        base_array_layer: layer,
        layer_count: 1,
    }
}

fn corner(size: [u32; 2]) -> vk::Offset3D {
    vk::Offset3D {
        x: size[0] as i32,
        y: size[1] as i32,
        z: 1,
    }
}

fn area(size: [u32; 2]) -> vk::Rect2D {
    let extent = vk::Extent2D {
        width: size[0],
        height: size[1],
    };
    vk::Rect2D {
        offset: vk::Offset2D::default(),
        extent,
    }
}

impl<'w> Recorder<'w> {
    pub fn new(world: &'w World, random: Generator, buffer: vk::CommandBuffer) -> Self {
        Self {
            world,
            random,
            buffer,
            contents: Contents::default(),
        }
    }

    fn device(&self) -> &'w ash::Device {
        &self.world.gpu.device
    }

    /// Begins a primary command buffer.
    pub fn begin(&self, flags: vk::CommandBufferUsageFlags) -> Result<()> {
        let info = vk::CommandBufferBeginInfo::default().flags(flags);
        // SAFETY: the command buffer is not being executed.
        let begun = unsafe { self.device().begin_command_buffer(self.buffer, &info) };
        checked("a command buffer", begun)
    }

    pub fn end(self) -> Result<Contents> {
        // SAFETY: the command buffer is being recorded.
        let ended = unsafe { self.device().end_command_buffer(self.buffer) };
        checked("a command buffer", ended)?;
        Ok(self.contents)
    }

    /// Records some random commands outside render passes, and passes.
    pub fn commands(&mut self, count: usize) {
        for _ in 0..count {
            self.barrier();
            match self.random.below(8) {
                0 => self.clear(),
                1 => self.blit(),
                2 => self.copy(),
                _ => {
                    // The second target adds to the frame's picture.
                    let first = if self.world.shows { 1 } else { 2 };
                    if let Some(count) = self.world.targets.len().checked_sub(first + 1) {
                        let place = first + self.random.below(count + 1);
                        self.pass(&self.world.targets[place], place == 1);
                    }
                }
            }
        }
    }

    /// Waits for all earlier commands: by a barrier, or by an event.
    fn barrier(&mut self) {
        let all = vk::PipelineStageFlags::ALL_COMMANDS;
        let memory = [vk::MemoryBarrier::default()
            .src_access_mask(vk::AccessFlags::MEMORY_WRITE)
            .dst_access_mask(vk::AccessFlags::MEMORY_READ | vk::AccessFlags::MEMORY_WRITE)];
        let (device, buffer) = (self.device(), self.buffer);
        let none = vk::DependencyFlags::empty();
        // SAFETY: the command buffer is being recorded, outside render passes.
        unsafe {
            device.cmd_pipeline_barrier(buffer, all, all, none, &memory, &[], &[]);
            match self.random.below(6) {
                0 => {
                    let event = *self.random.pick(&self.world.events).expect("events");
                    device.cmd_set_event(buffer, event, all);
                    device.cmd_wait_events(buffer, &[event], all, all, &memory, &[], &[]);
                    device.cmd_pipeline_barrier(buffer, all, all, none, &memory, &[], &[]);
                    device.cmd_reset_event(buffer, event, all);
                    device.cmd_pipeline_barrier(buffer, all, all, none, &memory, &[], &[]);
                }
                1 => {
                    let barrier = [vk::MemoryBarrier2::default()
                        .src_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
                        .dst_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
                        .src_access_mask(vk::AccessFlags2::MEMORY_WRITE)
                        .dst_access_mask(vk::AccessFlags2::MEMORY_READ)];
                    let info = vk::DependencyInfo::default().memory_barriers(&barrier);
                    device.cmd_pipeline_barrier2(buffer, &info);
                }
                _ => {}
            }
        }
    }

    fn clear(&mut self) {
        let Some(texture) = self.random.pick(&self.world.textures) else {
            return;
        };
        self.contents.uses.insert(texture.image.handle.as_raw());
        let color = vk::ClearColorValue {
            float32: [self.random.unit(), 0.5, 0.2, 1.0],
        };
        let range = [vk::ImageSubresourceRange {
            aspect_mask: vk::ImageAspectFlags::COLOR,
            base_mip_level: self.random.below(texture.levels as usize) as u32,
            level_count: 1,
            base_array_layer: self.random.below(texture.layers as usize) as u32,
            layer_count: 1,
        }];
        let image = texture.image.handle;
        // SAFETY: the command buffer is being recorded, and the image exists.
        unsafe {
            self.device()
                .cmd_clear_color_image(self.buffer, image, GENERAL, &color, &range)
        };
    }

    /// Fills a level from another image, or the levels of a layer from its first one.
    fn blit(&mut self) {
        let (Some(from), Some(to)) = (
            self.random.pick(&self.world.textures),
            self.random.pick(&self.world.textures),
        ) else {
            return;
        };
        let uses = [from, to].map(|of| of.image.handle.as_raw());
        self.contents.uses.extend(uses);
        let level_size = |size: [u32; 2], level: u32| size.map(|side| (side >> level).max(1));
        let layer = self.random.below(to.layers as usize) as u32;
        let own = from.image.handle == to.image.handle;
        let filter = [vk::Filter::NEAREST, vk::Filter::LINEAR][self.random.below(2)];
        for level in if own { 1..to.levels } else { 0..1 } {
            let (source, of_layer) = if own { (level - 1, layer) } else { (0, 0) };
            let region = [vk::ImageBlit {
                src_subresource: layers(source, of_layer),
                src_offsets: [
                    vk::Offset3D::default(),
                    corner(level_size(from.size, source)),
                ],
                dst_subresource: layers(level, layer),
                dst_offsets: [vk::Offset3D::default(), corner(level_size(to.size, level))],
            }];
            let (from, to) = (from.image.handle, to.image.handle);
            // SAFETY: the command buffer is being recorded, and both images exist.
            unsafe {
                let (device, buffer) = (self.device(), self.buffer);
                device.cmd_blit_image(buffer, from, GENERAL, to, GENERAL, &region, filter);
            }
            self.barrier();
        }
    }

    /// Copies a part of an image, or some texels from a buffer.
    fn copy(&mut self) {
        let (Some(from), Some(to)) = (
            self.random.pick(&self.world.textures),
            self.random.pick(&self.world.textures),
        ) else {
            return;
        };
        let extent = vk::Extent3D {
            width: 9,
            height: 7,
            depth: 1,
        };
        let dst_offset = vk::Offset3D {
            x: self.random.below(8) as i32,
            y: 3,
            z: 0,
        };
        let layer = self.random.below(to.layers as usize) as u32;
        self.contents.uses.insert(to.image.handle.as_raw());
        let (device, buffer) = (self.device(), self.buffer);
        // SAFETY: the command buffer is being recorded; both images exist and are larger than the region; the
        // buffer has more texels.
        unsafe {
            if self.random.once_in(2) || from.image.handle == to.image.handle {
                let region = [vk::BufferImageCopy {
                    image_subresource: layers(0, layer),
                    image_offset: dst_offset,
                    image_extent: extent,
                    ..Default::default()
                }];
                let geometry = self.world.geometry.handle;
                device.cmd_copy_buffer_to_image(
                    buffer,
                    geometry,
                    to.image.handle,
                    GENERAL,
                    &region,
                );
            } else {
                self.contents.uses.insert(from.image.handle.as_raw());
                let region = [vk::ImageCopy {
                    src_subresource: layers(0, 0),
                    dst_subresource: layers(0, layer),
                    dst_offset,
                    extent,
                    ..Default::default()
                }];
                let (from, to) = (from.image.handle, to.image.handle);
                device.cmd_copy_image(buffer, from, GENERAL, to, GENERAL, &region);
            }
        }
    }

    /// Records a pass: a render pass or dynamic rendering, with draws or with secondary command buffers.
    fn pass(&mut self, target: &Target, main: bool) {
        let dynamic = self.random.once_in(2);
        let inside = Inside {
            class: target.class,
            dynamic,
            image: target.view.image,
            size: target.view.size,
            main,
        };
        let all = self.world.secondaries.iter();
        let fitting: Vec<_> = all
            .filter(|of| {
                of.inside.is_some_and(|(class, of_dynamic, size)| {
                    let [width, height] = target.view.size;
                    let fits = size[0] <= width && size[1] <= height;
                    (class, of_dynamic) == (target.class, dynamic) && fits
                })
            })
            .filter(|of| !of.contents.uses.contains(&target.view.image.as_raw()))
            .collect();
        let secondary = (!main || !target.clears)
            .then(|| self.random.pick(&fitting).copied())
            .flatten();
        let query = self.random.below(QUERIES as usize) as u32;
        let kind = self.random.below(6);
        let pools = [self.world.queries, self.world.statistics];
        let pool = pools.get(kind).filter(|_| secondary.is_none());
        let (device, buffer) = (self.device(), self.buffer);
        let uses = [
            target.view.image.as_raw(),
            target.view.handle.as_raw(),
            target.framebuffer.as_raw(),
        ];
        self.contents.uses.extend(uses);
        if secondary.is_none() && self.random.once_in(4) {
            // A pipeline may be bound before the pass begins.
            self.bind_random(inside);
        }
        // SAFETY: the command buffer is being recorded, and all objects exist.
        unsafe {
            if let Some(pool) = pool {
                device.cmd_reset_query_pool(buffer, *pool, query, 1);
                self.barrier();
            }
            self.begin_pass(target, dynamic, secondary.is_some());
            match secondary {
                Some(of) => {
                    for _ in 0..=self.random.below(2) {
                        device.cmd_execute_commands(buffer, &[of.buffer]);
                        if main {
                            self.contents
                                .draws
                                .extend(of.contents.draws.iter().cloned());
                        }
                    }
                    self.contents.uses.extend(&of.contents.uses);
                    self.contents.uses.insert(of.buffer.as_raw());
                }
                None => {
                    self.set_view(inside.size);
                    if main {
                        self.home_draw(inside);
                    }
                    self.draws(inside, 3);
                    if let Some(pool) = pool {
                        device.cmd_begin_query(buffer, *pool, query, self.precise(kind));
                        self.draws(inside, 2);
                        device.cmd_end_query(buffer, *pool, query);
                        self.draws(inside, 2);
                    }
                    if self.random.once_in(3) {
                        self.clear_part(inside);
                        self.draws(inside, 2);
                    }
                }
            }
            match dynamic {
                true => device.cmd_end_rendering(buffer),
                false => device.cmd_end_render_pass(buffer),
            }
        }
    }

    fn precise(&mut self, kind: usize) -> vk::QueryControlFlags {
        match kind {
            0 if self.random.once_in(2) => vk::QueryControlFlags::PRECISE,
            _ => vk::QueryControlFlags::empty(),
        }
    }

    fn begin_pass(&mut self, target: &Target, dynamic: bool, secondary: bool) {
        let color = vk::ClearColorValue {
            float32: [0.1, self.random.unit(), 0.3, 1.0],
        };
        let depth = vk::ClearDepthStencilValue {
            depth: 1.0,
            stencil: 0,
        };
        let clears = [
            vk::ClearValue { color },
            vk::ClearValue {
                depth_stencil: depth,
            },
        ];
        let (device, buffer) = (self.device(), self.buffer);
        // SAFETY: the command buffer is being recorded, and the target exists.
        unsafe {
            if dynamic {
                let load = match target.clears {
                    true => vk::AttachmentLoadOp::CLEAR,
                    false => vk::AttachmentLoadOp::LOAD,
                };
                let attachment = |view, clear| {
                    vk::RenderingAttachmentInfo::default()
                        .image_view(view)
                        .image_layout(GENERAL)
                        .load_op(load)
                        .store_op(vk::AttachmentStoreOp::STORE)
                        .clear_value(clear)
                };
                let colors = [attachment(target.view.handle, clears[0])];
                let depth = attachment(self.world.depth.view, clears[1]);
                let mut info = vk::RenderingInfo::default()
                    .render_area(area(target.view.size))
                    .layer_count(1)
                    .color_attachments(&colors);
                if target.class.depth {
                    info = info.depth_attachment(&depth);
                }
                if secondary {
                    info = info.flags(vk::RenderingFlags::CONTENTS_SECONDARY_COMMAND_BUFFERS);
                }
                device.cmd_begin_rendering(buffer, &info);
            } else {
                let contents = match secondary {
                    true => vk::SubpassContents::SECONDARY_COMMAND_BUFFERS,
                    false => vk::SubpassContents::INLINE,
                };
                let info = vk::RenderPassBeginInfo::default()
                    .render_pass(target.pass)
                    .framebuffer(target.framebuffer)
                    .render_area(area(target.view.size))
                    .clear_values(&clears);
                if self.random.once_in(2) {
                    let subpass = vk::SubpassBeginInfo::default().contents(contents);
                    device.cmd_begin_render_pass2(buffer, &info, &subpass);
                } else {
                    device.cmd_begin_render_pass(buffer, &info, contents);
                }
            }
        }
    }

    fn set_view(&self, size: [u32; 2]) {
        let viewport = vk::Viewport {
            width: size[0] as f32,
            height: size[1] as f32,
            max_depth: 1.0,
            ..Default::default()
        };
        // SAFETY: the command buffer is being recorded.
        unsafe {
            self.device().cmd_set_viewport(self.buffer, 0, &[viewport]);
            self.device().cmd_set_scissor(self.buffer, 0, &[area(size)]);
        }
    }

    fn clear_part(&mut self, inside: Inside) {
        let value = vk::ClearColorValue {
            float32: [0.9, self.random.unit(), 0.0, 1.0],
        };
        let attachment = [vk::ClearAttachment {
            aspect_mask: vk::ImageAspectFlags::COLOR,
            color_attachment: 0,
            clear_value: vk::ClearValue { color: value },
        }];
        let rect = [vk::ClearRect {
            rect: area(inside.size.map(|side| side.div_ceil(2))),
            base_array_layer: 0,
            layer_count: 1,
        }];
        // SAFETY: the command buffer is being recorded, inside a pass with a colour target.
        unsafe {
            self.device()
                .cmd_clear_attachments(self.buffer, &attachment, &rect)
        };
    }

    fn fitting(&self, inside: Inside) -> Vec<&'w Pipeline> {
        let fits = |of: &&Pipeline| of.class == inside.class && of.dynamic == inside.dynamic;
        self.world.pipelines.iter().filter(fits).collect()
    }

    fn bind(&mut self, pipeline: &Pipeline) {
        self.contents.uses.insert(pipeline.handle.as_raw());
        // SAFETY: the command buffer is being recorded, and the pipeline exists.
        unsafe {
            self.device()
                .cmd_bind_pipeline(self.buffer, GRAPHICS, pipeline.handle)
        };
    }

    fn bind_random(&mut self, inside: Inside) {
        let fitting = self.fitting(inside);
        if let Some(pipeline) = self.random.pick(&fitting) {
            self.bind(pipeline);
        }
    }

    /// Draws the texture that always exists on the whole target.
    fn home_draw(&mut self, inside: Inside) {
        let pipeline = &self.world.pipelines[usize::from(inside.dynamic)];
        self.bind(pipeline);
        let set = &self.world.pools[0].sets[0];
        let layout = &self.world.layouts[pipeline.layout];
        self.contents.uses.insert(layout.handle.as_raw());
        self.contents.uses.insert(set.handle.as_raw());
        self.constants(pipeline, [1.0, 1.0, 0.0, 0.0]);
        self.bind_vertices();
        // SAFETY: the command buffer is being recorded, inside the pass, and all objects exist.
        unsafe {
            let (device, buffer) = (self.device(), self.buffer);
            device.cmd_bind_descriptor_sets(buffer, GRAPHICS, layout.handle, 0, &[set.handle], &[]);
            device.cmd_draw(buffer, 6, 1, 0, 0);
        }
        if inside.main {
            self.contents.draws.push(vec![self.world.home.size]);
        }
    }

    fn constants(&mut self, pipeline: &Pipeline, place: [f32; 4]) {
        let layout = &self.world.layouts[pipeline.layout];
        self.contents.uses.insert(layout.handle.as_raw());
        let tint = [
            0.4 + 0.6 * self.random.unit(),
            0.8,
            0.4 + 0.6 * self.random.unit(),
            1.0_f32,
        ];
        let at = super::shaders::OFFSETS[layout.offset];
        let (vertex, fragment) = (vk::ShaderStageFlags::VERTEX, vk::ShaderStageFlags::FRAGMENT);
        let (place, tint) = (bytemuck::cast_slice(&place), bytemuck::cast_slice(&tint));
        let (device, buffer) = (self.device(), self.buffer);
        // SAFETY: the command buffer is being recorded, and the layout has both ranges.
        unsafe {
            device.cmd_push_constants(buffer, layout.handle, vertex, 0, place);
            device.cmd_push_constants(buffer, layout.handle, fragment, at, tint);
        }
    }

    fn bind_vertices(&self) {
        let geometry = self.world.geometry.handle;
        // SAFETY: the command buffer is being recorded.
        unsafe {
            let (device, buffer) = (self.device(), self.buffer);
            device.cmd_bind_vertex_buffers(buffer, 0, &[geometry], &[0]);
            device.cmd_bind_index_buffer(buffer, geometry, INDICES_AT, vk::IndexType::UINT16);
        }
    }

    /// Binds sets that do not read the target; returns the sizes of their textures.
    fn bind_sets(&mut self, pipeline: &Pipeline, inside: Inside) -> Option<Vec<[u32; 2]>> {
        let world = self.world;
        let layout = &world.layouts[pipeline.layout];
        self.contents.uses.insert(layout.handle.as_raw());
        let mut sizes = Vec::new();
        let allowed = |view: &View| view.image != inside.image;
        let (device, buffer) = (self.device(), self.buffer);
        for (number, kind) in (0..).zip(&layout.kinds) {
            // SAFETY: the command buffer is being recorded, and the objects exist.
            unsafe {
                if *kind == PUSHED {
                    let views: Vec<_> = world.views().into_iter().filter(allowed).collect();
                    let (view, sampler) = (
                        *self.random.pick(&views)?,
                        *self.random.pick(&world.samplers)?,
                    );
                    self.use_texture(view, sampler);
                    if let Some(template) = layout.template.filter(|_| self.random.once_in(2)) {
                        let data = template_data(view, sampler);
                        let data = data.as_ptr().cast();
                        let push = &world.push;
                        push.cmd_push_descriptor_set_with_template(
                            buffer,
                            template,
                            layout.handle,
                            number,
                            data,
                        );
                    } else {
                        let push = &world.push;
                        pushed(view, sampler, |writes| {
                            push.cmd_push_descriptor_set(
                                buffer,
                                GRAPHICS,
                                layout.handle,
                                number,
                                writes,
                            );
                        });
                    }
                    sizes.push(view.of);
                    continue;
                }
                let all = world.pools.iter().flat_map(|pool| &pool.sets);
                let sets: Vec<_> = all
                    .filter(|set| set.kind == *kind)
                    .filter_map(|set| Some((set.handle, set.written.filter(|(v, _)| allowed(v))?)))
                    .collect();
                let &(set, (view, sampler)) = self.random.pick(&sets)?;
                self.use_texture(view, sampler);
                self.contents.uses.insert(set.as_raw());
                device.cmd_bind_descriptor_sets(
                    buffer,
                    GRAPHICS,
                    layout.handle,
                    number,
                    &[set],
                    &[],
                );
                sizes.push(view.of);
            }
        }
        Some(sizes)
    }

    fn use_texture(&mut self, view: View, sampler: vk::Sampler) {
        let handles = [view.image.as_raw(), view.handle.as_raw(), sampler.as_raw()];
        self.contents.uses.extend(handles);
    }

    /// Records up to `most` groups of draws. The draws of a group share a pipeline.
    fn draws(&mut self, inside: Inside, most: usize) {
        for _ in 0..self.random.below(most + 1) {
            let fitting = self.fitting(inside);
            let Some(pipeline) = self.random.pick(&fitting).copied() else {
                return;
            };
            let sets_first = self.random.once_in(2);
            let mut sizes = None;
            if sets_first {
                sizes = self.bind_sets(pipeline, inside);
            }
            self.bind(pipeline);
            if !sets_first {
                sizes = self.bind_sets(pipeline, inside);
            }
            let Some(mut sizes) = sizes else {
                continue;
            };
            self.bind_vertices();
            self.constants(pipeline, [1.0, 1.0, 0.0, 0.0]);
            for _ in 0..=self.random.below(3) {
                match self.random.below(4) {
                    0 => {
                        if let Some(other) = self.bind_sets(pipeline, inside) {
                            sizes = other;
                        } else {
                            break;
                        }
                    }
                    1 => {}
                    _ => {
                        let mut part = || 1.2 * self.random.unit();
                        let place = [part(), part(), part() - 0.6, part() - 0.6];
                        self.constants(pipeline, place);
                    }
                }
                for _ in 0..self.draw() {
                    if inside.main || inside.image.is_null() {
                        self.contents.draws.push(sizes.clone());
                    }
                }
            }
        }
    }

    /// Records a draw of a random kind. Returns its number of draws: the draws of an indirect command are one.
    fn draw(&mut self) -> usize {
        let (first, count) = SHAPES[self.random.below(SHAPES.len())];
        let instances = 1 + self.random.below(6).saturating_sub(3) as u32;
        let geometry = self.world.geometry.handle;
        let count_at = COUNTS_AT + 4 * self.random.below(3) as u64;
        let draws = 1 + self.random.below(3) as u32;
        let (device, buffer) = (self.device(), self.buffer);
        // SAFETY: the command buffer is being recorded; the buffer of geometry has the vertices, the indices,
        // three indirect draws of each kind and their counts.
        unsafe {
            match self.random.below(12) {
                10 => {
                    let all: Vec<_> = (0..draws as usize)
                        .map(|number| SHAPES[number])
                        .map(|(first_vertex, vertex_count)| vk::MultiDrawInfoEXT {
                            first_vertex,
                            vertex_count,
                        })
                        .collect();
                    let stride = size_of::<vk::MultiDrawInfoEXT>() as u32;
                    let draw = self.world.multi.fp().cmd_draw_multi_ext;
                    draw(buffer, draws, all.as_ptr(), instances, 0, stride);
                    return draws as usize;
                }
                11 => {
                    let all: Vec<_> = (0..draws as usize)
                        .map(|number| SHAPES[number])
                        .map(|(first_index, index_count)| vk::MultiDrawIndexedInfoEXT {
                            first_index,
                            index_count,
                            vertex_offset: 0,
                        })
                        .collect();
                    let stride = size_of::<vk::MultiDrawIndexedInfoEXT>() as u32;
                    let draw = self.world.multi.fp().cmd_draw_multi_indexed_ext;
                    draw(
                        buffer,
                        draws,
                        all.as_ptr(),
                        instances,
                        0,
                        stride,
                        std::ptr::null(),
                    );
                    return draws as usize;
                }
                0 | 1 => device.cmd_draw_indexed(buffer, count, instances, first, 0, 0),
                2 => device.cmd_draw_indirect(buffer, geometry, INDIRECT_AT, draws, 16),
                3 => device.cmd_draw_indexed_indirect(buffer, geometry, INDEXED_AT, draws, 20),
                4 => device.cmd_draw_indirect_count(
                    buffer,
                    geometry,
                    INDIRECT_AT,
                    geometry,
                    count_at,
                    3,
                    16,
                ),
                5 => device.cmd_draw_indexed_indirect_count(
                    buffer, geometry, INDEXED_AT, geometry, count_at, 3, 20,
                ),
                _ => device.cmd_draw(buffer, count, instances, first, 0),
            }
        }
        1
    }

    /// Records the frame's picture, and its copy to the buffer.
    pub fn picture(&mut self) {
        self.barrier();
        self.pass(&self.world.targets[0], true);
        self.barrier();
        if self.random.once_in(2) {
            self.pass(&self.world.targets[1], true);
            self.barrier();
        }
        let main = &self.world.main;
        let region = [vk::BufferImageCopy {
            image_subresource: layers(0, 0),
            image_extent: vk::Extent3D {
                width: main.size[0],
                height: main.size[1],
                depth: 1,
            },
            ..Default::default()
        }];
        let (device, buffer) = (self.device(), self.buffer);
        let (image, to) = (main.image.handle, self.world.readback.handle);
        // SAFETY: the command buffer is being recorded, and the buffer has room for the picture.
        unsafe {
            if self.random.once_in(2) {
                device.cmd_copy_image_to_buffer(buffer, image, GENERAL, to, &region);
            } else {
                let region = [vk::BufferImageCopy2::default()
                    .image_subresource(region[0].image_subresource)
                    .image_extent(region[0].image_extent)];
                let info = vk::CopyImageToBufferInfo2::default()
                    .src_image(image)
                    .src_image_layout(GENERAL)
                    .dst_buffer(to)
                    .regions(&region);
                device.cmd_copy_image_to_buffer2(buffer, &info);
            }
        }
        self.barrier();
    }

    /// Begins a secondary command buffer for a target and for larger ones, and records draws.
    pub fn secondary(
        &mut self,
        target: &Target,
        dynamic: bool,
        flags: vk::CommandBufferUsageFlags,
    ) -> Result<()> {
        let (class, size) = (target.class, target.view.size);
        let formats = [FORMATS[class.format]];
        let mut rendering = vk::CommandBufferInheritanceRenderingInfo::default()
            .color_attachment_formats(&formats)
            .rasterization_samples(vk::SampleCountFlags::TYPE_1);
        if class.depth {
            rendering = rendering.depth_attachment_format(vk::Format::D32_SFLOAT);
        }
        let mut inheritance = vk::CommandBufferInheritanceInfo::default();
        if dynamic {
            inheritance = inheritance.push_next(&mut rendering);
        } else {
            inheritance = inheritance.render_pass(target.pass);
            self.contents.uses.insert(target.framebuffer.as_raw());
        }
        let info = vk::CommandBufferBeginInfo::default()
            .flags(flags | vk::CommandBufferUsageFlags::RENDER_PASS_CONTINUE)
            .inheritance_info(&inheritance);
        // SAFETY: the command buffer is not being executed.
        let begun = unsafe { self.device().begin_command_buffer(self.buffer, &info) };
        checked("a secondary command buffer", begun)?;
        let image = vk::Image::null();
        self.set_view(size);
        self.draws(
            Inside {
                class,
                dynamic,
                image,
                size,
                main: false,
            },
            4,
        );
        Ok(())
    }
}
