//! Draws inside passes, and what is bound for them.

use super::{GRAPHICS, Inside, Recorder};
use crate::random::shaders::OFFSETS;
use crate::random::world::{
    COUNTS_AT, INDEXED_AT, INDICES_AT, INDIRECT_AT, PUSHED, Pipeline, SHAPES, View, pushed,
    template_data,
};
use ash::vk::{self, Handle};

impl<'w> Recorder<'w> {
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

    pub(super) fn bind_random(&mut self, inside: Inside) {
        let fitting = self.fitting(inside);
        if let Some(pipeline) = self.random.pick(&fitting) {
            self.bind(pipeline);
        }
    }

    /// Draws the texture that always exists on the whole target.
    pub(super) fn home_draw(&mut self, inside: Inside) {
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
        let at = OFFSETS[layout.offset];
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
    pub(super) fn draws(&mut self, inside: Inside, most: usize) {
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
}
