//! Runs long work on a separate thread, so that Ctrl-C ends the call at once and no panic reaches
//! Python.

use crate::errors::Failure;
use formats::textrace::geometry::{Geometry, TileLists};
use formats::textrace::{Tables, Textrace, Tile};
use pyo3::prelude::*;
use replay::experiment::{Subject, labels};
use replay::result::TraceId;
use replay::stream::{StreamError, TileSource};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

/// Time between two checks for Ctrl-C.
const CHECK: Duration = Duration::from_millis(50);

/// Signals a job to end.
#[derive(Clone, Debug, Default)]
pub struct Stop(Arc<AtomicBool>);

impl Stop {
    fn ask(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// True if the job must end.
    pub fn is_asked(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// Runs a job without the interpreter's lock. On Ctrl-C it is signalled to stop and the call
/// returns without waiting for it.
pub fn run<T: Send + 'static>(
    py: Python<'_>,
    job: impl FnOnce(Stop) -> Result<T, Failure> + Send + 'static,
) -> PyResult<T> {
    run_and_wait(py, false, job)
}

/// Runs a job. If `waits` is set, Ctrl-C ends the call only after the job has ended: a job that
/// calls Python must not outlive the interpreter.
pub fn run_and_wait<T: Send + 'static>(
    py: Python<'_>,
    waits: bool,
    job: impl FnOnce(Stop) -> Result<T, Failure> + Send + 'static,
) -> PyResult<T> {
    let stop = Stop::default();
    let (send, receive) = channel();
    let its_stop = stop.clone();
    let thread = std::thread::spawn(move || {
        let outcome = catch_unwind(AssertUnwindSafe(|| job(its_stop)));
        // After Ctrl-C the receiver is gone.
        let _ = send.send(outcome);
    });
    // mpsc receivers are not `Sync`, which detaching requires.
    let receive = std::sync::Mutex::new(receive);
    loop {
        let received = py.detach(|| match receive.lock() {
            Ok(receive) => receive.recv_timeout(CHECK),
            Err(_) => Err(RecvTimeoutError::Disconnected),
        });
        match received {
            Ok(Ok(outcome)) => return Ok(outcome?),
            Ok(Err(_)) | Err(RecvTimeoutError::Disconnected) => {
                let text = "internal error: the job panicked; the message is on standard error";
                return Err(Failure::Own(anyhow::anyhow!(text)).into());
            }
            Err(RecvTimeoutError::Timeout) => {
                if let Err(interrupt) = py.check_signals() {
                    stop.ask();
                    if waits {
                        let _ = py.detach(|| thread.join());
                    }
                    return Err(interrupt);
                }
            }
        }
    }
}

/// A trace that returns an error once its job must stop.
struct Stoppable {
    trace: Textrace,
    stop: Stop,
}

impl TileSource for Stoppable {
    fn tables(&self) -> &Tables {
        self.trace.tables()
    }

    fn records(&self) -> u64 {
        self.trace.records()
    }

    fn read_tile(&self, pass: u32, index: u32, tile: &mut Tile) -> Result<(), StreamError> {
        if self.stop.is_asked() {
            return Err(StreamError::Tables("interrupted".to_owned()));
        }
        self.trace.read_tile(pass, index, tile)
    }

    fn has_same_tiles(&self, a: u32, b: u32) -> bool {
        TileSource::has_same_tiles(&self.trace, a, b)
    }

    fn geometry(&self) -> Option<&Geometry> {
        self.trace.geometry()
    }

    fn tile_lists(&self, view: usize) -> Result<TileLists, StreamError> {
        TileSource::tile_lists(&self.trace, view)
    }
}

/// Opened texture traces.
pub struct Traces(Vec<(Stoppable, TraceId, String)>);

impl Traces {
    /// Opens every file.
    pub fn open(paths: &[PathBuf], stop: &Stop) -> anyhow::Result<Self> {
        let open = |path: &PathBuf| {
            let (trace, id) = replay::notices::open_textrace(path)?;
            let stem = path.file_stem().unwrap_or_default();
            let stop = stop.clone();
            Ok((
                Stoppable { trace, stop },
                id,
                stem.to_string_lossy().into_owned(),
            ))
        };
        paths
            .iter()
            .map(open)
            .collect::<anyhow::Result<_>>()
            .map(Self)
    }

    /// The traces with the labels of the command line.
    pub fn subjects(&self) -> Vec<Subject<'_>> {
        let opened = self.0.iter();
        let named: Vec<_> = opened
            .clone()
            .map(|(trace, id, stem)| (trace.tables(), id, stem.clone()))
            .collect();
        opened
            .zip(labels(&named))
            .map(|((trace, id, _), label)| Subject::new(trace, id.clone(), label))
            .collect()
    }
}
