//! Measures how long lavapipe compiles fragment shaders before and after the recording code is inserted.
//!
//!     compile_times [--turns N] FOLDER
//!
//! FOLDER is one that `tracegen app --modules FOLDER` or `tracegen page --modules FOLDER` has written. For each pair of
//! modules, it makes a pipeline of each with a vertex shader, descriptors and targets that fit, and draws a triangle
//! outside the view, because the driver compiles at the first draw. A line of CSV per pair: the number of the shader,
//! words of both modules, sites, and milliseconds of processor time of all threads, the least of N turns. The disk cache of
//! the driver must be off (`MESA_SHADER_CACHE_DISABLE=true`).

mod descriptors;
#[path = "../vulkan_program/gpu.rs"]
#[allow(dead_code, reason = "the other program uses the rest")]
mod gpu;
#[path = "../vulkan_program/graphics.rs"]
#[allow(dead_code, reason = "the other program uses the rest")]
mod graphics;
mod pipeline;
mod reflect;
mod vertex;

use gpu::Gpu;
use pipeline::Fitting;
use reflect::Fragment;
use std::path::Path;
use std::process::ExitCode;

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("compile_times: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> Result<(), String> {
    let mut arguments: Vec<String> = std::env::args().skip(1).collect();
    let mut turns = 3;
    if let [name, value, ..] = &arguments[..]
        && name == "--turns"
    {
        turns = value.parse().map_err(|_| format!("--turns: {value}"))?;
        arguments.drain(..2);
    }
    let [folder] = &arguments[..] else {
        return Err("expected a folder of modules".to_owned());
    };
    if std::env::var("MESA_SHADER_CACHE_DISABLE").as_deref() != Ok("true") {
        return Err("expected MESA_SHADER_CACHE_DISABLE=true, so that caches are cold".to_owned());
    }
    let gpu = pipeline::open()?;
    // The driver's own first compilation takes longer.
    let warm = Fragment::of(&pipeline::plain_module())?;
    Fitting::new(&gpu, &warm)?.compile(&warm.words)?;
    println!("module,words,recording words,samples,plain ms,recorded ms");
    for stem in stems(Path::new(folder))? {
        let read = |of: &str| {
            let path = Path::new(folder).join(format!("{stem}-{of}.spv"));
            let bytes = std::fs::read(&path).map_err(|e| format!("{}: {e}", path.display()))?;
            let words = bytes.chunks_exact(4);
            Ok::<_, String>(
                words
                    .map(|w| u32::from_le_bytes([w[0], w[1], w[2], w[3]]))
                    .collect::<Vec<u32>>(),
            )
        };
        let (program, recording) = (read("program")?, read("recording")?);
        let measured = measured(&gpu, &program, &recording, turns);
        match measured {
            Ok((samples, [plain, recorded])) => println!(
                "{stem},{},{},{samples},{plain:.2},{recorded:.2}",
                program.len(),
                recording.len()
            ),
            Err(error) => eprintln!("compile_times: {stem} is left out: {error}"),
        }
    }
    Ok(())
}

/// Number of instructions that read texels, and milliseconds of both modules.
fn measured(
    gpu: &Gpu,
    program: &[u32],
    recording: &[u32],
    turns: u32,
) -> Result<(usize, [f64; 2]), String> {
    let fragment = Fragment::of(program)?;
    let fitting = Fitting::new(gpu, &fragment)?;
    let mut least = [f64::INFINITY; 2];
    for _ in 0..turns {
        for (least, words) in least.iter_mut().zip([program, recording]) {
            *least = least.min(fitting.compile(words)?);
        }
    }
    Ok((fragment.samples(), least))
}

/// Names of the pairs in a folder, without their endings.
fn stems(folder: &Path) -> Result<Vec<String>, String> {
    let entries = std::fs::read_dir(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let mut found: Vec<String> = entries
        .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
        .filter_map(|name| Some(name.strip_suffix("-recording.spv")?.to_owned()))
        .collect();
    found.sort();
    Ok(found)
}
