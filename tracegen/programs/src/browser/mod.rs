//! Opens a web page in Chromium and draws it frame by frame through ANGLE on Vulkan.

mod protocol;
mod serve;

pub use protocol::BrowserError;

use formats::view::EyeView;
use protocol::{Browser, Event};
use serde::Deserialize;
use serde_json::{Value, json};
use std::collections::HashSet;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

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
    /// Seconds without a request after which a page counts as loaded.
    pub settle_s: f64,
    /// Emulated WebXR headset, if any.
    pub headset: Option<Headset>,
}

/// An emulated WebXR headset.
#[derive(Clone, Debug)]
pub struct Headset {
    /// Script of the emulator.
    pub emulator: PathBuf,
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
    #[must_use]
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
    #[must_use]
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
    root: Option<PathBuf>,
    frame_ms: f64,
    /// Failed requests of the page.
    pub missing: Vec<String>,
}

impl Tab {
    /// Starts a browser, opens a page and waits until it has loaded.
    ///
    /// # Errors
    /// The browser cannot be started, or the page cannot be loaded.
    pub fn open(
        program: &Path,
        profile: &Path,
        page: &Page,
        prepare: impl FnOnce(&mut Command),
    ) -> Result<Self, BrowserError> {
        let [width, height] = page.size_px;
        let mut arguments: Vec<OsString> = ARGUMENTS.iter().map(OsString::from).collect();
        arguments.push(format!("--window-size={width},{height}").into());
        let mut folder = OsString::from("--user-data-dir=");
        folder.push(profile);
        arguments.push(folder);
        let mut tab = Self {
            browser: Browser::start(program, &arguments, prepare)?,
            root: page.root.clone(),
            frame_ms: page.frame_ms,
            missing: Vec::new(),
        };
        tab.attach(page)?;
        tab.load(page)?;
        Ok(tab)
    }

    fn call(&mut self, method: &'static str, params: Value) -> Result<Value, BrowserError> {
        let Self { browser, root, .. } = self;
        browser.call(method, params, &mut |browser, event| match root {
            Some(root) => serve::serve(browser, root, event),
            None => Ok(false),
        })
    }

    fn attach(&mut self, page: &Page) -> Result<(), BrowserError> {
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
            let emulator = std::fs::read_to_string(&headset.emulator)
                .map_err(|e| BrowserError::Page(format!("{}: {e}", headset.emulator.display())))?;
            let settings = json!({
                "ipd_m": headset.ipd_m, "fovy": headset.fovy, "position": headset.position,
            });
            let script = include_str!("headset.js");
            let script = script.replacen("/* SETTINGS */ null", &settings.to_string(), 1);
            self.add_script(&format!("{emulator}\n{script}"))?;
        }
        Ok(())
    }

    fn add_script(&mut self, source: &str) -> Result<(), BrowserError> {
        let script = json!({ "source": source });
        self.call("Page.addScriptToEvaluateOnNewDocument", script)
            .map(drop)
    }

    /// Opens the page and waits until it makes no more requests.
    fn load(&mut self, page: &Page) -> Result<(), BrowserError> {
        let address = match page.root {
            Some(_) => serve::address(&page.address),
            None => page.address.clone(),
        };
        let url = format!("{address}{}", page.query);
        let opened = self.call("Page.navigate", json!({ "url": url }))?;
        if let Some(reason) = opened["errorText"].as_str() {
            return Err(BrowserError::Page(format!("{}: {reason}", page.address)));
        }
        let settle = Duration::from_secs_f64(page.settle_s);
        let (mut loaded, mut open) = (false, HashSet::new());
        let mut last = Instant::now();
        while !loaded || !open.is_empty() || last.elapsed() < settle {
            let Some(event) = self.browser.event(Duration::from_millis(50))? else {
                if last.elapsed() > LOADING_TIMEOUT {
                    return Err(BrowserError::Silent {
                        doing: "loading the page",
                        seconds: LOADING_TIMEOUT.as_secs(),
                    });
                }
                continue;
            };
            match event.method.as_str() {
                "Page.loadEventFired" => loaded = true,
                "Network.requestWillBeSent" => {
                    let url = event.params["request"]["url"].as_str().unwrap_or("");
                    // Data URLs are not requested from a server.
                    if !url.starts_with("data:") && !url.starts_with("blob:") {
                        open.insert(event.params["requestId"].to_string());
                    }
                }
                "Network.loadingFinished" | "Network.loadingFailed" => {
                    open.remove(&event.params["requestId"].to_string());
                }
                "Fetch.requestPaused" => {}
                _ => continue,
            }
            last = Instant::now();
            self.note(&event);
            if let Some(root) = self.root.clone() {
                serve::serve(&mut self.browser, &root, &event)?;
            }
        }
        Ok(())
    }

    fn note(&mut self, event: &Event) {
        let response = &event.params;
        if event.method == "Network.loadingFailed"
            && let Some(reason) = response["errorText"].as_str()
        {
            self.missing.push(reason.to_owned());
        }
    }

    /// Names of the renderers of the page's WebGL contexts.
    ///
    /// # Errors
    /// The browser ended.
    pub fn renderers(&mut self) -> Result<Vec<String>, BrowserError> {
        let found = self.evaluate("parallax.renderers()")?;
        Ok(serde_json::from_value(found).unwrap_or_default())
    }

    /// Draws a frame.
    ///
    /// # Errors
    /// The browser ended, or the page has an error.
    pub fn step(&mut self, frame: u32, picture: bool) -> Result<Stepped, BrowserError> {
        let time_ms = self.frame_ms * (f64::from(frame) + 1.0);
        let value = self.evaluate(&format!("parallax.step({time_ms}, {picture})"))?;
        serde_json::from_value(value).map_err(|e| BrowserError::Page(e.to_string()))
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

    /// Process ID of the browser.
    #[must_use]
    pub fn pid(&self) -> u32 {
        self.browser.pid()
    }

    /// Ends the browser.
    pub fn close(self) {
        self.browser.close();
    }
}

/// A page that has not loaded is given up after this time without a request.
const LOADING_TIMEOUT: Duration = Duration::from_secs(120);
