//! An X server without a screen, for programs that open a window where there is none.

use shell::{Program, find_program};
use std::ffi::OsStr;
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::Stdio;

/// A screen in memory. Unlike Xvfb, it has the extensions that GLX programs expect, such as XFree86-VidModeExtension.
const DUMMY_SCREEN: &str = r#"Section "Device"
  Identifier "device"
  Driver "dummy"
  VideoRam 64000
EndSection
Section "Monitor"
  Identifier "monitor"
  HorizSync 5-1000
  VertRefresh 5-200
EndSection
Section "Screen"
  Identifier "screen"
  Device "device"
  Monitor "monitor"
  DefaultDepth 24
  SubSection "Display"
    Depth 24
    Modes "1280x800"
  EndSubSection
EndSection
"#;

/// A running X server, which ends when it is dropped.
#[derive(Debug)]
pub struct XServer {
    _server: Program,
    /// Value of `DISPLAY`.
    pub display: String,
}

impl XServer {
    /// Starts an X server if the environment names no display: Xorg with its dummy driver, otherwise Xvfb. `None` if there
    /// is a display, or neither of the two can be started. Files go into `folder`.
    pub fn start(folder: &Path) -> Option<Self> {
        let names = ["DISPLAY", "WAYLAND_DISPLAY"];
        if names.iter().any(|name| std::env::var_os(name).is_some()) {
            return None;
        }
        let config = folder.join("xorg.conf");
        fs::write(&config, DUMMY_SCREEN).ok()?;
        let log = folder.join("xorg.log");
        let xorg = [
            "-config".as_ref(),
            config.as_os_str(),
            "-logfile".as_ref(),
            log.as_os_str(),
        ];
        let xvfb = ["-screen", "0", "1280x800x24"].map(OsStr::new);
        Self::run(folder, "Xorg", &xorg).or_else(|| Self::run(folder, "Xvfb", &xvfb))
    }

    /// Runs a server on the first free display.
    fn run(folder: &Path, name: &str, arguments: &[&OsStr]) -> Option<Self> {
        find_program(name.as_ref())?;
        let folder = folder.join(name);
        fs::create_dir(&folder).ok()?;
        let started = Program::start(&folder, name.as_ref(), |command| {
            command.args(arguments);
            command.args(["-displayfd", "1", "-nolisten", "tcp", "-noreset"]);
            command
                .stdin(Stdio::null())
                .stdout(Stdio::piped())
                .stderr(Stdio::null());
        });
        let mut server = started.ok()?;
        let (_, output) = server.take_pipes();
        // The line comes once programs can connect. A server that cannot start closes its output.
        let mut line = String::new();
        BufReader::new(output?).read_line(&mut line).ok()?;
        let number: u32 = line.trim().parse().ok()?;
        Some(Self {
            _server: server,
            display: format!(":{number}"),
        })
    }
}
