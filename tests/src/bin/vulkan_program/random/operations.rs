//! The random operations.

use super::generator::Generator;
use super::record::Recorder;
use super::shaders::{BODIES, OF_TWO_SETS, OFFSETS};
use super::world::{Class, Contents, FORMATS, PUSHED, Recorded, SET_KINDS, World, command_pool};
use crate::gpu::{Result, checked};
use crate::libraries::SPLITS;
use ash::vk::{self, Handle};

type Operation = fn(&mut World, &mut Generator) -> Result<()>;

/// The operations and how often each is chosen.
pub const OPERATIONS: [(usize, Operation); 26] = [
    (3, create_texture),
    (2, destroy_texture),
    (3, |world, random| world.create_view(random)),
    (1, destroy_view),
    (1, create_sampler),
    (1, destroy_sampler),
    (1, create_pool),
    (1, reset_pool),
    (1, destroy_pool),
    (3, allocate_set),
    (1, free_set),
    (4, write_set),
    (2, copy_set),
    (1, create_layout),
    (1, replace_layout),
    (2, create_pipeline),
    (1, destroy_pipeline),
    (3, create_target),
    (1, destroy_target),
    (5, record_once),
    (3, record_reusable),
    (5, submit_again),
    (2, record_again),
    (4, record_secondary),
    (2, record_in_threads),
    (1, reset_command_pool),
];

/// Creates some objects of each kind.
pub fn start(world: &mut World, random: &mut Generator) -> Result<()> {
    let each: [(usize, Operation); 7] = [
        (3, create_texture),
        (2, |world, random| world.create_view(random)),
        (1, create_sampler),
        (1, create_pool),
        (4, allocate_set),
        (3, create_target),
        (3, create_pipeline),
    ];
    for (times, operation) in each {
        for _ in 0..times {
            operation(world, random)?;
        }
    }
    Ok(())
}

/// A random index, unless there are none from `first` on.
fn place(random: &mut Generator, first: usize, count: usize) -> Option<usize> {
    (count > first).then(|| first + random.below(count - first))
}

fn create_texture(world: &mut World, random: &mut Generator) -> Result<()> {
    if world.textures.len() < 8 {
        world.create_texture(random)?;
    }
    Ok(())
}

fn destroy_texture(world: &mut World, random: &mut Generator) -> Result<()> {
    if let Some(place) = place(random, 0, world.textures.len()) {
        world.idle()?;
        world.destroy_texture(place);
    }
    Ok(())
}

fn destroy_view(world: &mut World, random: &mut Generator) -> Result<()> {
    world.idle()?;
    if let Some(of) = place(random, 0, world.textures.len())
        && let Some(place) = place(random, 0, world.textures[of].views.len())
    {
        let view = world.textures[of].views.swap_remove(place);
        world.destroy_view(view);
    }
    Ok(())
}

fn create_sampler(world: &mut World, random: &mut Generator) -> Result<()> {
    if world.samplers.len() < 5 {
        world.create_sampler(random)?;
    }
    Ok(())
}

fn destroy_sampler(world: &mut World, random: &mut Generator) -> Result<()> {
    // The first one stays.
    if let Some(place) = place(random, 1, world.samplers.len()) {
        world.idle()?;
        world.destroy_sampler(place);
    }
    Ok(())
}

fn create_pool(world: &mut World, random: &mut Generator) -> Result<()> {
    if world.pools.len() < 4 {
        world.create_pool(random)?;
    }
    Ok(())
}

fn reset_pool(world: &mut World, random: &mut Generator) -> Result<()> {
    if let Some(place) = place(random, 1, world.pools.len()) {
        world.idle()?;
        world.forget_sets(place);
        let none = vk::DescriptorPoolResetFlags::empty();
        let pool = world.pools[place].handle;
        // SAFETY: nothing uses the pool's sets any more.
        let reset = unsafe { world.gpu.device.reset_descriptor_pool(pool, none) };
        checked("a descriptor pool", reset)?;
    }
    Ok(())
}

fn destroy_pool(world: &mut World, random: &mut Generator) -> Result<()> {
    if let Some(place) = place(random, 1, world.pools.len()) {
        world.idle()?;
        world.forget_sets(place);
        let pool = world.pools.swap_remove(place);
        // SAFETY: nothing uses the pool's sets any more.
        unsafe { world.gpu.device.destroy_descriptor_pool(pool.handle, None) };
    }
    Ok(())
}

/// Allocates a set and writes it, or leaves it unwritten.
fn allocate_set(world: &mut World, random: &mut Generator) -> Result<()> {
    if let Some(pool) = place(random, 0, world.pools.len())
        && World::has_room(&world.pools[pool])
    {
        let set = world.set(&world.pools[pool], random.below(PUSHED))?;
        world.pools[pool].sets.push(set);
        if !random.once_in(4) {
            let set = world.pools[pool].sets.len() - 1;
            write(world, random, pool, set);
        }
    }
    Ok(())
}

fn write(world: &mut World, random: &mut Generator, pool: usize, set: usize) {
    let views = world.views();
    if let (Some(&view), Some(&sampler)) = (random.pick(&views), random.pick(&world.samplers)) {
        world.write(pool, set, view, sampler, random);
    }
}

/// A random set, except the first one, which stays.
fn any_set(world: &World, random: &mut Generator) -> Option<(usize, usize)> {
    let pool = place(random, 0, world.pools.len())?;
    let set = place(random, usize::from(pool == 0), world.pools[pool].sets.len())?;
    Some((pool, set))
}

fn free_set(world: &mut World, random: &mut Generator) -> Result<()> {
    if let Some((pool, set)) = any_set(world, random).filter(|of| world.pools[of.0].frees) {
        world.idle()?;
        let set = world.pools[pool].sets.swap_remove(set);
        world.forget(set.handle.as_raw());
        let pool = world.pools[pool].handle;
        // SAFETY: nothing uses the set any more.
        let freed = unsafe { world.gpu.device.free_descriptor_sets(pool, &[set.handle]) };
        checked("a descriptor set", freed)?;
    }
    Ok(())
}

fn write_set(world: &mut World, random: &mut Generator) -> Result<()> {
    if let Some((pool, set)) = any_set(world, random) {
        world.idle()?;
        world.forget(world.pools[pool].sets[set].handle.as_raw());
        write(world, random, pool, set);
    }
    Ok(())
}

fn copy_set(world: &mut World, random: &mut Generator) -> Result<()> {
    if let (Some(from), Some(to)) = (any_set(world, random), any_set(world, random)) {
        let of = |place: (usize, usize)| &world.pools[place.0].sets[place.1];
        if from != to && of(from).kind == of(to).kind && of(from).written.is_some() {
            world.idle()?;
            world.forget(world.pools[to.0].sets[to.1].handle.as_raw());
            world.copy(from, to);
        }
    }
    Ok(())
}

fn create_layout(world: &mut World, random: &mut Generator) -> Result<()> {
    if world.layouts.len() < 5 {
        let mut kinds = vec![random.below(SET_KINDS.len())];
        if random.once_in(2) {
            kinds.push(random.below(PUSHED));
        }
        let layout = world.layout(kinds, random.below(OFFSETS.len()))?;
        world.layouts.push(layout);
    }
    Ok(())
}

/// Replaces a layout by an equal one, with which the pipelines of the old one are compatible.
fn replace_layout(world: &mut World, random: &mut Generator) -> Result<()> {
    let place = random.below(world.layouts.len());
    let old = &world.layouts[place];
    let new = world.layout(old.kinds.clone(), old.offset)?;
    let old = std::mem::replace(&mut world.layouts[place], new);
    world.idle()?;
    // Recorded commands may outlive a layout, but Mesa 22.3 reads it when it executes them.
    world.forget(old.handle.as_raw());
    world.destroy_layout(&old);
    Ok(())
}

fn create_pipeline(world: &mut World, random: &mut Generator) -> Result<()> {
    if world.pipelines.len() >= 7 {
        return Ok(());
    }
    // Most pipelines are of the class of the frame's picture or of an existing target.
    let class = match random.pick(&world.targets) {
        Some(target) if !random.once_in(4) => target.class,
        _ => Class {
            format: random.below(FORMATS.len()),
            depth: random.once_in(2),
        },
    };
    let layout = random.below(world.layouts.len());
    let most = match world.layouts[layout].kinds.len() {
        1 => OF_TWO_SETS,
        _ => BODIES.len(),
    };
    let (dynamic, body, blends) = (random.once_in(2), random.below(most), random.once_in(4));
    let split = match random.once_in(2) {
        true => random.pick(&SPLITS).copied(),
        false => None,
    };
    let pipeline = world.pipeline(class, dynamic, layout, body, blends, split)?;
    world.pipelines.push(pipeline);
    Ok(())
}

fn destroy_pipeline(world: &mut World, random: &mut Generator) -> Result<()> {
    if let Some(place) = place(random, 2, world.pipelines.len()) {
        world.idle()?;
        world.destroy_pipeline(place);
    }
    Ok(())
}

fn create_target(world: &mut World, random: &mut Generator) -> Result<()> {
    let views = world.textures.iter().flat_map(|texture| &texture.views);
    let views: Vec<_> = views.filter(|view| view.levels == 1).copied().collect();
    if let Some(view) = random.pick(&views)
        && world.targets.len() < 7
    {
        let target = world.target(*view, random.once_in(2), random.once_in(2))?;
        world.targets.push(target);
    }
    Ok(())
}

fn destroy_target(world: &mut World, random: &mut Generator) -> Result<()> {
    if let Some(place) = place(random, 2, world.targets.len()) {
        world.idle()?;
        let target = world.targets.swap_remove(place);
        world.destroy_target(&target);
    }
    Ok(())
}

const ONCE: vk::CommandBufferUsageFlags = vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT;
const SIMULTANEOUS: vk::CommandBufferUsageFlags = vk::CommandBufferUsageFlags::SIMULTANEOUS_USE;

fn allocate(
    world: &World,
    pool: vk::CommandPool,
    level: vk::CommandBufferLevel,
) -> Result<vk::CommandBuffer> {
    let info = vk::CommandBufferAllocateInfo::default()
        .command_pool(pool)
        .level(level)
        .command_buffer_count(1);
    // SAFETY: the pool exists.
    let made = unsafe { world.gpu.device.allocate_command_buffers(&info) };
    Ok(checked("a command buffer", made)?[0])
}

/// Records a primary command buffer.
fn primary(world: &World, random: &mut Generator, once: bool, picture: bool) -> Result<Recorded> {
    let buffer = allocate(world, world.commands, vk::CommandBufferLevel::PRIMARY)?;
    record(world, random, buffer, once, picture)
}

fn record(
    world: &World,
    random: &mut Generator,
    buffer: vk::CommandBuffer,
    once: bool,
    picture: bool,
) -> Result<Recorded> {
    let simultaneous = !once && random.once_in(2);
    let flags = match (once, simultaneous) {
        (true, _) => ONCE,
        (_, true) => SIMULTANEOUS,
        _ => vk::CommandBufferUsageFlags::empty(),
    };
    let count = 1 + random.below(4);
    let mut recorder = Recorder::new(world, random.split(), buffer);
    recorder.begin(flags)?;
    recorder.commands(count);
    if picture {
        recorder.picture();
    }
    Ok(Recorded {
        buffer,
        pool: world.commands,
        simultaneous,
        pending: false,
        once,
        picture,
        inside: None,
        contents: recorder.end()?,
    })
}

/// Submits primary command buffers by their indices.
fn submit(world: &mut World, random: &mut Generator, places: &[usize]) -> Result<()> {
    for (number, place) in places.iter().enumerate() {
        let of = &world.primaries[*place];
        assert!(of.simultaneous || !(of.pending || places[..number].contains(place)));
    }
    let mut buffers = Vec::new();
    for place in places {
        let of = &mut world.primaries[*place];
        of.pending = true;
        buffers.push(of.buffer);
        world.log.extend(of.contents.draws.iter().cloned());
    }
    let wait = world.signalled.take();
    let others: Vec<_> = world
        .semaphores
        .iter()
        .copied()
        .filter(|s| Some(*s) != wait)
        .collect();
    let signal = random.once_in(2).then(|| others[0]);
    world.signalled = signal;
    let timeline = random.once_in(3);
    let before = world.timeline_value;
    world.timeline_value += u64::from(timeline);
    let fence = if random.once_in(2) {
        world.fence
    } else {
        vk::Fence::null()
    };
    let device = world.gpu.device.clone();
    // SAFETY: the command buffers are recorded and not being executed unless they may be; the semaphore that
    // is waited for is signalled by the previous submission.
    unsafe {
        if random.once_in(2) {
            // The first submission waits, the last one signals.
            let all = vk::PipelineStageFlags2::ALL_COMMANDS;
            let info = |semaphore, value| {
                let info = vk::SemaphoreSubmitInfo::default().semaphore(semaphore);
                info.value(value).stage_mask(all)
            };
            let mut waits: Vec<_> = wait.map(|wait| info(wait, 0)).into_iter().collect();
            let mut signals: Vec<_> = signal.map(|signal| info(signal, 0)).into_iter().collect();
            if timeline {
                waits.push(info(world.timeline, before));
                signals.push(info(world.timeline, before + 1));
            }
            let infos: Vec<_> = buffers
                .iter()
                .map(|buffer| [vk::CommandBufferSubmitInfo::default().command_buffer(*buffer)])
                .collect();
            let last = infos.len() - 1;
            let submits: Vec<_> = (infos.iter().enumerate())
                .map(|(number, info)| {
                    let mut submit = vk::SubmitInfo2::default().command_buffer_infos(info);
                    if number == 0 {
                        submit = submit.wait_semaphore_infos(&waits);
                    }
                    if number == last {
                        submit = submit.signal_semaphore_infos(&signals);
                    }
                    submit
                })
                .collect();
            checked(
                "a submission",
                device.queue_submit2(world.gpu.queue, &submits, fence),
            )?;
        } else {
            let mut waits: Vec<_> = wait.into_iter().collect();
            let mut signals: Vec<_> = signal.into_iter().collect();
            let mut values = [vec![0; waits.len()], vec![0; signals.len()]];
            if timeline {
                waits.push(world.timeline);
                signals.push(world.timeline);
                values[0].push(before);
                values[1].push(before + 1);
            }
            let stages = vec![vk::PipelineStageFlags::ALL_COMMANDS; waits.len()];
            let mut of_timeline = vk::TimelineSemaphoreSubmitInfo::default()
                .wait_semaphore_values(&values[0])
                .signal_semaphore_values(&values[1]);
            let submit = [vk::SubmitInfo::default()
                .command_buffers(&buffers)
                .wait_semaphores(&waits)
                .wait_dst_stage_mask(&stages)
                .signal_semaphores(&signals)
                .push_next(&mut of_timeline)];
            checked(
                "a submission",
                device.queue_submit(world.gpu.queue, &submit, fence),
            )?;
        }
        world.note_submission();
        if fence != vk::Fence::null() {
            checked("a fence", device.wait_for_fences(&[fence], true, u64::MAX))?;
            checked("a fence", device.reset_fences(&[fence]))?;
        }
        if timeline && random.once_in(2) {
            let (semaphores, values) = ([world.timeline], [world.timeline_value]);
            let info = vk::SemaphoreWaitInfo::default()
                .semaphores(&semaphores)
                .values(&values);
            checked("a semaphore", device.wait_semaphores(&info, u64::MAX))?;
        }
    }
    Ok(())
}

fn record_once(world: &mut World, random: &mut Generator) -> Result<()> {
    let mut places = Vec::new();
    for _ in 0..1 + random.below(2) {
        let recorded = primary(world, random, true, false)?;
        places.push(world.primaries.len());
        world.primaries.push(recorded);
    }
    submit(world, random, &places)
}

fn reusable(world: &World) -> Vec<usize> {
    let all = world.primaries.iter().enumerate();
    all.filter(|(_, of)| !of.once && !of.picture)
        .map(|(place, _)| place)
        .collect()
}

fn record_reusable(world: &mut World, random: &mut Generator) -> Result<()> {
    if reusable(world).len() < 4 {
        let recorded = primary(world, random, false, false)?;
        world.primaries.push(recorded);
    }
    Ok(())
}

/// Submits recorded command buffers, which may have been submitted before, or be submitted twice at once.
fn submit_again(world: &mut World, random: &mut Generator) -> Result<()> {
    if random.once_in(2) {
        world.idle()?;
    }
    let mut places: Vec<usize> = Vec::new();
    for _ in 0..1 + random.below(3) {
        let again = reusable(world);
        let Some(&place) = random.pick(&again) else {
            return Ok(());
        };
        let of = &world.primaries[place];
        if of.simultaneous || !(of.pending || places.contains(&place)) {
            places.push(place);
        }
    }
    match places.is_empty() {
        true => Ok(()),
        false => submit(world, random, &places),
    }
}

/// Records a command buffer again, after a reset or by the implicit one.
fn record_again(world: &mut World, random: &mut Generator) -> Result<()> {
    let again = reusable(world);
    let Some(&place) = random.pick(&again) else {
        return Ok(());
    };
    let raw = world.primaries[place].buffer;
    world.idle()?;
    let place = world.primaries.iter().position(|of| of.buffer == raw);
    let Some(place) = place else {
        return Ok(());
    };
    if random.once_in(2) {
        let flags = vk::CommandBufferResetFlags::RELEASE_RESOURCES;
        // SAFETY: the command buffer is not being executed.
        let reset = unsafe { world.gpu.device.reset_command_buffer(raw, flags) };
        checked("a command buffer", reset)?;
    }
    world.primaries[place] = record(world, random, raw, false, false)?;
    Ok(())
}

fn record_secondary(world: &mut World, random: &mut Generator) -> Result<()> {
    if world.secondaries.len() >= 5 {
        return Ok(());
    }
    let recorded = secondary(world, random.split(), world.commands)?;
    world.secondaries.push(recorded);
    Ok(())
}

fn secondary(world: &World, mut random: Generator, pool: vk::CommandPool) -> Result<Recorded> {
    let buffer = allocate(world, pool, vk::CommandBufferLevel::SECONDARY)?;
    let target = &world.targets[random.below(world.targets.len())];
    let dynamic = random.once_in(2);
    let mut recorder = Recorder::new(world, random, buffer);
    recorder.secondary(target, dynamic, SIMULTANEOUS)?;
    Ok(Recorded {
        buffer,
        pool,
        simultaneous: true,
        pending: false,
        once: false,
        picture: false,
        inside: Some((target.class, dynamic, target.view.size)),
        contents: recorder.end()?,
    })
}

/// Records command buffers in several threads at the same time, each with its own pool, and submits them.
fn record_in_threads(world: &mut World, random: &mut Generator) -> Result<()> {
    let count = 2 + random.below(3);
    let mut jobs = Vec::new();
    for _ in 0..count {
        let pool = command_pool(&world.gpu)?;
        let buffer = allocate(world, pool, vk::CommandBufferLevel::PRIMARY)?;
        jobs.push((pool, buffer, random.split()));
    }
    let shared: &World = world;
    let recorded: Vec<Result<(vk::CommandPool, vk::CommandBuffer, Contents)>> =
        std::thread::scope(|scope| {
            let threads: Vec<_> = jobs
                .into_iter()
                .map(|(pool, buffer, random)| {
                    scope.spawn(move || {
                        let mut recorder = Recorder::new(shared, random, buffer);
                        recorder.begin(ONCE)?;
                        recorder.commands(3);
                        Ok((pool, buffer, recorder.end()?))
                    })
                })
                .collect();
            let joined = threads.into_iter().map(|thread| match thread.join() {
                Ok(recorded) => recorded,
                Err(_) => Err("a thread panicked".to_owned()),
            });
            joined.collect()
        });
    let mut places = Vec::new();
    for of in recorded {
        let (pool, buffer, contents) = of?;
        places.push(world.primaries.len());
        world.retired.push(pool);
        world.primaries.push(Recorded {
            buffer,
            pool,
            simultaneous: false,
            pending: false,
            once: true,
            picture: false,
            inside: None,
            contents,
        });
    }
    submit(world, random, &places)
}

/// Resets the pool of all reusable command buffers, and frees these.
fn reset_command_pool(world: &mut World, random: &mut Generator) -> Result<()> {
    world.idle()?;
    let flags = match random.once_in(2) {
        true => vk::CommandPoolResetFlags::RELEASE_RESOURCES,
        false => vk::CommandPoolResetFlags::empty(),
    };
    // SAFETY: none of the pool's command buffers is being executed.
    let reset = unsafe { world.gpu.device.reset_command_pool(world.commands, flags) };
    checked("a command pool", reset)?;
    world.free_all();
    Ok(())
}

/// Renders the picture of a frame and returns its texels.
pub fn picture(world: &mut World, random: &mut Generator) -> Result<Vec<u8>> {
    world.idle()?;
    let old = world.primaries.iter().position(|of| of.picture && !of.once);
    let place = match old.filter(|_| random.once_in(2)) {
        Some(place) => place,
        None => {
            let once = random.once_in(2);
            let recorded = primary(world, random, once, true)?;
            world.primaries.push(recorded);
            world.primaries.len() - 1
        }
    };
    submit(world, random, &[place])?;
    world.idle()?;
    world.gpu.mapped(&world.readback, |bytes| bytes.to_vec())
}
