use super::descriptors::Slot;
use super::*;
use ash::vk::{self, Handle};
use spool::ViewInfo;
use std::sync::Arc;

fn image_view(images: &mut Images, number: u64, size: u32) -> vk::ImageView {
    let image = vk::Image::from_raw(number);
    let info = vk::ImageCreateInfo {
        extent: vk::Extent3D {
            width: size,
            height: size,
            depth: 1,
        },
        mip_levels: 5,
        array_layers: 3,
        samples: vk::SampleCountFlags::TYPE_1,
        ..Default::default()
    };
    images.create(image, &info);
    let view = vk::ImageView::from_raw(number);
    let range = vk::ImageSubresourceRange {
        aspect_mask: vk::ImageAspectFlags::COLOR,
        base_mip_level: 1,
        level_count: vk::REMAINING_MIP_LEVELS,
        base_array_layer: 1,
        layer_count: 1,
    };
    let info = vk::ImageViewCreateInfo::default()
        .image(image)
        .subresource_range(range);
    images.create_view(view, &info, 0.0);
    view
}

fn texture(view: vk::ImageView) -> vk::DescriptorImageInfo {
    vk::DescriptorImageInfo::default().image_view(view)
}

fn written(binding: u32, element: u32, images: Vec<vk::DescriptorImageInfo>) -> Written {
    Written {
        binding,
        element,
        kind: vk::DescriptorType::SAMPLED_IMAGE,
        images,
    }
}

fn images_of(slots: &[(u32, Slot)]) -> Vec<(u32, u32)> {
    let of = |(element, slot): &(u32, Slot)| Some((*element, slot.view?.image));
    slots.iter().filter_map(of).collect()
}

#[test]
fn views_have_the_remaining_levels_and_layers_and_reused_handles_get_new_numbers() {
    let mut images = Images::default();
    let first = image_view(&mut images, 7, 64);
    let of_first = images.view(first).unwrap();
    assert_eq!((of_first.levels, of_first.layers), ([1, 4], [1, 1]));
    images.destroy(vk::Image::from_raw(7));
    images.destroy_view(first);
    assert_eq!(images.view(first), None);
    let second = image_view(&mut images, 7, 32);
    assert_eq!(images.view(second).map(|view| view.image), Some(1));
    assert_eq!(images.numbered(0).map(|image| image.size[0]), Some(64));
}

#[test]
fn writes_beyond_a_bindings_last_element_go_to_the_next_one() {
    let mut images = Images::default();
    let views = [1, 2, 3].map(|n| image_view(&mut images, n, 8));
    let mut descriptors = Descriptors::default();
    let layout = vk::DescriptorSetLayout::from_raw(1);
    let bindings = [(0, 2, Vec::new()), (4, 2, Vec::new())];
    descriptors.create_layout(layout, bindings, &images);
    let [a, b] = [1, 2].map(vk::DescriptorSet::from_raw);
    for set in [a, b] {
        descriptors.allocate(vk::DescriptorPool::from_raw(1), set, layout);
    }
    descriptors.write(a, &written(0, 1, views.map(texture).to_vec()), &images);
    let of = |set, binding| images_of(&descriptors.set(set).unwrap().binding(binding));
    assert_eq!((of(1, 0), of(1, 4)), (vec![(1, 0)], vec![(0, 1), (1, 2)]));
    let copy = vk::CopyDescriptorSet::default()
        .src_set(a)
        .src_binding(0)
        .src_array_element(1)
        .dst_set(b)
        .dst_binding(0)
        .descriptor_count(3);
    descriptors.copy(&copy);
    let of = |set, binding| images_of(&descriptors.set(set).unwrap().binding(binding));
    assert_eq!((of(2, 0), of(2, 4)), (vec![(0, 0), (1, 1)], vec![(0, 2)]));
    descriptors.reset_pool(vk::DescriptorPool::from_raw(1));
    assert!(descriptors.set(1).is_none());
}

#[test]
fn immutable_samplers_of_a_layout_are_in_every_set() {
    let mut images = Images::default();
    let [fixed, other] = [1, 2].map(vk::Sampler::from_raw);
    for (sampler, bias) in [(fixed, 1.0), (other, f32::NAN)] {
        let info = vk::SamplerCreateInfo::default().mip_lod_bias(bias);
        images.create_sampler(sampler, &info);
    }
    let mut descriptors = Descriptors::default();
    let layout = vk::DescriptorSetLayout::from_raw(1);
    descriptors.create_layout(layout, [(0, 1, vec![fixed])], &images);
    let set = vk::DescriptorSet::from_raw(1);
    descriptors.allocate(vk::DescriptorPool::from_raw(1), set, layout);
    let write = Written {
        kind: vk::DescriptorType::COMBINED_IMAGE_SAMPLER,
        ..written(
            0,
            0,
            vec![vk::DescriptorImageInfo::default().sampler(other)],
        )
    };
    descriptors.write(set, &write, &images);
    let slots = descriptors.set(1).unwrap().binding(0);
    assert_eq!(slots[0].1.sampler, images.sampler(fixed));
}

fn pipeline(dynamic: &[vk::DynamicState]) -> Pipeline {
    Pipeline {
        number: 0,
        layout: vk::PipelineLayout::null(),
        stages: vk::ShaderStageFlags::empty(),
        recorded: None,
        unrecorded: None,
        bindings: vec![(0, 0), (1, 0)],
        state: State {
            dynamic: dynamic.iter().map(|state| state.as_raw()).collect(),
            viewport: Some(vk::Viewport {
                width: 100.0,
                ..Default::default()
            }),
            color_masks: vec![15, 15],
            ..State::default()
        },
    }
}

fn tracker(dynamic: &[vk::DynamicState]) -> Tracker {
    let mut tracker = Tracker::default();
    tracker
        .pipelines
        .create(vk::Pipeline::from_raw(1), pipeline(dynamic));
    tracker.commands.begin(1, true);
    let of = tracker.pipelines.get(vk::Pipeline::from_raw(1)).cloned();
    tracker
        .commands
        .get_mut(1)
        .bind(vk::Pipeline::from_raw(1), of);
    tracker
}

#[test]
fn a_draw_has_the_dynamic_state_of_its_command_buffer() {
    let wide = vk::Viewport {
        width: 7.0,
        ..Default::default()
    };
    for (states, width, masks) in [
        (&[][..], 100.0, [15, 15]),
        (
            &[
                vk::DynamicState::VIEWPORT,
                vk::DynamicState::COLOR_WRITE_ENABLE_EXT,
            ],
            7.0,
            [0, 15],
        ),
    ] {
        let mut tracker = tracker(states);
        let dynamic = &mut tracker.commands.get_mut(1).dynamic;
        dynamic.viewport = Some(wide);
        dynamic.color_enables = Some(vec![0, 1]);
        let draw = tracker.draw(1, &Call::default()).unwrap();
        assert_eq!(
            (draw.viewport[2], &draw.color_masks[..]),
            (width, &masks[..])
        );
    }
    assert!(
        tracker(&[]).draw(2, &Call::default()).is_none(),
        "nothing is bound"
    );
}

#[test]
fn pushed_descriptors_replace_the_bound_set_until_another_is_bound() {
    let mut tracker = tracker(&[]);
    let [bound, pushed] = [1, 2].map(|n| image_view(&mut tracker.images, n, 8));
    let set = vk::DescriptorSet::from_raw(9);
    let images = &tracker.images;
    tracker
        .descriptors
        .write(set, &written(0, 0, vec![texture(bound)]), images);
    let mut of = |change: &dyn Fn(&mut CommandState, &Images)| {
        change(tracker.commands.get_mut(1), &tracker.images);
        let draw = tracker.draw(1, &Call::default()).unwrap();
        let images = draw.textures.iter().map(|t| (t.set, t.view.unwrap().image));
        images.collect::<Vec<_>>()
    };
    assert_eq!(of(&|state, _| state.bind_sets(1, [9])), [(1, 0)]);
    let write = written(0, 0, vec![texture(pushed)]);
    let push = |state: &mut CommandState, images: &Images| {
        state.push(1, Default::default).write(&write, images);
    };
    assert_eq!(of(&push), [(1, 1)]);
    assert_eq!(of(&|state, _| state.bind_sets(1, [9])), [(1, 0)]);
}

#[test]
fn subpasses_have_their_own_attachments_and_only_the_first_one_clears() {
    let mut tracker = Tracker::default();
    let views = [1, 2].map(|n| image_view(&mut tracker.images, n, 8));
    let framebuffer = vk::Framebuffer::from_raw(1);
    tracker
        .passes
        .create_framebuffer(framebuffer, &views, &tracker.images);
    let subpass = |color| Subpass {
        colors: vec![Some(color), None],
        depth: None,
        resolves: Vec::new(),
        view_mask: 3,
    };
    let pass = RenderPass {
        clears: vec![true, true],
        subpasses: vec![subpass(0), subpass(1)],
    };
    let handle = vk::RenderPass::from_raw(1);
    tracker.passes.create(handle, pass);
    let area = vk::Rect2D::default();
    let mut begin = |number| {
        let info = tracker
            .passes
            .begin(handle, framebuffer, None, area, number);
        let images = info.colors.iter().map(|view: &ViewInfo| view.image);
        (
            info.pass,
            images.collect::<Vec<_>>(),
            info.clears,
            info.view_mask,
        )
    };
    assert_eq!(begin(0), (0, vec![0], true, 3));
    assert_eq!(begin(1), (1, vec![1], false, 3));
}

#[test]
fn draws_of_a_secondary_command_buffer_belong_to_the_executing_pass() {
    let mut tracker = tracker(&[]);
    let draw = tracker.draw(1, &Call::default()).unwrap();
    tracker.commands.add(1, draw);
    tracker.commands.begin(2, true);
    let pass = tracker
        .passes
        .info(Vec::new(), None, vk::Rect2D::default(), 0);
    tracker.commands.get_mut(2).pass = Some(Arc::new(pass));
    for _ in 0..2 {
        tracker.commands.execute(2, 1);
    }
    let items = tracker.commands.items(2);
    let found: Vec<_> = (items.iter())
        .map(|item| (item.draw.draw, item.pass.as_ref().map(|pass| pass.pass)))
        .collect();
    assert_eq!(found, [(0, Some(0)), (0, Some(0))]);
    assert!(tracker.commands.items(1)[0].pass.is_none());
    // A copy to a buffer in a secondary command buffer ends a frame, too.
    assert!(!tracker.commands.effects([2]).reads_back);
    tracker.commands.get_mut(1).effects.reads_back = true;
    tracker.commands.execute(2, 1);
    assert!(tracker.commands.effects([2]).reads_back);
}

#[test]
fn copies_are_noted_once_by_the_numbers_of_their_images_also_in_secondary_command_buffers() {
    let mut tracker = Tracker::default();
    for number in [7, 8, 9] {
        image_view(&mut tracker.images, number, 64);
    }
    let image = vk::Image::from_raw;
    let buffer = vk::CommandBuffer::from_raw;
    for (from, to) in [(7, 8), (7, 8), (9, 9), (7, 99)] {
        let layers = [0, 3].map(|first| vk::ImageSubresourceLayers {
            base_array_layer: first,
            layer_count: 1,
            ..Default::default()
        });
        tracker.note_copy(buffer(2), image(from), image(to), [layers]);
    }
    for (number, width) in [(8, 64), (9, 1)] {
        let size = vk::Extent3D {
            width,
            height: 1,
            depth: 1,
        };
        tracker.note_read_back(buffer(2), image(number), [size]);
    }
    tracker.commands.execute(1, 2);
    let copies = &tracker.commands.get(1).unwrap().effects.copies;
    assert_eq!(
        (&copies.pairs[..], &copies.probed[..]),
        (&[[0, 1]][..], &[2][..])
    );
    assert_eq!(copies.layers, [[0, 0, 1, 3]]);
    assert!(tracker.commands.effects([1]).reads_back);
}

#[test]
fn a_subpass_resolves_attachments_by_the_images_of_its_framebuffer() {
    let mut tracker = Tracker::default();
    let views = [7, 8].map(|number| image_view(&mut tracker.images, number, 64));
    let [pass, framebuffer] = [3, 4];
    let open = OpenPass {
        pass: vk::RenderPass::from_raw(pass),
        framebuffer: vk::Framebuffer::from_raw(framebuffer),
        views: None,
        area: vk::Rect2D::default(),
        subpass: 0,
    };
    let subpass = Subpass {
        colors: vec![Some(0)],
        resolves: vec![[0, 1]],
        ..Subpass::default()
    };
    let of = RenderPass {
        clears: vec![false; 2],
        subpasses: vec![subpass],
    };
    tracker.passes.create(open.pass, of);
    tracker
        .passes
        .create_framebuffer(open.framebuffer, &views, &tracker.images);
    let resolves = tracker.passes.resolves(&open);
    let images: Vec<_> = resolves
        .iter()
        .map(|pair| pair.map(|view| view.image))
        .collect();
    assert_eq!(images, [[0, 1]]);
}

#[test]
fn a_library_gives_its_parts_and_keeps_its_layout() {
    let mut tracker = Tracker::default();
    let (layout, handle) = (vk::PipelineLayout::from_raw(5), vk::Pipeline::from_raw(6));
    let viewport = vk::Viewport {
        width: 3.0,
        ..Default::default()
    };
    let library = Library {
        parts: Parts::FRAGMENT_SHADER,
        layout,
        recording: Some(vk::Pipeline::from_raw(7)),
        quiet: Some(vk::Pipeline::from_raw(8)),
        state: State {
            viewport: Some(viewport),
            depth: spool::DepthInfo {
                tests: true,
                ..Default::default()
            },
            samples: 4,
            ..State::default()
        },
        ..Library::default()
    };
    tracker.pipelines.create_library(handle, library);
    let found = tracker.pipelines.library(handle).unwrap();
    let mut linked = State {
        samples: 1,
        ..State::default()
    };
    linked.add(&found.state, found.parts);
    // Only the state of its own part counts.
    assert!(linked.depth.tests && linked.viewport.is_none() && linked.samples == 1);
    assert!(!tracker.pipelines.destroy_layout(layout));
    let variants = [7, 8].map(vk::Pipeline::from_raw);
    assert_eq!(tracker.pipelines.destroy(handle), variants);
    assert!(tracker.pipelines.library(handle).is_none());
}

#[test]
fn effects_of_secondary_command_buffers_are_executed_in_order() {
    let [set_before, never_set, set_after] = [1, 2, 3].map(vk::Event::from_raw);
    let mut commands = Commands::default();
    commands.begin(1, true);
    commands.begin(2, true);
    let secondary = &mut commands.get_mut(2).effects;
    secondary.await_events(&[set_before, never_set]);
    secondary.dispatches.push(spool::DispatchInfo {
        groups: Some([1, 2, 3]),
        workgroup: [4, 5, 6],
        reads: Vec::new(),
    });
    commands.get_mut(1).effects.set_event(set_before);
    commands.execute(1, 2);
    commands.get_mut(1).effects.await_events(&[set_after]);
    commands.get_mut(1).effects.set_event(set_after);
    let effects = commands.effects([1]);
    assert_eq!(effects.awaited(), [never_set, set_after]);
    assert_eq!(effects.dispatches.len(), 1);
    assert!(!effects.renders);
    // A submission of both: the secondary's commands are not executed by themselves.
    assert_eq!(commands.effects([1, 2]).dispatches.len(), 2);
}

#[test]
fn only_linear_images_are_read_by_the_host() {
    let mut images = Images::default();
    let [linear, optimal] = [1, 2].map(vk::Image::from_raw);
    for (image, tiling) in [
        (linear, vk::ImageTiling::LINEAR),
        (optimal, vk::ImageTiling::OPTIMAL),
    ] {
        images.create(image, &vk::ImageCreateInfo::default().tiling(tiling));
    }
    assert!(images.is_linear(linear) && !images.is_linear(optimal));
    // Handles are reused.
    images.destroy(linear);
    images.create(linear, &vk::ImageCreateInfo::default());
    assert!(!images.is_linear(linear));
}

#[test]
fn draws_have_the_reads_of_the_shaders_before_the_fragment_shader() {
    let reads = vec![spool::StageReads {
        stage: "vertex".to_owned(),
        what: "cube maps".to_owned(),
        instructions: 3,
    }];
    let library = |reads: &Vec<_>| State {
        reads: reads.clone(),
        ..State::default()
    };
    let mut linked = State::default();
    linked.add(&library(&reads), Parts::FRAGMENT_SHADER);
    assert!(linked.reads.is_empty());
    linked.add(&library(&reads), Parts::PRE_RASTERIZATION_SHADERS);
    assert_eq!(linked.reads, reads);
}
