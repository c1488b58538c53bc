//! TOML files: configurations and experiments of `replay`, manifests of `tracegen sweep`.

use replay::config::RunConfig;
use replay::experiment::{ExperimentFile, MOST_POINTS};
use replay::sgrt::config::SgrtConfig;

/// Longer messages would repeat the file.
const LONGEST_MESSAGE: usize = 4096;

/// Reads a text as an experiment, as a configuration of replays and as one of the SGRT model.
pub fn run(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return;
    };
    match ExperimentFile::parse(text).and_then(|file| file.plan()) {
        Ok(plan) => {
            assert!(plan.points.len() <= MOST_POINTS);
            assert!(plan.points.iter().all(|p| p.config.validate().is_ok()));
        }
        Err(error) => {
            let length = error.to_string().len();
            assert!(length < LONGEST_MESSAGE, "a message of {length} bytes");
        }
    }
    if let Ok(config) = toml::from_str::<RunConfig>(text)
        && config.validate().is_ok()
    {
        let written = toml::to_string(&config).expect("a configuration is written");
        let again: RunConfig = toml::from_str(&written).expect("what was written is read");
        assert!(again == config, "{written}");
    }
    if let Ok(config) = SgrtConfig::from_overrides(text) {
        config.check().expect("it was checked");
    }
}

/// Reads a text as a manifest of captures.
pub fn manifest(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return;
    };
    let Ok(captures) = crate::captures::parse(text) else {
        return;
    };
    let mut files: Vec<&str> = captures.iter().map(|c| c.file.as_str()).collect();
    for capture in &captures {
        assert!(!capture.recipe().is_empty());
        let file = std::path::Path::new(&capture.file);
        let bare = file.components().count() == 1 && file.file_name().is_some();
        assert!(bare, "{} leaves the folder", capture.file);
    }
    files.sort_unstable();
    assert!(files.windows(2).all(|w| w[0] != w[1]), "a name twice");
}
