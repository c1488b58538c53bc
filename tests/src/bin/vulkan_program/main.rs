//! A small Vulkan program that renders a stereo picture, for the tests of `tracegen app`.
//!
//! Every texel holds its own coordinates, level and layer, and the filter is nearest, so the colour of each
//! pixel identifies the texel that it shows. The objects differ in how their shaders sample.
//!
//!     vulkan_program [--stereo halves|targets|twice|multiview|mono] [--objects NAME,NAME...] [--frames N]
//!         [--size WIDTHxHEIGHT] [--picture FILE] [--end crash|early|fork|hang|before] [--libraries 0|1|2]
//!         [--also vertex,compute,late,event,unread] [--instances N] [--draws N]
//!     vulkan_program --random SEED [--calls N] [--frames N] [--picture FILE]
//!     vulkan_program --fields NAME,NAME...
//!
//! With `--random`, it makes random calls instead: see `random`. With `--fields`, it renders a full-screen draw per
//! frame: see `fields`.

mod also;
mod fields;
mod gpu;
mod graphics;
mod libraries;
mod objects;
mod pipeline;
mod random;
mod render;
mod scene;
mod sets;
mod shaders;
mod targets;
mod textures;
#[path = "../../wgsl.rs"]
mod wgsl;

use std::process::ExitCode;

/// How both eyes are rendered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stereo {
    /// Into the halves of one picture, in one render pass.
    Halves,
    /// Into one target per eye.
    Targets,
    /// Into one target, one after the other.
    Twice,
    /// Into two layers by one draw.
    Multiview,
    /// Only one eye.
    Mono,
}

/// Command-line options.
pub struct Options {
    stereo: Stereo,
    objects: Vec<&'static objects::Object>,
    frames: u32,
    size_px: [u32; 2],
    picture: Option<String>,
    end: Option<String>,
    also: also::Also,
    /// Libraries that pipelines are linked from.
    libraries: Option<libraries::Split>,
    /// Instances of each draw.
    instances: u32,
    /// Draws of each object, the first instances of which ascend from 0.
    draws: u32,
    /// Full-screen draws, one per frame.
    fields: Vec<&'static fields::Field>,
    /// Seed of random calls.
    random: Option<u64>,
    /// Number of random operations.
    calls: u32,
}

fn options() -> Result<Options, String> {
    let mut options = Options {
        stereo: Stereo::Halves,
        objects: objects::OBJECTS.iter().collect(),
        frames: 3,
        size_px: [240, 200],
        picture: None,
        end: None,
        also: also::Also::default(),
        libraries: None,
        instances: 1,
        draws: 1,
        fields: Vec::new(),
        random: None,
        calls: 100,
    };
    let mut arguments = std::env::args().skip(1);
    while let Some(name) = arguments.next() {
        let value = arguments
            .next()
            .ok_or(format!("{name}: a value is missing"))?;
        let number = |text: &str| text.parse().map_err(|_| format!("{name}: {text}"));
        match name.as_str() {
            "--stereo" => {
                options.stereo = match value.as_str() {
                    "halves" => Stereo::Halves,
                    "targets" => Stereo::Targets,
                    "twice" => Stereo::Twice,
                    "multiview" => Stereo::Multiview,
                    "mono" => Stereo::Mono,
                    _ => return Err(format!("--stereo: {value}")),
                }
            }
            "--objects" => {
                let find = |name: &str| {
                    let mut all = objects::OBJECTS.iter().chain(objects::NAMED);
                    all.find(|object| object.name == name)
                        .ok_or(format!("--objects: {name}"))
                };
                options.objects = value.split(',').map(find).collect::<Result<_, _>>()?;
            }
            "--frames" => options.frames = number(&value)?,
            "--size" => {
                let (width, height) = value.split_once('x').ok_or(format!("--size: {value}"))?;
                options.size_px = [number(width)?, number(height)?];
            }
            "--instances" => options.instances = number(&value)?,
            "--draws" => options.draws = number(&value)?,
            "--picture" => options.picture = Some(value),
            "--end" => options.end = Some(value),
            "--also" => options.also = also::Also::parse(&value)?,
            "--libraries" => {
                let split = libraries::SPLITS.get(number(&value)? as usize);
                options.libraries = Some(*split.ok_or(format!("--libraries: {value}"))?);
            }
            "--fields" => {
                let find = |name: &str| {
                    let mut all = fields::FIELDS.iter();
                    all.find(|field| field.name == name)
                        .ok_or(format!("--fields: {name}"))
                };
                options.fields = value.split(',').map(find).collect::<Result<_, _>>()?;
                (options.stereo, options.size_px) = (Stereo::Mono, [textures::EDGE; 2]);
            }
            "--random" => options.random = Some(number(&value)?.into()),
            "--calls" => options.calls = number(&value)?,
            _ => return Err(format!("{name} is no option")),
        }
    }
    Ok(options)
}

fn main() -> ExitCode {
    let outcome = options().and_then(|options| match options.random {
        Some(seed) => {
            let (calls, frames) = (options.calls, options.frames);
            random::run(seed, calls, frames, options.picture.as_deref())
        }
        None if !options.fields.is_empty() => fields::run(&options),
        None => render::run(&options),
    });
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("vulkan_program: {error}");
            ExitCode::FAILURE
        }
    }
}
