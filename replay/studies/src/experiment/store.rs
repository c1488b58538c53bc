//! Stores results of points in append-only files, so that an interrupted sweep can be resumed.
//!
//! Every process writes its own file, so no file has two writers. Reading takes the rows of all files,
//! except damaged ones and those that a killed process left incomplete.

use super::rows::StoredRow;
use anyhow::Context;
use formats::container::open_regular;
use serde::{Deserialize, Serialize};
use shell::Shard;
use sim::config::RunConfig;
use sim::model_version::MODEL_VERSION;
use sim::result::{RunResult, TOOL, TraceId};
use std::collections::{BTreeMap, HashMap};
use std::fs::{File, OpenOptions};
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Schema of a stored point.
pub const POINT_SCHEMA: &str = "replay.point/3";

/// Extension of points files.
const EXTENSION: &str = "rows";

/// Upper limit for the size of a row, larger than any point with per-tile counts.
const LARGEST_ROW_BYTES: u64 = 1 << 29;

/// Content of a row.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct StoredPoint {
    /// `replay.point/3`.
    pub schema: String,
    /// Program and version.
    pub tool: String,
    /// Checksum of the trace's content.
    pub trace: String,
    /// The complete configuration.
    pub config: RunConfig,
    /// Result.
    pub result: RunResult,
}

/// Reasons why the store has no result for a point.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Absent {
    /// There is no row.
    #[error("missing")]
    Missing,
    /// Its row is unreadable or belongs to another point.
    #[error("damaged: {0}")]
    Damaged(String),
}

/// Location of a row.
#[derive(Clone, Copy, Debug)]
struct RowLocation {
    /// Index of the file.
    file: usize,
    /// Line, counted from 1.
    line: usize,
    offset_bytes: u64,
    length_bytes: u64,
    crc32: u32,
}

/// The points of a sweep: the content of its files when opened, and a file for new rows.
#[derive(Debug)]
pub struct Store {
    folder: PathBuf,
    /// First part of new files' names.
    name: String,
    files: Vec<PathBuf>,
    rows: HashMap<String, RowLocation>,
    /// Keys with two different results.
    contradictions: HashMap<String, String>,
    damages: Vec<String>,
    /// Number of rows of each other model version.
    foreign: BTreeMap<u32, usize>,
    added: Mutex<Added>,
}

/// The file for new rows.
#[derive(Debug)]
enum Added {
    Nothing,
    To(File, PathBuf),
    /// Writing failed with this error. The last row may be incomplete, so nothing is appended. All threads
    /// report the first error, because any of them may be the one shown.
    Failed(PathBuf, String),
}

/// Key of a point: a 128-bit FNV-1a hash of the model version, the trace's checksum and the complete configuration.
///
/// The row repeats these, so a collision costs a replay but never gives a wrong result.
pub fn point_key(trace: &TraceId, config: &RunConfig) -> String {
    const PRIME: u128 = 0x0000_0000_0100_0000_0000_0000_0000_013B;
    const BASIS: u128 = 0x6C62_272E_07BB_0142_62B8_2175_6295_C58D;
    let config = serde_json::to_string(config).unwrap_or_default();
    let version = MODEL_VERSION.to_string();
    let hash = [&version, "\n", trace.checksum.as_str(), "\n", &config]
        .iter()
        .flat_map(|part| part.bytes())
        .fold(BASIS, |hash, byte| {
            (hash ^ u128::from(byte)).wrapping_mul(PRIME)
        });
    format!("{hash:032x}")
}

impl Store {
    /// Opens the points of the sweep with outputs in `folder`. New points go to a separate file, named after the shard.
    ///
    /// # Errors
    /// The folder cannot be read. Unreadable files in it count as damages.
    pub fn open(folder: &Path, shard: Option<Shard>) -> anyhow::Result<Self> {
        let folder = folder.join("points");
        let cannot = || format!("{}: cannot read", folder.display());
        let mut files = Vec::new();
        match std::fs::read_dir(&folder) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => (),
            Err(error) => return Err(error).with_context(cannot),
            Ok(entries) => {
                for entry in entries {
                    let path = entry.with_context(cannot)?.path();
                    if path.extension().is_some_and(|e| e == EXTENSION) {
                        files.push(path);
                    }
                }
            }
        }
        files.sort();
        let mut store = Self {
            folder,
            name: shard.map_or_else(
                || "all".to_owned(),
                |shard| format!("{}-of-{}", shard.number, shard.count),
            ),
            files,
            rows: HashMap::new(),
            contradictions: HashMap::new(),
            damages: Vec::new(),
            foreign: BTreeMap::new(),
            added: Mutex::new(Added::Nothing),
        };
        for file in 0..store.files.len() {
            if let Err(error) = store.read_rows(file) {
                let damage = format!("{}: {error}", store.files[file].display());
                store.damages.push(damage);
            }
        }
        Ok(store)
    }

    /// The folder of the points files.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Skipped rows and files: file, row, expected and found.
    pub fn damages(&self) -> &[String] {
        &self.damages
    }

    /// Number of rows of each other model version.
    pub fn foreign(&self) -> &BTreeMap<u32, usize> {
        &self.foreign
    }

    /// Indexes every row of a file. Only regular files are opened, because a pipe would block.
    fn read_rows(&mut self, file: usize) -> io::Result<()> {
        let path = self.files[file].clone();
        let mut reader = BufReader::with_capacity(1 << 16, open_regular(&path)?);
        let mut line = Vec::new();
        let mut offset_bytes = 0;
        for number in 1.. {
            line.clear();
            let mut limited = reader.by_ref().take(LARGEST_ROW_BYTES + 1);
            let length_bytes = limited.read_until(b'\n', &mut line)? as u64;
            if length_bytes == 0 {
                break;
            }
            if length_bytes > LARGEST_ROW_BYTES {
                return Err(io::Error::other(format!(
                    "row {number}: expected at most {LARGEST_ROW_BYTES} bytes, found more"
                )));
            }
            let place = RowLocation {
                file,
                line: number,
                offset_bytes,
                length_bytes,
                crc32: crc32fast::hash(&line),
            };
            offset_bytes += length_bytes;
            match StoredRow::decode(&line) {
                Err(why) => {
                    let damage = format!("{}: row {number}: {why}", path.display());
                    self.damages.push(damage);
                }
                Ok(row) if row.model_version != MODEL_VERSION => {
                    *self.foreign.entry(row.model_version).or_default() += 1;
                }
                Ok(row) => self.note(row.key.to_owned(), place),
            }
        }
        Ok(())
    }

    /// Indexes a row; the same row may be in several files.
    fn note(&mut self, key: String, place: RowLocation) {
        let known = *self.rows.entry(key.clone()).or_insert(place);
        if (known.crc32, known.length_bytes) != (place.crc32, place.length_bytes) {
            let [known, other] = [known, place].map(|p| self.name_of(p));
            let why = format!("expected one result, found two: {known} and {other}");
            self.contradictions.insert(key, why);
        }
    }

    fn name_of(&self, place: RowLocation) -> String {
        format!("{}: row {}", self.files[place.file].display(), place.line)
    }

    /// The stored result of a point.
    ///
    /// # Errors
    /// Why there is none: no row, or a damaged one.
    pub fn find(&self, trace: &TraceId, config: &RunConfig) -> Result<RunResult, Absent> {
        let key = point_key(trace, config);
        let place = *self.rows.get(&key).ok_or(Absent::Missing)?;
        if let Some(why) = self.contradictions.get(&key) {
            return Err(Absent::Damaged(why.clone()));
        }
        let damaged = |why: &dyn std::fmt::Display| {
            Absent::Damaged(format!("{}: {why}", self.name_of(place)))
        };
        let line = self.read_row(place).map_err(|error| damaged(&error))?;
        let row = StoredRow::decode(&line).map_err(|why| damaged(&why))?;
        let point: StoredPoint = serde_json::from_str(row.json).map_err(|error| damaged(&error))?;
        if point.schema != POINT_SCHEMA {
            let found = point.schema;
            return Err(damaged(&format!("expected {POINT_SCHEMA}, found {found}")));
        }
        if point.trace != trace.checksum || point.config != *config {
            return Err(damaged(&"holds another point"));
        }
        Ok(point.result)
    }

    fn read_row(&self, place: RowLocation) -> io::Result<Vec<u8>> {
        let mut file = open_regular(&self.files[place.file])?;
        file.seek(SeekFrom::Start(place.offset_bytes))?;
        let mut line = Vec::new();
        file.take(place.length_bytes).read_to_end(&mut line)?;
        Ok(line)
    }

    /// Stores a point's result and returns it as it will be read back, so that first and resumed runs print
    /// the same digits.
    ///
    /// # Errors
    /// The row cannot be written.
    pub fn save(
        &self,
        trace: &TraceId,
        config: &RunConfig,
        result: &RunResult,
    ) -> anyhow::Result<RunResult> {
        let point = StoredPoint {
            schema: POINT_SCHEMA.to_owned(),
            tool: TOOL.to_owned(),
            trace: trace.checksum.clone(),
            config: *config,
            result: result.clone(),
        };
        let json = serde_json::to_string(&point)?;
        let row = StoredRow {
            model_version: MODEL_VERSION,
            key: &point_key(trace, config),
            json: &json,
        };
        self.append(&row.encode())?;
        Ok(serde_json::from_str::<StoredPoint>(&json)?.result)
    }

    /// Appends a row in a single write, so that a killed process leaves at most its last row incomplete.
    fn append(&self, row: &[u8]) -> anyhow::Result<()> {
        let mut added = self.added.lock().unwrap_or_else(PoisonError::into_inner);
        if matches!(*added, Added::Nothing) {
            let (file, path) = self.new_file()?;
            *added = Added::To(file, path);
        }
        let (written, path) = match &mut *added {
            Added::To(file, path) => (file.write_all(row), path.clone()),
            Added::Failed(path, reason) => (Err(io::Error::other(reason.clone())), path.clone()),
            Added::Nothing => return Ok(()),
        };
        if let Err(error) = &written {
            *added = Added::Failed(path.clone(), error.to_string());
        }
        written.with_context(|| format!("{}: cannot write", path.display()))
    }

    /// Creates a file that no other process uses.
    fn new_file(&self) -> anyhow::Result<(File, PathBuf)> {
        let cannot = |path: &Path| format!("{}: cannot write", path.display());
        std::fs::create_dir_all(&self.folder).with_context(|| cannot(&self.folder))?;
        for number in 1.. {
            let path = self
                .folder
                .join(format!("{}.{number}.{EXTENSION}", self.name));
            match OpenOptions::new().append(true).create_new(true).open(&path) {
                Ok(file) => return Ok((file, path)),
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => (),
                Err(error) => return Err(error).with_context(|| cannot(&path)),
            }
        }
        unreachable!("file names are unlimited")
    }
}

/// The schema of the JSON object.
#[cfg(feature = "testing")]
pub fn point_schema() -> formats::schemas::Published {
    formats::schemas::Published::of::<StoredPoint>(POINT_SCHEMA)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trace() -> TraceId {
        TraceId {
            scene: "atrium".into(),
            checksum: "0badcafe".into(),
            ..TraceId::default()
        }
    }

    fn result(footprints: u64) -> RunResult {
        RunResult {
            footprints,
            access_hash: "ab".into(),
            ..RunResult::default()
        }
    }

    fn open(folder: &tempfile::TempDir) -> Store {
        Store::open(folder.path(), None).unwrap()
    }

    /// Stores a point, and returns its file and row.
    fn saved(folder: &tempfile::TempDir, config: &RunConfig) -> (PathBuf, Vec<u8>) {
        let store = open(folder);
        store.save(&trace(), config, &result(7)).unwrap();
        let path = files(&store).remove(0);
        let line = std::fs::read(&path).unwrap();
        (path, line)
    }

    fn files(store: &Store) -> Vec<PathBuf> {
        let mut files: Vec<PathBuf> = std::fs::read_dir(store.folder())
            .unwrap()
            .map(|entry| entry.unwrap().path())
            .collect();
        files.sort();
        files
    }

    #[test]
    fn stored_points_are_read_back_from_one_file_per_process() {
        let folder = tempfile::tempdir().unwrap();
        let configs: Vec<RunConfig> = (1..=20)
            .map(|seed| RunConfig {
                seed,
                ..RunConfig::default()
            })
            .collect();
        for half in configs.chunks(10) {
            let store = open(&folder);
            for config in half {
                assert_eq!(store.find(&trace(), config), Err(Absent::Missing));
                store.save(&trace(), config, &result(config.seed)).unwrap();
            }
        }
        let store = open(&folder);
        assert_eq!(files(&store).len(), 2);
        assert!(store.damages().is_empty());
        for config in &configs {
            assert_eq!(store.find(&trace(), config), Ok(result(config.seed)));
        }
    }

    #[test]
    fn every_row_after_a_failed_write_reports_the_first_error() {
        let folder = tempfile::tempdir().unwrap();
        let store = open(&folder);
        let path = folder.path().join("rows");
        std::fs::write(&path, "").unwrap();
        // Opened for reading, so that writing fails.
        *store.added.lock().unwrap() = Added::To(File::open(&path).unwrap(), path);
        let failed = || {
            let error = store.append(b"row\n").unwrap_err();
            format!("{error:#}")
        };
        let first = failed();
        assert!(first.contains("Bad file descriptor"), "{first}");
        assert_eq!(failed(), first);
    }

    #[test]
    fn a_changed_byte_anywhere_is_refused_with_file_row_expected_and_found() {
        let folder = tempfile::tempdir().unwrap();
        let config = RunConfig::default();
        let other = RunConfig { seed: 2, ..config };
        let store = open(&folder);
        store.save(&trace(), &config, &result(7)).unwrap();
        store.save(&trace(), &other, &result(8)).unwrap();
        let path = files(&store).remove(0);
        let bytes = std::fs::read(&path).unwrap();
        for at in 0..bytes.len() {
            let mut changed = bytes.clone();
            changed[at] = if changed[at] == b'7' { b'8' } else { b'7' };
            std::fs::write(&path, &changed).unwrap();
            let store = open(&folder);
            assert!(!store.damages().is_empty(), "byte {at}");
            let damage = &store.damages()[0];
            let named = damage.starts_with(&format!("{}: row ", path.display()));
            assert!(named && damage.contains("expected"), "{damage}");
            let found = [&config, &other].map(|config| store.find(&trace(), config));
            let taken = found.iter().flatten().count();
            assert!(taken <= 1, "byte {at}");
            for (found, expected) in found.into_iter().zip([7, 8]) {
                assert!(found.is_err() || found == Ok(result(expected)), "byte {at}");
            }
        }
        // A killed process leaves an incomplete last row; the rows before it are valid.
        std::fs::write(&path, &bytes[..bytes.len() - 5]).unwrap();
        let store = open(&folder);
        assert_eq!(store.find(&trace(), &config), Ok(result(7)));
        assert_eq!(store.find(&trace(), &other), Err(Absent::Missing));
    }

    #[test]
    fn rows_of_another_model_version_and_conflicting_rows_are_not_used() {
        let folder = tempfile::tempdir().unwrap();
        let config = RunConfig::default();
        let (path, line) = saved(&folder, &config);
        let row = StoredRow::decode(&line).unwrap();
        let older = StoredRow {
            model_version: 0,
            ..row
        };
        std::fs::write(&path, older.encode()).unwrap();
        let store = open(&folder);
        assert_eq!(store.find(&trace(), &config), Err(Absent::Missing));
        assert_eq!(store.foreign(), &BTreeMap::from([(0, 1)]));
        // A program with other counts under the same version.
        open(&folder).save(&trace(), &config, &result(7)).unwrap();
        open(&folder).save(&trace(), &config, &result(8)).unwrap();
        let found = open(&folder).find(&trace(), &config).unwrap_err();
        assert!(found.to_string().contains("found two"), "{found}");
    }

    #[test]
    fn a_row_under_another_points_key_is_not_used() {
        let folder = tempfile::tempdir().unwrap();
        let config = RunConfig::default();
        let (path, line) = saved(&folder, &config);
        let other = RunConfig { seed: 2, ..config };
        let row = StoredRow {
            key: &point_key(&trace(), &other),
            ..StoredRow::decode(&line).unwrap()
        };
        std::fs::write(&path, row.encode()).unwrap();
        let found = open(&folder).find(&trace(), &other).unwrap_err();
        assert!(
            found.to_string().ends_with("holds another point"),
            "{found}"
        );
    }

    #[cfg(unix)]
    #[test]
    fn irregular_files_and_too_large_rows_are_not_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("points/all.1.rows");
        std::fs::create_dir_all(&path).unwrap();
        let found = || open(&folder).damages()[0].clone();
        assert!(found().ends_with("expected a regular file, found a folder"));
        std::fs::remove_dir(&path).unwrap();
        let made = std::process::Command::new("mkfifo").arg(&path).status();
        assert!(made.unwrap().success());
        assert!(found().ends_with("expected a regular file, found a pipe"));
        std::fs::remove_file(&path).unwrap();
        let large = File::create(&path).unwrap();
        large.set_len(LARGEST_ROW_BYTES + 1).unwrap();
        let found = found();
        assert!(
            found.contains("expected at most 536870912 bytes"),
            "{found}"
        );
    }

    #[test]
    fn the_key_depends_on_trace_and_configuration() {
        let config = RunConfig::default();
        let other = TraceId {
            checksum: "00000000".into(),
            ..trace()
        };
        let keys = [
            point_key(&trace(), &config),
            point_key(&other, &config),
            point_key(&trace(), &RunConfig { seed: 2, ..config }),
        ];
        assert!(keys[0] != keys[1] && keys[0] != keys[2] && keys[1] != keys[2]);
        assert_eq!(keys[0], point_key(&trace(), &config));
    }
}
