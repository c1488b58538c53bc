//! `tracegen page`.

use super::program_args::{ProgramArgs, note_frame_times};
use super::scene_args::parse_size;
use super::values::{number_in, parse_timeout};
use anyhow::{Context, bail, ensure};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use clap::{Arg, Args};
use formats::container::{AtomicFile, read_regular};
use formats::view::EyeView;
use programs::browser::{Headset, Page, Stepped, Tab};
use programs::{Cameras, Launch, Session, Wanted};
use shell::{Output, Program, cannot_write, find_program, note, warn};
use spool::{FramesBy, Settings};
use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

/// Arguments of `tracegen page`.
#[derive(Args, Debug)]
#[command(mut_arg("output", without_a_trace))]
pub struct PageArgs {
    #[command(flatten)]
    capture: ProgramArgs,
    /// The page: a file, or an address that starts with http.
    page: String,
    /// Folder with the files that the page may load; by default the page's own folder.
    #[arg(long, value_name = "FOLDER")]
    root: Option<PathBuf>,
    /// Query string appended to the page's name: `?mode=stereo`.
    #[arg(long, value_name = "QUERY", default_value = "")]
    query: String,
    /// Also write the page's largest canvas after the last frame.
    #[arg(long, value_name = "FILE.png")]
    image: Option<PathBuf>,
    /// Width and height of the window.
    #[arg(long, value_name = "WIDTHxHEIGHT", default_value = "1280x720", value_parser = parse_size)]
    size: [u32; 2],
    /// Provide a WebXR headset with the emulator iwer; the value is its script (build/iwer.min.js).
    #[arg(long, value_name = "iwer.min.js")]
    iwer: Option<PathBuf>,
    /// Distance between the headset's eyes in millimetres.
    #[arg(long, value_name = "MM", default_value = "64", requires = "iwer",
          value_parser = number_in(0.0..=1000.0, "mm"), allow_hyphen_values = true)]
    ipd: f64,
    /// The headset's vertical field of view in degrees.
    #[arg(long, value_name = "DEGREES", default_value = "90", requires = "iwer",
          value_parser = number_in(1.0..=179.0, "degrees"), allow_hyphen_values = true)]
    fov: f64,
    /// Position of the headset in metres.
    #[arg(long, value_name = "X,Y,Z", default_value = "0,1.6,0", value_parser = parse_place, requires = "iwer",
          allow_hyphen_values = true)]
    head: [f64; 3],
    /// Seed of the page's random numbers.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u32,
    /// Frame rate of the page's clock in hertz.
    #[arg(long, value_name = "HZ", default_value = "60", value_parser = number_in(0.001..=1000.0, "Hz"),
          allow_hyphen_values = true)]
    rate: f64,
    /// Seconds without a request after which the page counts as loaded.
    #[arg(long, value_name = "SECONDS", default_value = "1", value_parser = number_in(0.0..=60.0, "s"),
          allow_hyphen_values = true)]
    settle: f64,
    /// Timeout in seconds; a page whose frames are not drawn by then is given up.
    #[arg(long, value_name = "SECONDS", default_value = "300", value_parser = parse_timeout)]
    timeout: Duration,
    /// Draw the page without the layer and write no trace, to measure times and save the picture.
    #[arg(long)]
    plain: bool,
    /// The browser.
    #[arg(long, value_name = "PROGRAM", default_value = "chromium")]
    chromium: PathBuf,
}

/// Farthest position of the headset.
const FARTHEST_M: f64 = 1e6;

/// Three coordinates.
fn parse_place(text: &str) -> Result<[f64; 3], String> {
    let coordinate = number_in(-FARTHEST_M..=FARTHEST_M, "m");
    let parts: Result<Vec<f64>, String> = text.split(',').map(coordinate).collect();
    <[f64; 3]>::try_from(parts?).map_err(|_| format!("expected X,Y,Z, found '{text}'"))
}

/// `--output` is not required where no trace is written.
pub(super) fn without_a_trace(output: Arg) -> Arg {
    output.required_unless_present_any(["list", "plain"])
}

/// Runs `tracegen page`.
///
/// # Errors
/// Wrong use, a page that cannot be captured, and outputs that cannot be written.
pub fn run(args: &PageArgs) -> anyhow::Result<ExitCode> {
    let image = args
        .image
        .as_deref()
        .map(|path| Output::binary("--image", path));
    let eyes = args.capture.check(image)?;
    if let Some(output) = args.capture.output().filter(|_| args.plain) {
        warn(&format!(
            "--plain: no trace is written, so {} is not",
            output.display()
        ));
    }
    let page = page(args)?;
    ensure!(
        find_program(args.chromium.as_os_str()).is_some(),
        "--chromium {}: expected a program, found no such file",
        args.chromium.display()
    );
    let settings = args.capture.settings(FramesBy::Launcher)?;
    let tool = std::env::current_exe().context("cannot find this program's own file")?;
    let launch = Launch::new(&std::env::temp_dir(), &tool, &settings)?;
    let drawn = draw(args, &launch, &page)?;
    let written = write(args, &launch, &settings, &eyes, &drawn);
    // What the page did may be the cause of the failure.
    match written {
        Err(error) if !drawn.causes.is_empty() => Err(error.context(drawn.causes.join("; "))),
        written => {
            drawn.causes.iter().for_each(|cause| warn(cause));
            written
        }
    }
}

/// Writes the trace or the list, and the picture.
fn write(
    args: &PageArgs,
    launch: &Launch,
    settings: &Settings,
    eyes: &Wanted,
    drawn: &Drawn,
) -> anyhow::Result<ExitCode> {
    // The picture is renamed to its final name only after the trace.
    let picture = args
        .image
        .as_deref()
        .map(|path| Ok::<_, anyhow::Error>((write_picture(path, drawn.picture.as_deref())?, path)))
        .transpose()?;
    let code = if args.plain {
        ExitCode::SUCCESS
    } else {
        note("reading the records");
        let mut session = Session::of_capture(launch.folder(), "the page")?;
        session.is_page = true;
        let name = format!("{}{}", page_name(&args.page), args.query);
        let cameras = Cameras {
            eyes: drawn.cameras.clone(),
            display: None,
        };
        (args.capture).finish(&mut session, name, settings, eyes, cameras)?
    };
    if let Some((file, path)) = picture {
        file.persist().with_context(|| cannot_write(path))?;
    }
    Ok(code)
}

/// Name of a page: its file name or its address.
fn page_name(page: &str) -> String {
    let name = Path::new(page).file_name().filter(|_| !is_address(page));
    name.map_or_else(
        || page.to_owned(),
        |name| name.to_string_lossy().into_owned(),
    )
}

fn is_address(page: &str) -> bool {
    page.starts_with("http://") || page.starts_with("https://")
}

/// Address of the page that is drawn.
fn page(args: &PageArgs) -> anyhow::Result<Page> {
    let (address, root) = if is_address(&args.page) {
        ensure!(
            args.root.is_none(),
            "--root: expected a page that is a file, found {}",
            args.page
        );
        (args.page.clone(), None)
    } else {
        let file = Path::new(&args.page);
        let file = file.canonicalize().with_context(|| args.page.clone())?;
        let root = match &args.root {
            Some(root) => root
                .canonicalize()
                .with_context(|| root.display().to_string())?,
            None => file.parent().unwrap_or(Path::new("/")).to_owned(),
        };
        let Ok(below) = file.strip_prefix(&root) else {
            bail!("{}: expected a page below {}", args.page, root.display());
        };
        (below.to_string_lossy().into_owned(), Some(root))
    };
    let headset = match &args.iwer {
        Some(path) => Some(Headset {
            emulator: read_script(path).with_context(|| format!("--iwer {}", path.display()))?,
            ipd_m: args.ipd / 1000.0,
            fovy: args.fov.to_radians(),
            position: args.head,
        }),
        None => None,
    };
    Ok(Page {
        address,
        query: args.query.clone(),
        root,
        size_px: args.size,
        seed: args.seed,
        frame_ms: 1000.0 / args.rate,
        settle: Duration::from_secs_f64(args.settle),
        timeout: args.timeout,
        headset,
    })
}

/// Reads a script.
fn read_script(path: &Path) -> anyhow::Result<String> {
    let text = String::from_utf8(read_regular(path)?);
    let text = text.ok().filter(|text| !text.trim().is_empty());
    text.context("expected a script in UTF-8, found none")
}

/// What a page drew.
struct Drawn {
    /// Matrices of the eyes by frame.
    cameras: BTreeMap<u32, [EyeView; 2]>,
    /// Picture of the last frame.
    picture: Option<String>,
    /// Reasons why frames may be empty.
    causes: Vec<String>,
    /// Watches over the capture's folder.
    _browser: Program,
}

/// Draws the frames up to the last captured one.
fn draw(args: &PageArgs, launch: &Launch, page: &Page) -> anyhow::Result<Drawn> {
    note(&format!("starting {}", args.chromium.display()));
    let mut tab = Tab::open(&args.chromium, launch.folder(), page, |command| {
        if args.plain {
            launch.prepare_driver(command);
        } else {
            launch.prepare(command, false);
        }
    })?;
    note(&format!("loading {}", args.page));
    let drawn = draw_frames(args, launch, page, &mut tab);
    for (what, times) in tab.remarks() {
        warn(&format!("the page: {what} ({times} times)"));
    }
    let (cameras, picture, causes) = drawn?;
    let browser = tab.close().context("cannot end the browser")?;
    Ok(Drawn {
        cameras,
        picture,
        causes,
        _browser: browser,
    })
}

/// Cameras, picture and causes; see [`Drawn`].
type Frames = (BTreeMap<u32, [EyeView; 2]>, Option<String>, Vec<String>);

fn draw_frames(
    args: &PageArgs,
    launch: &Launch,
    page: &Page,
    tab: &mut Tab,
) -> anyhow::Result<Frames> {
    let requests = tab.load(page)?;
    if !requests.is_empty() {
        warn(&format!("the page counts as loaded{requests}"));
    }
    let frames = args.capture.frames.clone();
    note(&format!("drawing frames 0 to {}", frames.end - 1));
    let (mut cameras, mut picture) = (BTreeMap::new(), None);
    let (mut before_ms, mut captured_ms) = (Vec::new(), Vec::new());
    let (mut errors, mut causes) = (BTreeMap::new(), Vec::new());
    for frame in 0..frames.end {
        launch.control.set_frame(frame);
        let is_last = args.image.is_some() && frame + 1 == frames.end;
        let stepped: Stepped = tab.step(frame, is_last)?;
        if frames.contains(&frame) {
            captured_ms.push(stepped.took_ms);
            if let Some(eyes) = stepped.eyes() {
                cameras.insert(frame, eyes);
            }
        } else {
            before_ms.push(stepped.took_ms);
        }
        if stepped.lost > 0 && causes.is_empty() {
            causes.push(format!(
                "the page lost its context of WebGL in frame {frame}"
            ));
        }
        for error in stepped.errors {
            *errors.entry(error).or_insert(0) += 1;
        }
        picture = stepped.picture.or(picture);
    }
    launch.control.set_frame(frames.end);
    for (error, times) in errors {
        warn(&format!("the page: {error} ({times} times)"));
    }
    let contexts = tab.contexts()?;
    for renderer in &contexts.renderers {
        note(&format!("drawn by {renderer}"));
    }
    causes.extend(contexts.why_none());
    note_frame_times(&before_ms, &captured_ms);
    Ok((cameras, picture, causes))
}

/// Writes a picture that the page returned as a data URL to a temporary file.
fn write_picture(path: &Path, picture: Option<&str>) -> anyhow::Result<AtomicFile> {
    let data = picture.and_then(|picture| picture.strip_prefix("data:image/png;base64,"));
    let bytes = data.and_then(|data| STANDARD.decode(data).ok());
    let bytes = bytes.context("the page has no canvas of WebGL")?;
    let place = || cannot_write(path);
    let mut file = AtomicFile::create(path).with_context(place)?;
    file.write_all(&bytes).with_context(place)?;
    Ok(file)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, clap::Parser)]
    struct Cli {
        #[command(flatten)]
        args: PageArgs,
    }

    /// A text of characters that numbers have, from a seed.
    fn random_text(seed: &mut u64) -> String {
        let parts = [
            "0", "1", "9", "25", "1e", "E", ".", ",", "-", "+", "nan", "inf", "infinity", "e308",
            "e-320", " ", "x", "",
        ];
        let mut below = |most: u64| {
            *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (*seed >> 33) % most
        };
        let count = 1 + below(6);
        let chosen = (0..count).map(|_| parts[below(parts.len() as u64) as usize]);
        chosen.collect()
    }

    fn is_in_range(args: &PageArgs) -> bool {
        (0.0..=1000.0).contains(&args.ipd)
            && (1.0..=179.0).contains(&args.fov)
            && (0.001..=1000.0).contains(&args.rate)
            && (0.0..=60.0).contains(&args.settle)
            && args.head.iter().all(|at| at.abs() <= FARTHEST_M)
            && !args.timeout.is_zero()
            && args.size.iter().all(|size| *size > 0)
    }

    #[test]
    fn numbers_of_any_text_are_refused_or_within_their_range() {
        use clap::Parser;
        let options = [
            "ipd", "fov", "head", "rate", "settle", "timeout", "size", "seed", "frames",
        ];
        let (mut seed, mut accepted) = (7, 0);
        for number in 0..4000 {
            let option = options[number % options.len()];
            let text = match option {
                "head" => [0; 3].map(|_| random_text(&mut seed)).join(","),
                _ => random_text(&mut seed),
            };
            let value = format!("--{option}={text}");
            let line = ["page", "a.html", "-o", "o", "--iwer", "i.js", &value];
            if let Ok(cli) = Cli::try_parse_from(line) {
                assert!(is_in_range(&cli.args), "{value}: {:?}", cli.args);
                accepted += 1;
            }
        }
        assert!(accepted > 100, "{accepted} accepted");
        let millimetres = number_in(0.0..=1000.0, "mm");
        for _ in 0..100_000 {
            let text = random_text(&mut seed);
            let place = [0; 3].map(|_| random_text(&mut seed)).join(",");
            for number in millimetres(&text)
                .into_iter()
                .chain(parse_place(&place).into_iter().flatten())
            {
                assert!(number.abs() <= FARTHEST_M, "{text} or {place}: {number}");
            }
            assert!(
                parse_timeout(&text).map_or(true, |time| !time.is_zero()),
                "{text}"
            );
        }
    }

    #[test]
    fn positions_are_three_finite_numbers() {
        assert_eq!(parse_place("0, 1.6,-2"), Ok([0.0, 1.6, -2.0]));
        for bad in [
            "nan,0,0", "0,inf,0", "0,0,-1e7", "0,0", "0,0,0,0", "", "a,b,c",
        ] {
            assert!(parse_place(bad).is_err(), "{bad}");
        }
    }
}
