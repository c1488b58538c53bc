//! Opens a web page in Chromium and draws it frame by frame through ANGLE on Vulkan.

mod loading;
mod protocol;
mod serve;
mod watch;

pub use protocol::BrowserError;

use formats::view::EyeView;
use loading::{Loading, State};
use protocol::Browser;
use serde::Deserialize;
use serde_json::{Value, json};
use shell::Program;
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};
use watch::PageWatch;

/// A page and its settings.
#[derive(Clone, Debug)]
pub struct Page {
    /// Web address, or a file below `root`.
    pub address: String,
    /// Query string added to the address of a file: `?mode=stereo`.
    pub query: String,
    /// Folder with the files of a local page.
    pub root: Option<PathBuf>,
    /// Width and height of the window in pixels.
    pub size_px: [u32; 2],
    /// Seed of the page's random numbers.
    pub seed: u32,
    /// Milliseconds from frame to frame.
    pub frame_ms: f64,
    /// Time without a request after which a page counts as loaded.
    pub settle: Duration,
    /// Time for loading and drawing all frames.
    pub timeout: Duration,
    /// Emulated WebXR headset, if any.
    pub headset: Option<Headset>,
}

/// An emulated WebXR headset.
#[derive(Clone, Debug)]
pub struct Headset {
    /// Text of the emulator's script.
    pub emulator: String,
    /// Distance between the eyes in metres.
    pub ipd_m: f64,
    /// Vertical field of view in radians.
    pub fovy: f64,
    /// Position of the head.
    pub position: [f64; 3],
}

/// Result of drawing a frame of a page.
#[derive(Clone, Debug, Default, Deserialize)]
pub struct Stepped {
    /// Number of animation frame callbacks that were called.
    pub callbacks: u32,
    /// Time for drawing.
    pub took_ms: f64,
    /// Errors of the page's scripts.
    pub errors: Vec<String>,
    /// Number of contexts of WebGL that the browser took from the page.
    pub lost: u32,
    /// Eyes that a WebXR session drew.
    pub views: Vec<StepView>,
    /// The canvas as a PNG, if requested.
    pub picture: Option<String>,
}

/// An eye of a WebXR session.
#[derive(Clone, Debug, Deserialize)]
pub struct StepView {
    /// `left` or `right`.
    pub eye: String,
    /// Eye space to clip space, column by column; depth -1 to 1.
    pub projection: [f32; 16],
    /// World space to eye space, column by column.
    pub world_to_eye: [f32; 16],
    /// Position of the eye in world space.
    pub position: [f32; 3],
}

impl StepView {
    /// The eye in the form of a trace, with depth 0 to 1.
    pub fn eye_view(&self) -> EyeView {
        let column = |of: &[f32; 16], c: usize| [0, 1, 2, 3].map(|row| of[4 * c + row]);
        let mut eye_to_clip = [0, 1, 2, 3].map(|c| column(&self.projection, c));
        for column in &mut eye_to_clip {
            column[2] = 0.5 * (column[2] + column[3]);
        }
        EyeView {
            world_to_eye: [0, 1, 2, 3].map(|c| column(&self.world_to_eye, c)),
            eye_to_clip,
            position: self.position,
        }
    }
}

impl Stepped {
    /// Left and right eye of a WebXR session.
    pub fn eyes(&self) -> Option<[EyeView; 2]> {
        let eye = |name: &str| self.views.iter().find(|view| view.eye == name);
        Some([eye("left")?.eye_view(), eye("right")?.eye_view()])
    }
}

/// Command-line options of Chromium.
const ARGUMENTS: [&str; 15] = [
    "--headless",
    // The sandbox blocks the files of the drivers.
    "--no-sandbox",
    "--disable-gpu-sandbox",
    "--ignore-gpu-blocklist",
    "--use-gl=angle",
    "--use-angle=vulkan",
    // Avoids waiting for a GPU process.
    "--in-process-gpu",
    // Without this, llvmpipe has no WebGL 2.
    "--disable-gpu-driver-bug-workarounds",
    "--disable-gpu-watchdog",
    "--disable-background-networking",
    "--no-first-run",
    "--mute-audio",
    "--hide-scrollbars",
    "--force-device-scale-factor=1",
    "--disable-features=Translate,OptimizationHints",
];

/// An open page.
pub struct Tab {
    browser: Browser,
    watch: PageWatch,
    frame_ms: f64,
}

/// The contexts that a page made.
#[derive(Clone, Debug, Default, Deserialize)]
pub struct Contexts {
    /// Names of the renderers of the contexts of WebGL.
    pub renderers: Vec<String>,
    /// Calls for a context of WebGL that were refused.
    pub refused: u32,
    /// Canvases that were handed to workers.
    pub handed_over: u32,
    /// Workers that were started.
    pub workers: u32,
    /// Contexts of WebGPU.
    pub webgpu: u32,
}

impl Contexts {
    /// Why a page has no context of WebGL, if it has none.
    pub fn why_none(&self) -> Option<String> {
        let Self {
            refused,
            handed_over,
            workers,
            webgpu,
            ..
        } = self;
        if !self.renderers.is_empty() {
            return None;
        }
        let none = "the page has no context of WebGL";
        Some(if *handed_over > 0 {
            format!(
                "{none} of its own: {handed_over} canvases are drawn by workers, whose frames are not controlled"
            )
        } else if *webgpu > 0 {
            format!("{none}: it uses WebGPU, which is not captured")
        } else if *refused > 0 {
            format!("{none}: the browser refused it {refused} times")
        } else if *workers > 0 {
            format!(
                "{none} of its own; it started {workers} workers, whose frames are not controlled"
            )
        } else {
            none.to_owned()
        })
    }
}

/// Files that a browser would write into the user's home, and temporary files.
const HOMES: [&str; 5] = [
    "HOME",
    "XDG_CONFIG_HOME",
    "XDG_CACHE_HOME",
    "XDG_DATA_HOME",
    "TMPDIR",
];

impl Tab {
    /// Starts a browser and opens an empty page for `page`. The browser's files are in `folder`, the folder of
    /// the capture.
    ///
    /// # Errors
    /// The browser cannot be started.
    pub fn open(
        program: &Path,
        folder: &Path,
        page: &Page,
        prepare: impl FnOnce(&mut Command),
    ) -> Result<Self, BrowserError> {
        let [width, height] = page.size_px;
        let mut arguments: Vec<OsString> = ARGUMENTS.iter().map(OsString::from).collect();
        arguments.push(format!("--window-size={width},{height}").into());
        let mut profile = OsString::from("--user-data-dir=");
        profile.push(folder.join("profile"));
        arguments.push(profile);
        let mut tab = Self {
            browser: Browser::start(program, folder, &arguments, page.timeout, |command| {
                command.envs(HOMES.map(|home| (home, folder)));
                prepare(command);
            })?,
            watch: PageWatch {
                root: page.root.clone(),
                ..PageWatch::default()
            },
            frame_ms: page.frame_ms,
        };
        tab.attach(page)?;
        Ok(tab)
    }

    fn call(&mut self, method: &'static str, params: Value) -> Result<Value, BrowserError> {
        let Self { browser, watch, .. } = self;
        browser.call(method, params, &mut |browser, event| {
            watch.handle(browser, event)
        })
    }

    fn attach(&mut self, page: &Page) -> Result<(), BrowserError> {
        let deny = json!({ "behavior": "deny", "eventsEnabled": true });
        self.call("Browser.setDownloadBehavior", deny)?;
        let target = self.call("Target.createTarget", json!({ "url": "about:blank" }))?;
        let attach = json!({ "targetId": target["targetId"], "flatten": true });
        let session = self.call("Target.attachToTarget", attach)?;
        self.browser.session = session["sessionId"].as_str().map(str::to_owned);
        for method in ["Page.enable", "Runtime.enable", "Network.enable"] {
            self.call(method, json!({}))?;
        }
        let [width, height] = page.size_px;
        let metrics = json!({
            "width": width, "height": height, "deviceScaleFactor": 1, "mobile": false,
        });
        self.call("Emulation.setDeviceMetricsOverride", metrics)?;
        if page.root.is_some() {
            let patterns =
                json!({ "patterns": [{ "urlPattern": format!("{}/*", serve::ORIGIN) }] });
            self.call("Fetch.enable", patterns)?;
        }
        let settings = json!({ "seed": page.seed, "epoch_ms": 1_700_000_000_000_u64 });
        let script =
            include_str!("page.js").replacen("/* SETTINGS */ null", &settings.to_string(), 1);
        self.add_script(&script)?;
        if let Some(headset) = &page.headset {
            let settings = json!({
                "ipd_m": headset.ipd_m, "fovy": headset.fovy, "position": headset.position,
            });
            let script = include_str!("headset.js");
            let script = script.replacen("/* SETTINGS */ null", &settings.to_string(), 1);
            self.add_script(&format!("{}\n{script}", headset.emulator))?;
        }
        Ok(())
    }

    fn add_script(&mut self, source: &str) -> Result<(), BrowserError> {
        let script = json!({ "source": source });
        self.call("Page.addScriptToEvaluateOnNewDocument", script)
            .map(drop)
    }

    /// Opens the page and waits until it has loaded: until it makes no more requests. Returns the requests that
    /// were not waited for.
    ///
    /// # Errors
    /// The page cannot be loaded.
    pub fn load(&mut self, page: &Page) -> Result<String, BrowserError> {
        self.browser.stage = "loading the page".to_owned();
        let address = match page.root {
            Some(_) => serve::address(&page.address),
            None => page.address.clone(),
        };
        let url = format!("{address}{}", page.query);
        let mut loading = Loading::new(Instant::now());
        let opened = self.call("Page.navigate", json!({ "url": url }))?;
        if let Some(reason) = opened["errorText"].as_str() {
            return Err(BrowserError::Page(format!("{}: {reason}", page.address)));
        }
        loop {
            match loading.state(Instant::now(), page.settle) {
                State::No => {}
                State::Yes => return Ok(String::new()),
                State::Busy(requests) => return Ok(requests),
                State::Reloads(times) => {
                    let text = format!("it loads documents without end: {times} so far");
                    return Err(BrowserError::Page(text));
                }
                State::Silent(seconds) => {
                    let detail = loading.detail();
                    return Err(BrowserError::Silent { seconds, detail });
                }
            }
            let event = self.browser.event(Duration::from_millis(50));
            let event = event.map_err(|error| with_detail(error, loading.detail()))?;
            if let Some(event) = event {
                loading.take(&event, Instant::now());
                self.watch.handle(&mut self.browser, &event)?;
            }
        }
    }

    /// The page's contexts.
    ///
    /// # Errors
    /// The browser ended.
    pub fn contexts(&mut self) -> Result<Contexts, BrowserError> {
        let found = self.evaluate("parallax.contexts()")?;
        Ok(serde_json::from_value(found).unwrap_or_default())
    }

    /// What the page did on its own, with the number of times.
    pub fn remarks(&self) -> &BTreeMap<String, u32> {
        &self.watch.remarks
    }

    /// Draws a frame.
    ///
    /// # Errors
    /// The browser ended, or the page has an error.
    pub fn step(&mut self, frame: u32, picture: bool) -> Result<Stepped, BrowserError> {
        self.watch.draws = true;
        self.browser.stage = format!("drawing frame {frame}");
        let time_ms = self.frame_ms * (f64::from(frame) + 1.0);
        let value = self.evaluate(&format!("parallax.step({time_ms}, {picture})"));
        if let Some(url) = &self.watch.left_for {
            let text = format!("it left for {url} while frame {frame} was drawn");
            return Err(BrowserError::Page(text));
        }
        serde_json::from_value(value?).map_err(|e| BrowserError::Page(e.to_string()))
    }

    fn evaluate(&mut self, expression: &str) -> Result<Value, BrowserError> {
        let params = json!({
            "expression": expression, "awaitPromise": true, "returnByValue": true,
        });
        let result = self.call("Runtime.evaluate", params)?;
        if let Some(thrown) = result["exceptionDetails"]["exception"]["description"].as_str() {
            return Err(BrowserError::Page(thrown.to_owned()));
        }
        Ok(result["result"]["value"].clone())
    }

    /// Ends the browser. Its supervisor watches over the capture's folder until the result is dropped.
    ///
    /// # Errors
    /// The browser cannot be ended.
    pub fn close(self) -> io::Result<Program> {
        self.browser.close()
    }
}

/// Adds what is known about the delay to an exceeded time limit.
fn with_detail(error: BrowserError, known: String) -> BrowserError {
    match error {
        BrowserError::Late { seconds, stage, .. } => BrowserError::Late {
            seconds,
            stage,
            detail: known,
        },
        other => other,
    }
}
