//! Speaks Chromium's DevTools protocol over a pair of pipes.

use serde_json::{Value, json};
use shell::Program;
use std::collections::VecDeque;
use std::ffi::{OsStr, OsString};
use std::io::{self, BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
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
    Ended(String),
    /// The time limit is over.
    #[error(
        "the page was given up after {seconds} seconds while {stage}{detail} (--timeout sets the seconds)"
    )]
    Late {
        /// The time limit.
        seconds: f64,
        /// What was done.
        stage: String,
        /// What is known about the delay.
        detail: String,
    },
    /// The page does not load.
    #[error("the page did not load: nothing new for {seconds} seconds{detail}")]
    Silent {
        /// Time without an event.
        seconds: u64,
        /// Requests that are not answered.
        detail: String,
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
    program: Program,
    to: Sender<Vec<u8>>,
    from: Receiver<Value>,
    next: u64,
    /// Session of the page; `None` before the page is attached.
    pub session: Option<String>,
    /// What is being done, for messages: `loading the page`.
    pub stage: String,
    started: Instant,
    most: Duration,
    events: VecDeque<Event>,
}

/// Time for the browser's own end.
const CLOSING: Duration = Duration::from_secs(5);

/// Interval between two looks whether the browser is running.
const LOOK_INTERVAL: Duration = Duration::from_millis(200);

impl Browser {
    /// Starts a browser with arguments for at most a time. `folder` is the folder of this capture; `prepare`
    /// adds environment variables.
    ///
    /// # Errors
    /// The browser cannot be started.
    pub fn start(
        program: &Path,
        folder: &Path,
        arguments: &[OsString],
        most: Duration,
        prepare: impl FnOnce(&mut Command),
    ) -> Result<Self, BrowserError> {
        // The protocol's pipes are file descriptors 3 and 4.
        let script = r#"exec "$0" "$@" 3<&0 4>&1 </dev/null >/dev/null 2>&1"#;
        let started = Program::start(folder, OsStr::new("/bin/sh"), |command| {
            command
                .args(["-c", script])
                .arg(program)
                .args(arguments)
                .arg("--remote-debugging-pipe")
                .stdin(Stdio::piped())
                .stdout(Stdio::piped());
            prepare(command);
        });
        let mut started = started.map_err(|source| BrowserError::Start {
            program: program.display().to_string(),
            source,
        })?;
        let (input, output) = started.take_pipes();
        let (to, outgoing) = channel::<Vec<u8>>();
        let (send, from) = channel();
        // A browser that does not read blocks only this thread.
        std::thread::spawn(move || {
            let Some(mut input) = input else { return };
            for message in outgoing {
                if input.write_all(&message).is_err() {
                    return;
                }
            }
        });
        std::thread::spawn(move || {
            let Some(output) = output else { return };
            let mut output = BufReader::new(output);
            let mut message = Vec::new();
            // Messages end with a zero byte.
            while output
                .read_until(0, &mut message)
                .is_ok_and(|read| read > 0)
            {
                message.pop();
                let parsed = serde_json::from_slice(&message);
                if parsed.is_ok_and(|value| send.send(value).is_err()) {
                    return;
                }
                message.clear();
            }
        });
        Ok(Self {
            program: started,
            to,
            from,
            next: 1,
            session: None,
            stage: "starting the browser".to_owned(),
            started: Instant::now(),
            most,
            events: VecDeque::new(),
        })
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
        self.to.send(bytes).map_err(|_| self.ended())?;
        Ok(id)
    }

    /// Sends a command without waiting for its answer.
    ///
    /// # Errors
    /// The browser ended.
    pub fn notify(&mut self, method: &'static str, params: Value) -> Result<(), BrowserError> {
        self.send(method, params).map(drop)
    }

    /// Sends a command and waits for its result. `handle` gets the events that arrive before it; events that it
    /// returns false for are kept.
    ///
    /// # Errors
    /// The browser ended, the time limit is over, or the browser rejects the command.
    pub fn call(
        &mut self,
        method: &'static str,
        params: Value,
        handle: &mut dyn FnMut(&mut Self, &Event) -> Result<bool, BrowserError>,
    ) -> Result<Value, BrowserError> {
        let id = self.send(method, params)?;
        loop {
            let Some(message) = self.receive(self.most)? else {
                continue;
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
                && !handle(self, &event)?
            {
                self.events.push_back(event);
            }
        }
    }

    /// The next event, if one arrives within a time.
    ///
    /// # Errors
    /// The browser ended, or the time limit is over.
    pub fn event(&mut self, within: Duration) -> Result<Option<Event>, BrowserError> {
        if let Some(event) = self.events.pop_front() {
            return Ok(Some(event));
        }
        let start = Instant::now();
        loop {
            match self.receive(within.saturating_sub(start.elapsed()))? {
                None => return Ok(None),
                Some(message) => {
                    if let Some(event) = event(message) {
                        return Ok(Some(event));
                    }
                }
            }
        }
    }

    /// The next message, if one arrives within a time.
    fn receive(&mut self, within: Duration) -> Result<Option<Value>, BrowserError> {
        let start = Instant::now();
        loop {
            if self.started.elapsed() >= self.most {
                return Err(BrowserError::Late {
                    seconds: self.most.as_secs_f64(),
                    stage: self.stage.clone(),
                    detail: String::new(),
                });
            }
            let rest = within.saturating_sub(start.elapsed());
            match self.from.recv_timeout(rest.min(LOOK_INTERVAL)) {
                Ok(message) => return Ok(Some(message)),
                Err(RecvTimeoutError::Disconnected) => return Err(self.ended()),
                Err(RecvTimeoutError::Timeout) => {
                    if self.program.ended().map_or(true, |ended| ended.is_some()) {
                        return Err(self.ended());
                    }
                    if start.elapsed() >= within {
                        return Ok(None);
                    }
                }
            }
        }
    }

    fn ended(&self) -> BrowserError {
        BrowserError::Ended(self.stage.clone())
    }

    /// Ends the browser. Its supervisor watches over the capture's folder until the result is dropped.
    ///
    /// # Errors
    /// The browser cannot be ended.
    pub fn close(mut self) -> io::Result<Program> {
        self.session = None;
        let _gone = self.send("Browser.close", json!({}));
        if self.program.wait(CLOSING)?.is_none() {
            self.program.end()?;
        }
        Ok(self.program)
    }
}

fn event(message: Value) -> Option<Event> {
    Some(Event {
        method: message["method"].as_str()?.to_owned(),
        params: message["params"].clone(),
    })
}
