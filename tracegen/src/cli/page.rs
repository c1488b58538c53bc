//! `tracegen page`.

use super::program_args::{ProgramArgs, note_frame_times};
use super::scene_args::parse_size;
use anyhow::{Context, bail, ensure};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use clap::Args;
use formats::container::AtomicFile;
use formats::view::EyeView;
use parallax_layer::spool::FramesBy;
use programs::browser::{Headset, Page, Stepped, Tab};
use programs::{Launch, Session};
use shell::{Output, note, warn};
use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Arguments of `tracegen page`.
#[derive(Args, Debug)]
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
    #[arg(long, value_name = "MM", default_value_t = 64.0, requires = "iwer")]
    ipd: f64,
    /// The headset's vertical field of view in degrees.
    #[arg(
        long,
        value_name = "DEGREES",
        default_value_t = 90.0,
        requires = "iwer"
    )]
    fov: f64,
    /// Position of the headset in metres.
    #[arg(long, value_name = "X,Y,Z", default_value = "0,1.6,0", value_parser = parse_place, requires = "iwer",
          allow_hyphen_values = true)]
    head: [f64; 3],
    /// Seed of the page's random numbers.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u32,
    /// Frame rate of the page's clock in hertz.
    #[arg(long, value_name = "HZ", default_value_t = 60.0)]
    rate: f64,
    /// Seconds without a request after which the page counts as loaded.
    #[arg(long, value_name = "SECONDS", default_value_t = 1.0)]
    settle: f64,
    /// Draw the page without the layer and write no trace, to measure times and save the picture.
    #[arg(long)]
    plain: bool,
    /// The browser.
    #[arg(long, value_name = "PROGRAM", default_value = "chromium")]
    chromium: PathBuf,
}

/// Three coordinates.
fn parse_place(text: &str) -> Result<[f64; 3], String> {
    let parts: Option<Vec<f64>> = text
        .split(',')
        .map(|part| part.trim().parse().ok())
        .collect();
    let place = parts.and_then(|parts| <[f64; 3]>::try_from(parts).ok());
    place.ok_or_else(|| format!("expected X,Y,Z, found {text}"))
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
    args.capture.check_outputs(image)?;
    ensure!(
        args.rate > 0.0 && args.rate <= 1000.0,
        "--rate: expected 0 to 1000 Hz, found {}",
        args.rate
    );
    ensure!(
        (0.0..=60.0).contains(&args.settle),
        "--settle: expected 0 to 60 s, found {}",
        args.settle
    );
    let settings = args.capture.settings(FramesBy::Launcher)?;
    let tool = std::env::current_exe().context("cannot find this program's own file")?;
    let launch = Launch::new(&std::env::temp_dir(), &tool, &settings)?;
    let page = page(args)?;
    let (cameras, picture) = draw(args, &launch, &page)?;
    // The picture is renamed to its final name only after the trace.
    let picture = args
        .image
        .as_deref()
        .map(|path| Ok::<_, anyhow::Error>((write_picture(path, picture.as_deref())?, path)))
        .transpose()?;
    let code = if args.plain {
        ExitCode::SUCCESS
    } else {
        let mut session = Session::of_capture(launch.folder(), "the page")?;
        let name = format!("{}{}", page_name(&args.page), args.query);
        args.capture
            .finish(&mut session, name, &settings, cameras)?
    };
    if let Some((file, path)) = picture {
        file.persist()
            .with_context(|| format!("cannot write {}", path.display()))?;
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
    let headset = args.iwer.as_ref().map(|emulator| Headset {
        emulator: emulator.clone(),
        ipd_m: args.ipd / 1000.0,
        fovy: args.fov.to_radians(),
        position: args.head,
    });
    Ok(Page {
        address,
        query: args.query.clone(),
        root,
        size_px: args.size,
        seed: args.seed,
        frame_ms: 1000.0 / args.rate,
        settle_s: args.settle,
        headset,
    })
}

/// Matrices of the eyes by frame, and the picture of the last frame.
type Drawn = (BTreeMap<u32, [EyeView; 2]>, Option<String>);

/// Draws the frames up to the last captured one.
fn draw(args: &PageArgs, launch: &Launch, page: &Page) -> anyhow::Result<Drawn> {
    let profile = launch.folder().join("profile");
    let mut tab = Tab::open(&args.chromium, &profile, page, |command| {
        if args.plain {
            launch.prepare_driver(command);
        } else {
            launch.prepare(command, false);
        }
    })?;
    let frames = args.capture.frames.clone();
    let (mut cameras, mut picture) = (BTreeMap::new(), None);
    let (mut before_ms, mut captured_ms) = (Vec::new(), Vec::new());
    let mut errors = BTreeMap::new();
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
        for error in stepped.errors {
            *errors.entry(error).or_insert(0) += 1;
        }
        picture = stepped.picture.or(picture);
    }
    launch.control.set_frame(frames.end);
    for (error, times) in errors {
        warn(&format!("the page: {error} ({times} times)"));
    }
    for renderer in tab.renderers()? {
        note(&format!("drawn by {renderer}"));
    }
    tab.close();
    note_frame_times(&before_ms, &captured_ms);
    Ok((cameras, picture))
}

/// Writes a picture that the page returned as a data URL to a temporary file.
fn write_picture(path: &Path, picture: Option<&str>) -> anyhow::Result<AtomicFile> {
    let data = picture.and_then(|picture| picture.strip_prefix("data:image/png;base64,"));
    let bytes = data.and_then(|data| STANDARD.decode(data).ok());
    let bytes = bytes.context("the page has no canvas of WebGL")?;
    let place = || format!("cannot write {}", path.display());
    let mut file = AtomicFile::create(path).with_context(place)?;
    file.write_all(&bytes).with_context(place)?;
    Ok(file)
}
