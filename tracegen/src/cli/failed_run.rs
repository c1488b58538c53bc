//! What is known about the run of a program that could not be captured.

use anyhow::anyhow;
use programs::{SessionError, Watch};
use std::fmt::Write as _;
use std::io::{self, Read, Write as _};
use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// Number of last lines in a message, and most characters of each.
const LINES: usize = 5;
const LINE_CHARACTERS: usize = 200;
/// Number of last bytes that are kept.
const KEPT_BYTES: usize = 1 << 14;
/// Timeout for the last bytes of a program that has ended. A descendant may keep the pipe open.
const END_TIMEOUT: Duration = Duration::from_millis(300);

/// Passes the standard error of a program on and keeps its end.
pub struct Tail {
    kept: Arc<Mutex<Vec<u8>>>,
    ended: Receiver<()>,
}

impl Tail {
    /// Redirects the standard error of a command that is about to start.
    ///
    /// # Errors
    /// No pipe can be made.
    pub fn of(command: &mut Command) -> io::Result<Self> {
        let (mut reader, writer) = io::pipe()?;
        command.stderr(writer);
        let kept: Arc<Mutex<Vec<u8>>> = Arc::default();
        let (end, ended) = channel();
        let into = Arc::clone(&kept);
        std::thread::spawn(move || {
            let mut bytes = [0; 4096];
            while let Ok(count @ 1..) = reader.read(&mut bytes) {
                let _closed = io::stderr().write_all(&bytes[..count]);
                let mut kept = into.lock().unwrap_or_else(PoisonError::into_inner);
                kept.extend_from_slice(&bytes[..count]);
                let old = kept.len().saturating_sub(KEPT_BYTES);
                kept.drain(..old);
            }
            let _gone = end.send(());
        });
        Ok(Self { kept, ended })
    }

    /// The last lines. The command must have been dropped.
    pub fn lines(&self) -> Vec<String> {
        let _timeout = self.ended.recv_timeout(END_TIMEOUT);
        last_lines(&self.kept.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

/// The last lines of a text that are not empty, without control characters.
fn last_lines(text: &[u8]) -> Vec<String> {
    let text = String::from_utf8_lossy(text);
    let mut lines: Vec<String> = (text.lines().rev())
        .map(|line| {
            let visible = line.chars().filter(|c| !c.is_control());
            visible.take(LINE_CHARACTERS).collect::<String>()
        })
        .filter(|line| !line.trim().is_empty())
        .take(LINES)
        .collect();
    lines.reverse();
    lines
}

/// How a program ended.
pub struct Ended {
    /// Exit code or signal.
    pub status: ExitStatus,
    /// Whether it was asked to.
    pub stopped: bool,
}

/// The run of a program.
pub struct FailedRun {
    /// How it ended.
    pub ended: Ended,
    /// What its processes loaded.
    pub watch: Watch,
    /// Last lines that it wrote to standard error.
    pub lines: Vec<String>,
    /// File of the program.
    pub file: PathBuf,
    /// Whether it was started with OpenGL on Vulkan.
    pub opengl: bool,
    /// Whether it was started with an OpenXR runtime.
    pub openxr: bool,
    /// Whether its environment named a display.
    pub display: bool,
}

impl FailedRun {
    /// Adds the causes to an error.
    pub fn explain(&self, error: &SessionError) -> anyhow::Error {
        let mut text = format!("{error}; {}", how_it_ended(&self.ended));
        let causes = match error {
            SessionError::NoProcess(_) => self.causes(),
            SessionError::NoDevice(_) | SessionError::TooFew { .. } => self
                .no_runtime()
                .into_iter()
                .chain(self.no_display())
                .collect(),
            _ => Vec::new(),
        };
        for cause in causes {
            let _ = write!(text, "; {cause}");
        }
        if let [_, ..] = &self.lines[..] {
            let _ = write!(text, "; its last lines:\n  {}", self.lines.join("\n  "));
        }
        anyhow!(text)
    }

    /// Reasons why the program did not load the layer.
    fn causes(&self) -> Vec<String> {
        let mut causes = Vec::new();
        if let Some(process) = &self.watch.cleared {
            causes.push(format!(
                "{process} ran without the environment variables of the capture, which something cleared"
            ));
        }
        if let Some(why) = refuses_layers(&self.file) {
            causes.push(format!("{}: {why}", self.file.display()));
        }
        causes.extend(self.no_runtime());
        causes.extend(self.no_display());
        match (self.watch.vulkan, self.watch.opengl && !self.opengl) {
            _ if !causes.is_empty() => {}
            (true, _) => causes.push(
                "it loaded the Vulkan loader, which did not load the layer (VK_LOADER_DEBUG=error,layer tells why)"
                    .to_owned(),
            ),
            (false, true) => causes.push("it uses OpenGL: run it with --gl".to_owned()),
            (false, false) if self.failed() => {}
            (false, false) => {
                causes.push("it loaded neither Vulkan nor OpenGL while it was watched".to_owned());
            }
        }
        causes
    }

    /// The cause if the program found no OpenXR runtime, or one that does not tell the recorder.
    fn no_runtime(&self) -> Option<String> {
        let text = "it uses OpenXR, and had no runtime of a capture: run it with `tracegen xr`";
        let says = |line: &String| {
            line.contains("OpenXR-Loader") || line.contains("XR_ERROR_RUNTIME_UNAVAILABLE")
        };
        let is_client = self.watch.openxr || self.lines.iter().any(says);
        (is_client && !self.openxr).then(|| text.to_owned())
    }

    /// Whether the program failed by itself.
    fn failed(&self) -> bool {
        !self.ended.stopped && !self.ended.status.success()
    }

    fn no_display(&self) -> Vec<String> {
        let missing = self.failed() && !self.display;
        let text = "neither DISPLAY nor WAYLAND_DISPLAY is set, which a program with a window needs (xvfb-run sets one)";
        missing.then(|| text.to_owned()).into_iter().collect()
    }
}

/// The reason why a program's file cannot load the layer.
fn refuses_layers(file: &Path) -> Option<&'static str> {
    const SET_ID: u32 = 0o6000;
    // Class of an ELF file: 1 for 32 bits.
    const HEAD: [u8; 5] = [0x7f, b'E', b'L', b'F', 1];
    let mode = std::fs::metadata(file).ok()?.permissions().mode();
    if mode & SET_ID != 0 {
        return Some("the Vulkan loader ignores the environment of set-user-ID programs");
    }
    let mut head = [0; HEAD.len()];
    let mut open = std::fs::File::open(file).ok()?;
    open.read_exact(&mut head).ok()?;
    (head == HEAD).then_some("a program of 32 bits cannot load the layer, which has 64")
}

fn how_it_ended(ended: &Ended) -> String {
    const SHELL_SIGNAL: i32 = 128;
    match (ended.stopped, ended.status.code()) {
        (true, _) => "it was asked to end".to_owned(),
        (false, Some(code @ 129..=192)) => format!(
            "it ended with exit code {code} (a shell reports signal {} so)",
            code - SHELL_SIGNAL
        ),
        (false, Some(code)) => format!("it ended with exit code {code}"),
        (false, None) => match ended.status.signal() {
            Some(_) => format!("it ended by {}", ended.status),
            None => "it ended".to_owned(),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(script: &str) -> FailedRun {
        let mut command = Command::new("sh");
        command.args(["-c", script]);
        let tail = Tail::of(&mut command).unwrap();
        let status = command.status().unwrap();
        drop(command);
        FailedRun {
            ended: Ended {
                status,
                stopped: false,
            },
            watch: Watch::default(),
            lines: tail.lines(),
            file: PathBuf::from("/none/such"),
            opengl: false,
            openxr: false,
            display: false,
        }
    }

    #[test]
    fn the_message_has_the_end_and_the_last_lines() {
        let run = run("for i in 1 2 3 4 5 6; do echo line $i >&2; done; kill -SEGV $$");
        let text = run
            .explain(&SessionError::NoProcess("x".to_owned()))
            .to_string();
        assert!(
            text.starts_with("x never used Vulkan through the layer; it ended by signal: 11"),
            "{text}"
        );
        assert!(
            text.ends_with("its last lines:\n  line 2\n  line 3\n  line 4\n  line 5\n  line 6"),
            "{text}"
        );
    }

    #[test]
    fn codes_of_a_shell_name_the_signal() {
        let text = run("exit 139")
            .explain(&SessionError::NoDevice("x".to_owned()))
            .to_string();
        assert!(
            text.contains("exit code 139 (a shell reports signal 11 so)"),
            "{text}"
        );
    }

    #[test]
    fn causes_are_those_that_were_seen() {
        let mut run = run("exit 0");
        let text = |run: &FailedRun| {
            run.explain(&SessionError::NoProcess("x".to_owned()))
                .to_string()
        };
        assert!(text(&run).contains("neither Vulkan nor OpenGL"));
        run.watch.opengl = true;
        assert!(text(&run).contains("run it with --gl"));
        run.watch.openxr = true;
        assert!(text(&run).contains("run it with `tracegen xr`"));
        run.openxr = true;
        run.watch.vulkan = true;
        assert!(text(&run).contains("did not load the layer"));
        run.watch.cleared = Some("y".to_owned());
        assert!(text(&run).contains("y ran without the environment variables"));
    }

    #[test]
    fn files_of_32_bits_and_with_set_user_id_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("program");
        std::fs::write(&file, b"\x7fELF\x01").unwrap();
        assert!(refuses_layers(&file).unwrap().contains("32 bits"));
        std::fs::write(&file, b"\x7fELF\x02").unwrap();
        assert_eq!(refuses_layers(&file), None);
        std::fs::set_permissions(&file, std::fs::Permissions::from_mode(0o4755)).unwrap();
        assert!(refuses_layers(&file).unwrap().contains("set-user-ID"));
    }

    #[test]
    fn lines_have_no_control_characters_and_are_short() {
        let text = format!("\u{1b}[31mred\r\n\n{}\n", "x".repeat(1000));
        let lines = last_lines(text.as_bytes());
        assert_eq!(lines[0], "[31mred");
        assert_eq!(lines[1].len(), LINE_CHARACTERS);
    }
}
