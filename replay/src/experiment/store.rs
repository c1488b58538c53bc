//! One file a point, so that a sweep that was cut off goes on where it stopped.

use crate::config::RunConfig;
use crate::files::write_atomically;
use crate::model_version::MODEL_VERSION;
use crate::result::{RunResult, TOOL, TraceId};
use formats::container::kind_of;
use serde::{Deserialize, Serialize};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Schema of a stored point.
pub const POINT_SCHEMA: &str = "replay.point/1";

/// A point's file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StoredPoint {
    /// `replay.point/1`.
    pub schema: String,
    /// Program and version.
    pub tool: String,
    /// Version of the models; another version's results are not taken over.
    pub model_version: u32,
    /// Trace.
    pub trace: TraceId,
    /// The whole configuration.
    pub config: RunConfig,
    /// Result.
    pub result: RunResult,
}

/// Larger than any point, counts by tile included.
const LARGEST_POINT_BYTES: u64 = 1 << 29;

/// Writing a point takes milliseconds: an unfinished file as old as this has no writer.
const ABANDONED_AFTER: Duration = Duration::from_secs(600);

/// Why a point's result cannot be taken from its file.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Absent {
    /// There is no file.
    #[error("missing")]
    Missing,
    /// It cannot be read, or holds something else.
    #[error("damaged: {0}")]
    Damaged(String),
    /// Another version made it.
    #[error(
        "expected {POINT_SCHEMA} of model version {MODEL_VERSION}, found {schema} of {model_version}"
    )]
    Foreign {
        /// Version of the models.
        model_version: u32,
        /// Schema.
        schema: String,
    },
}

/// The points under one folder.
#[derive(Clone, Debug)]
pub struct Store {
    folder: PathBuf,
}

/// Name of a point: a 128-bit FNV-1a hash of the model version, the trace's checksum and the whole
/// configuration.
///
/// The file repeats both, so that a collision costs a run and never gives a wrong result.
#[must_use]
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

/// Reads a point's file, which is looked at before: a pipe would be waited for, and what is larger than any
/// point would fill the memory.
fn read_whole(path: &Path) -> io::Result<Vec<u8>> {
    let found = std::fs::metadata(path)?;
    let refused = |what: String| Err(io::Error::other(what));
    if !found.is_file() {
        return refused(format!("expected a file, found {}", kind_of(&found)));
    }
    if found.len() > LARGEST_POINT_BYTES {
        let length = found.len();
        return refused(format!(
            "expected at most {LARGEST_POINT_BYTES} bytes, found {length}"
        ));
    }
    std::fs::read(path)
}

impl Store {
    /// The points of the sweep whose outputs lie in `folder`.
    #[must_use]
    pub fn new(folder: &Path) -> Self {
        Self {
            folder: folder.join("points"),
        }
    }

    /// Where the points' files lie.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The file of a point.
    #[must_use]
    pub fn path(&self, trace: &TraceId, config: &RunConfig) -> PathBuf {
        self.folder
            .join(point_key(trace, config))
            .with_extension("json")
    }

    /// A point's result, if it was computed before.
    ///
    /// # Errors
    /// Why its file cannot be taken: there is none, or it is damaged or foreign.
    pub fn find(&self, trace: &TraceId, config: &RunConfig) -> Result<RunResult, Absent> {
        /// What every version's files have.
        #[derive(Deserialize)]
        struct Header {
            schema: String,
            #[serde(default)]
            model_version: u32,
        }
        let bytes = read_whole(&self.path(trace, config)).map_err(|error| match error.kind() {
            ErrorKind::NotFound => Absent::Missing,
            _ => Absent::Damaged(error.to_string()),
        })?;
        let damaged = |error: serde_json::Error| Absent::Damaged(error.to_string());
        let header: Header = serde_json::from_slice(&bytes).map_err(damaged)?;
        if header.model_version != MODEL_VERSION || header.schema != POINT_SCHEMA {
            let Header {
                schema,
                model_version,
            } = header;
            return Err(Absent::Foreign {
                schema,
                model_version,
            });
        }
        let point: StoredPoint = serde_json::from_slice(&bytes).map_err(damaged)?;
        if point.trace.checksum != trace.checksum || point.config != *config {
            return Err(Absent::Damaged("holds another point".to_owned()));
        }
        Ok(point.result)
    }

    /// Removes what killed processes left behind; what others are writing now stays.
    pub fn tidy(&self) {
        // Nobody reads those files, so what cannot be removed does no harm.
        let _left = formats::container::remove_abandoned(&self.folder, ABANDONED_AFTER);
    }

    /// Keeps a point's result and returns it as it will be read back, so that a first run and a
    /// resumed one print the same digits.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn save(
        &self,
        trace: &TraceId,
        config: &RunConfig,
        result: &RunResult,
    ) -> anyhow::Result<RunResult> {
        let point = StoredPoint {
            schema: POINT_SCHEMA.to_owned(),
            tool: TOOL.to_owned(),
            model_version: MODEL_VERSION,
            trace: trace.clone(),
            config: *config,
            result: result.clone(),
        };
        let mut json = serde_json::to_vec(&point)?;
        json.push(b'\n');
        write_atomically(&self.path(trace, config), &json)?;
        Ok(serde_json::from_slice::<StoredPoint>(&json)?.result)
    }
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

    #[test]
    fn a_kept_point_comes_back() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::new(folder.path());
        let config = RunConfig::default();
        let result = RunResult {
            footprints: 7,
            access_hash: "ab".into(),
            ..RunResult::default()
        };
        assert_eq!(store.find(&trace(), &config), Err(Absent::Missing));
        store.save(&trace(), &config, &result).unwrap();
        assert_eq!(store.find(&trace(), &config), Ok(result));
        let other = RunConfig { seed: 2, ..config };
        assert_eq!(store.find(&trace(), &other), Err(Absent::Missing));
    }

    #[test]
    fn what_is_no_point_is_not_taken_and_says_why() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::new(folder.path());
        let config = RunConfig::default();
        store
            .save(&trace(), &config, &RunResult::default())
            .unwrap();
        let path = store.path(&trace(), &config);
        let bytes = std::fs::read(&path).unwrap();
        std::fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
        let found = store.find(&trace(), &config).unwrap_err().to_string();
        assert!(found.starts_with("damaged: EOF"), "{found}");
        // A file under another point's name, and one of a version that may have other fields.
        let other = RunConfig { seed: 2, ..config };
        std::fs::write(store.path(&trace(), &other), &bytes).unwrap();
        let found = store.find(&trace(), &other).unwrap_err().to_string();
        assert_eq!(found, "damaged: holds another point");
        std::fs::write(
            &path,
            r#"{"schema":"replay.point/0","tool":"replay 0.0.1","model_version":0}"#,
        )
        .unwrap();
        assert_eq!(
            store.find(&trace(), &config).unwrap_err().to_string(),
            format!(
                "expected replay.point/1 of model version {MODEL_VERSION}, found replay.point/0 of 0"
            )
        );
    }

    #[cfg(unix)]
    #[test]
    fn what_is_no_file_or_too_large_for_a_point_is_not_read() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::new(folder.path());
        let config = RunConfig::default();
        let path = store.path(&trace(), &config);
        let found = || store.find(&trace(), &config).unwrap_err().to_string();
        std::fs::create_dir_all(&path).unwrap();
        assert_eq!(found(), "damaged: expected a file, found a folder");
        std::fs::remove_dir(&path).unwrap();
        let made = std::process::Command::new("mkfifo").arg(&path).status();
        assert!(made.unwrap().success());
        assert_eq!(found(), "damaged: expected a file, found a pipe");
        std::fs::remove_file(&path).unwrap();
        let large = std::fs::File::create(&path).unwrap();
        large.set_len(LARGEST_POINT_BYTES + 1).unwrap();
        assert_eq!(
            found(),
            "damaged: expected at most 536870912 bytes, found 536870913"
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
