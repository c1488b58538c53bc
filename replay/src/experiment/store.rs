//! One file a point, so that a sweep that was cut off goes on where it stopped.

use crate::config::RunConfig;
use crate::files::write_atomically;
use crate::result::{RunResult, TOOL, TraceId};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Schema of a stored point.
pub const POINT_SCHEMA: &str = "replay.point/1";

/// A point's file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StoredPoint {
    /// `replay.point/1`.
    pub schema: String,
    /// Program and version; another version's results are not taken over.
    pub tool: String,
    /// Trace.
    pub trace: TraceId,
    /// The whole configuration.
    pub config: RunConfig,
    /// Result.
    pub result: RunResult,
}

/// The points under one folder.
#[derive(Clone, Debug)]
pub struct Store {
    folder: PathBuf,
}

/// Name of a point: a 128-bit FNV-1a hash of the trace's checksum and the whole configuration.
///
/// The file repeats both, so that a collision costs a run and never gives a wrong result.
#[must_use]
pub fn point_key(trace: &TraceId, config: &RunConfig) -> String {
    const PRIME: u128 = 0x0000_0000_0100_0000_0000_0000_0000_013B;
    const BASIS: u128 = 0x6C62_272E_07BB_0142_62B8_2175_6295_C58D;
    let config = serde_json::to_string(config).unwrap_or_default();
    let hash = [trace.checksum.as_str(), "\n", &config]
        .iter()
        .flat_map(|part| part.bytes())
        .fold(BASIS, |hash, byte| {
            (hash ^ u128::from(byte)).wrapping_mul(PRIME)
        });
    format!("{hash:032x}")
}

impl Store {
    /// The points of the sweep whose outputs lie in `folder`.
    #[must_use]
    pub fn new(folder: &Path) -> Self {
        Self {
            folder: folder.join("points"),
        }
    }

    fn path(&self, trace: &TraceId, config: &RunConfig) -> PathBuf {
        self.folder
            .join(point_key(trace, config))
            .with_extension("json")
    }

    /// A point's result, if it was computed before; a damaged or foreign file counts as none.
    #[must_use]
    pub fn load(&self, trace: &TraceId, config: &RunConfig) -> Option<RunResult> {
        let bytes = std::fs::read(self.path(trace, config)).ok()?;
        let point: StoredPoint = serde_json::from_slice(&bytes).ok()?;
        let same = point.schema == POINT_SCHEMA
            && point.tool == TOOL
            && point.trace.checksum == trace.checksum
            && point.config == *config;
        same.then_some(point.result)
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
        assert_eq!(store.load(&trace(), &config), None);
        store.save(&trace(), &config, &result).unwrap();
        assert_eq!(store.load(&trace(), &config), Some(result));
        assert_eq!(store.load(&trace(), &RunConfig { seed: 2, ..config }), None);
    }

    #[test]
    fn a_cut_file_counts_as_none() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::new(folder.path());
        let config = RunConfig::default();
        store
            .save(&trace(), &config, &RunResult::default())
            .unwrap();
        let path = store.path(&trace(), &config);
        let bytes = std::fs::read(&path).unwrap();
        std::fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
        assert_eq!(store.load(&trace(), &config), None);
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
