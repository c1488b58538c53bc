//! A program of random, valid Vulkan calls, for tests of the layer: `--random SEED --calls N`.
//!
//! Operations create, change and destroy objects, and record and submit command buffers, in random order.
//! Every frame ends with a picture that is read back.
//!
//! The file of `--picture` gets the picture and the results of the queries of every frame. Standard output has
//! a line for each draw into the frames' pictures: the frame, and the sizes of the textures it reads.

mod generator;
mod operations;
mod record;
mod shaders;
mod world;

use crate::gpu::Result;
use generator::Generator;
use operations::{OPERATIONS, picture, start};
use std::fmt::Write;
use world::World;

/// Renders frames after random operations.
pub fn run(seed: u64, operations: u32, frames: u32, file: Option<&str>) -> Result<()> {
    let mut random = Generator::new(seed);
    let mut worlds = vec![World::new(&mut random, 0)?];
    if random.once_in(3) {
        worlds.push(World::new(&mut random, 800)?);
    }
    for world in &mut worlds {
        start(world, &mut random)?;
    }
    let table: Vec<_> = OPERATIONS
        .iter()
        .flat_map(|(weight, operation)| std::iter::repeat_n(operation, *weight))
        .collect();
    let (mut bytes, mut draws) = (Vec::new(), String::new());
    for frame in 0..frames {
        // The first device renders the pictures.
        worlds[0].shows = true;
        for _ in 0..operations / frames.max(1) {
            let place = random.below(worlds.len());
            let operation = table[random.below(table.len())];
            operation(&mut worlds[place], &mut random)?;
        }
        bytes.extend(picture(&mut worlds[0], &mut random)?);
        for world in &mut worlds {
            world.idle()?;
            bytes.extend(bytemuck::cast_slice::<u64, u8>(&world.results()));
        }
        for of_draw in worlds[0].log.drain(..) {
            let _ = writeln!(draws, "{frame} {of_draw:?}");
        }
        if random.once_in(4) {
            // Another device replaces one.
            let place = random.below(worlds.len());
            let old = worlds.swap_remove(place);
            let first = old.created();
            old.close()?;
            let mut new = World::new(&mut random, first)?;
            start(&mut new, &mut random)?;
            worlds.push(new);
        }
    }
    for world in worlds {
        world.close()?;
    }
    print!("{draws}");
    match file {
        Some(path) => std::fs::write(path, bytes).map_err(|e| format!("{path}: {e}")),
        None => Ok(()),
    }
}
