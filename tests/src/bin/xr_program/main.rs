//! A small OpenXR program on Vulkan, for the tests of `tracegen xr`: each eye is a picture of 256x256 pixels that shows
//! a texture of as many texels, so each eye samples 65,536 texels. It presents nothing, and ends when the runtime asks.
//!
//!     xr_program [--layout separate|layers|multiview|side|msaa|target|blit] [--enable 1|2] [--end clean|crash|ignore]
//!         [--eyes FILE] [--space local|stage|view] [--empty]
//!     xr_program --wrong FILE

mod api;
mod draw;
#[path = "../vulkan_program/gpu.rs"]
#[expect(dead_code, reason = "the other program uses more of it")]
mod gpu;
mod session;
mod targets;
#[path = "../../wgsl.rs"]
mod wgsl;
mod wrong;

use std::process::ExitCode;

/// How the eyes' pictures are laid out in swapchains, and how they get there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layout {
    /// A swapchain per eye.
    Separate,
    /// A layer per eye.
    Layers,
    /// A layer per eye, in one draw.
    Multiview,
    /// One picture beside the other.
    Side,
    /// A multisampled target per eye, which is resolved into a layer.
    Msaa,
    /// A target per eye, from which a full-screen pass fills a layer.
    Target,
    /// A target per eye, which is blitted to a layer.
    Blit,
}

/// Command-line options.
#[derive(Clone, Debug)]
pub struct Options {
    layout: Layout,
    /// Version of the extension for Vulkan.
    enable: u32,
    end: String,
    /// File for the eyes of the last frame, as JSON.
    eyes: Option<String>,
    space: openxr_sys::ReferenceSpaceType,
    /// Whether it shows no pictures.
    empty: bool,
    wrong: Option<String>,
}

fn options() -> Result<Options, String> {
    let mut options = Options {
        layout: Layout::Separate,
        enable: 2,
        end: "clean".to_owned(),
        eyes: None,
        space: openxr_sys::ReferenceSpaceType::LOCAL,
        empty: false,
        wrong: None,
    };
    let mut arguments = std::env::args().skip(1);
    while let Some(name) = arguments.next() {
        let mut value = || {
            arguments
                .next()
                .ok_or_else(|| format!("{name} needs a value"))
        };
        match name.as_str() {
            "--layout" => {
                options.layout = match value()?.as_str() {
                    "separate" => Layout::Separate,
                    "layers" => Layout::Layers,
                    "multiview" => Layout::Multiview,
                    "side" => Layout::Side,
                    "msaa" => Layout::Msaa,
                    "target" => Layout::Target,
                    "blit" => Layout::Blit,
                    other => return Err(format!("unknown layout {other}")),
                }
            }
            "--enable" => options.enable = value()?.parse().map_err(|_| "--enable 1 or 2")?,
            "--end" => options.end = value()?,
            "--eyes" => options.eyes = Some(value()?),
            "--space" => {
                options.space = match value()?.as_str() {
                    "stage" => openxr_sys::ReferenceSpaceType::STAGE,
                    "view" => openxr_sys::ReferenceSpaceType::VIEW,
                    _ => openxr_sys::ReferenceSpaceType::LOCAL,
                }
            }
            "--empty" => options.empty = true,
            "--wrong" => options.wrong = Some(value()?),
            _ => return Err(format!("unknown option {name}")),
        }
    }
    Ok(options)
}

fn main() -> ExitCode {
    let run = || {
        let options = options()?;
        match &options.wrong {
            Some(file) => wrong::run(file),
            None => session::run(&options),
        }
    };
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("xr_program: {error}");
            ExitCode::FAILURE
        }
    }
}
