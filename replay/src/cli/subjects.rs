//! Opens and names the texture traces of an experiment.

use anyhow::{Result, ensure};
use formats::textrace::Textrace;
use shell::Progress;
use sim::result::TraceId;
use sim::stream::TileSource;
use std::path::PathBuf;
use studies::experiment::{self, Outcome, Plan, Store, Subject, labels};

/// Opened traces.
pub struct Traces(Vec<(Textrace, TraceId, String)>);

impl Traces {
    /// Opens every file.
    ///
    /// # Errors
    /// A file that cannot be read or is damaged.
    pub fn open(paths: &[PathBuf]) -> Result<Self> {
        let open = |path: &PathBuf| {
            let (trace, id) = report::notices::open_textrace(path)?;
            ensure!(
                trace.tables().meta.plan.is_none(),
                "{}: expected captured frames, found a plan; `replay sample` says which frames to capture",
                path.display()
            );
            let stem = path.file_stem().unwrap_or_default();
            Ok((trace, id, stem.to_string_lossy().into_owned()))
        };
        paths.iter().map(open).collect::<Result<_>>().map(Self)
    }

    /// The traces themselves, in the order of the files.
    pub fn sources(&self) -> impl Iterator<Item = &dyn TileSource> {
        self.0.iter().map(|(trace, ..)| trace as &dyn TileSource)
    }

    /// Scene and content checksum of each trace.
    pub fn ids(&self) -> impl Iterator<Item = &TraceId> {
        self.0.iter().map(|(_, id, _)| id)
    }

    /// Number of quad records of each trace.
    pub fn records(&self) -> Vec<u64> {
        self.0.iter().map(|(trace, ..)| trace.records()).collect()
    }

    /// Size of all files.
    pub(super) fn file_bytes(&self) -> u64 {
        let files = self.0.iter();
        files
            .map(|(trace, ..)| trace.container().file_bytes())
            .sum()
    }

    /// The traces, labelled with their file names.
    pub(super) fn subjects_by_file(&self) -> Vec<Subject<'_>> {
        let opened = self.0.iter();
        opened
            .map(|(trace, id, stem)| Subject::new(trace, id.clone(), stem.clone()))
            .collect()
    }

    /// The traces, labelled with their scene names if these are unique.
    pub fn subjects(&self) -> Vec<Subject<'_>> {
        let named: Vec<_> = self
            .0
            .iter()
            .map(|(trace, id, stem)| (trace.tables(), id, stem.clone()))
            .collect();
        let opened = self.0.iter().zip(labels(&named));
        opened
            .map(|((trace, id, _), label)| Subject::new(trace, id.clone(), label))
            .collect()
    }
}

/// Replays every point of a plan on every trace, and warns of results that say little.
///
/// # Errors
/// A trace that cannot be replayed.
pub(super) fn replayed<'a>(
    plan: &'a Plan,
    subjects: &'a [Subject<'a>],
    store: Option<&Store>,
) -> Result<Outcome<'a>> {
    let replays = subjects.len() * plan.points.len();
    let progress = Progress::new("replaying", replays as u64, "replays");
    let outcome = experiment::run(plan, subjects, store, &|done| progress.advance(done))?;
    drop(progress);
    super::warnings::of_outcome(&outcome);
    Ok(outcome)
}
