//! Speaks Chromium's DevTools protocol over a pair of pipes.

use serde_json::{Value, json};
use std::collections::VecDeque;
use std::ffi::OsString;
use std::io::{self, BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};
use thiserror::Error;

/// Reasons why a page cannot be controlled.
#[derive(Debug, Error)]
pub enum BrowserError {
    /// The browser could not be started.
    #[error("cannot start {program}: {source}")]
    Start {
        /// Program of the browser.
        program: String,
        /// Error of the system.
        source: io::Error,
    },
    /// The browser ended.
    #[error("the browser ended while {0}")]
    Ended(&'static str),
    /// The browser does not answer.
    #[error("the browser did not answer within {seconds} seconds while {doing}")]
    Silent {
        /// The method that was called.
        doing: &'static str,
        /// The time limit.
        seconds: u64,
    },
    /// The browser rejected a command.
    #[error("the browser refuses {method}: {reason}")]
    Refused {
        /// Name of the command.
        method: &'static str,
        /// Message of the browser.
        reason: String,
    },
    /// An error of the page.
    #[error("the page: {0}")]
    Page(String),
}

/// An event of the browser.
#[derive(Clone, Debug)]
pub struct Event {
    /// Name.
    pub method: String,
    /// Parameters of the event.
    pub params: Value,
}

/// A running browser.
pub struct Browser {
    child: Child,
    to: Option<ChildStdin>,
    from: Receiver<Value>,
    next: u64,
    /// Session of the page; `None` before the page is attached.
    pub session: Option<String>,
    events: VecDeque<Event>,
}

/// Time limit for the answer to a command.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(300);

impl Browser {
    /// Starts a browser with arguments; `prepare` adds environment variables.
    ///
    /// # Errors
    /// The browser cannot be started.
    pub fn start(
        program: &Path,
        arguments: &[OsString],
        prepare: impl FnOnce(&mut Command),
    ) -> Result<Self, BrowserError> {
        let failed = |source| BrowserError::Start {
            program: program.display().to_string(),
            source,
        };
        // The protocol's pipes are file descriptors 3 and 4.
        let mut command = Command::new("/bin/sh");
        command
            .args([
                "-c",
                r#"exec "$0" "$@" 3<&0 4>&1 </dev/null >/dev/null 2>&1"#,
            ])
            .arg(program)
            .args(arguments)
            .arg("--remote-debugging-pipe")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped());
        prepare(&mut command);
        let mut child = command.spawn().map_err(failed)?;
        let to = child.stdin.take();
        let (send, from) = channel();
        if let Some(out) = child.stdout.take() {
            std::thread::spawn(move || {
                let mut out = BufReader::new(out);
                let mut message = Vec::new();
                // Messages end with a zero byte.
                while out.read_until(0, &mut message).is_ok_and(|read| read > 0) {
                    message.pop();
                    let parsed = serde_json::from_slice(&message);
                    if parsed.is_ok_and(|value| send.send(value).is_err()) {
                        return;
                    }
                    message.clear();
                }
            });
        }
        Ok(Self {
            child,
            to,
            from,
            next: 1,
            session: None,
            events: VecDeque::new(),
        })
    }

    /// Process ID of the browser.
    #[must_use]
    pub fn pid(&self) -> u32 {
        self.child.id()
    }

    fn send(&mut self, method: &'static str, params: Value) -> Result<u64, BrowserError> {
        let id = self.next;
        self.next += 1;
        let mut message = json!({ "id": id, "method": method, "params": params });
        if let Some(session) = &self.session {
            message["sessionId"] = json!(session);
        }
        let mut bytes = message.to_string().into_bytes();
        bytes.push(0);
        let to = self.to.as_mut().ok_or(BrowserError::Ended(method))?;
        to.write_all(&bytes)
            .map_err(|_| BrowserError::Ended(method))?;
        Ok(id)
    }

    /// Sends a command without waiting for its answer.
    ///
    /// # Errors
    /// The browser ended.
    pub fn notify(&mut self, method: &'static str, params: Value) -> Result<(), BrowserError> {
        self.send(method, params).map(drop)
    }

    /// Sends a command and waits for its result. `serve` handles events that arrive before it; events that it
    /// does not handle are kept.
    ///
    /// # Errors
    /// The browser ended, does not answer, or rejects the command.
    pub fn call(
        &mut self,
        method: &'static str,
        params: Value,
        serve: &mut dyn FnMut(&mut Self, &Event) -> Result<bool, BrowserError>,
    ) -> Result<Value, BrowserError> {
        let id = self.send(method, params)?;
        let deadline = Instant::now() + ANSWER_TIMEOUT;
        loop {
            let rest = deadline.saturating_duration_since(Instant::now());
            let Some(message) = self.receive(rest, method)? else {
                return Err(BrowserError::Silent {
                    doing: method,
                    seconds: ANSWER_TIMEOUT.as_secs(),
                });
            };
            if message["id"].as_u64() == Some(id) {
                if let Some(reason) = message["error"]["message"].as_str() {
                    return Err(BrowserError::Refused {
                        method,
                        reason: reason.to_owned(),
                    });
                }
                return Ok(message["result"].clone());
            }
            if let Some(event) = event(message)
                && !serve(self, &event)?
            {
                self.events.push_back(event);
            }
        }
    }

    /// The next event, if one arrives within a time.
    ///
    /// # Errors
    /// The browser ended.
    pub fn event(&mut self, within: Duration) -> Result<Option<Event>, BrowserError> {
        if let Some(event) = self.events.pop_front() {
            return Ok(Some(event));
        }
        let deadline = Instant::now() + within;
        loop {
            let rest = deadline.saturating_duration_since(Instant::now());
            match self.receive(rest, "waiting for the page")? {
                None => return Ok(None),
                Some(message) => {
                    if let Some(event) = event(message) {
                        return Ok(Some(event));
                    }
                }
            }
        }
    }

    fn receive(
        &mut self,
        within: Duration,
        doing: &'static str,
    ) -> Result<Option<Value>, BrowserError> {
        match self.from.recv_timeout(within) {
            Ok(message) => Ok(Some(message)),
            Err(RecvTimeoutError::Timeout) => Ok(None),
            Err(RecvTimeoutError::Disconnected) => Err(BrowserError::Ended(doing)),
        }
    }

    /// Ends the browser.
    pub fn close(mut self) {
        self.session = None;
        let _gone = self.send("Browser.close", json!({}));
        self.to = None;
        let deadline = Instant::now() + Duration::from_secs(10);
        while Instant::now() < deadline {
            if self.child.try_wait().is_ok_and(|status| status.is_some()) {
                return;
            }
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        // The browser may have ended already.
        let _gone = self.child.kill();
        let _status = self.child.wait();
    }
}

fn event(message: Value) -> Option<Event> {
    Some(Event {
        method: message["method"].as_str()?.to_owned(),
        params: message["params"].clone(),
    })
}
