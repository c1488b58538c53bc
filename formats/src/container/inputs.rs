//! Files that the running command reads, which no output replaces.

use super::atomic::{folder_of, is_stdout};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Paths of the declared inputs.
static INPUTS: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

fn inputs() -> MutexGuard<'static, Vec<PathBuf>> {
    INPUTS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Declares a file that the command reads. From then on no output replaces it, under any of its names. Names
/// without a file, such as those of built-in scenes, are ignored.
pub fn declare_input(path: &Path) {
    if let Ok(path) = std::path::absolute(path)
        && path.is_file()
    {
        let mut inputs = inputs();
        if !inputs.contains(&path) {
            inputs.push(path);
        }
    }
}

/// The declared inputs, by absolute path.
pub fn declared_inputs() -> Vec<PathBuf> {
    inputs().clone()
}

/// The declared input that an output would replace.
pub fn replaced_input(output: &Path) -> Option<PathBuf> {
    let inputs = inputs();
    let mut named = inputs.iter();
    named.find(|input| is_same_file(input, output)).cloned()
}

/// A declared input that lies in a folder.
pub fn input_in(folder: &Path) -> Option<PathBuf> {
    let folder = fs::canonicalize(folder).ok()?;
    let is_in = |path: &Path| path.parent() == Some(folder.as_path());
    let inputs = inputs();
    // A link in the folder is replaced by name, its target by content.
    let mut named = inputs.iter().filter(|input| {
        let by_name = input
            .parent()
            .and_then(|parent| fs::canonicalize(parent).ok());
        let target = fs::canonicalize(input);
        by_name.is_some_and(|parent| parent == folder) || target.is_ok_and(|path| is_in(&path))
    });
    named.next().cloned()
}

/// Whether two paths name the same file: by spelling, through links of either kind, or as names that do not
/// exist yet. Standard output is the same only as itself.
pub fn is_same_file(a: &Path, b: &Path) -> bool {
    match (is_stdout(a), is_stdout(b)) {
        (true, true) => true,
        (false, false) => {
            let (ids, paths) = ([a, b].map(file_id), [a, b].map(full_path));
            (ids[0].is_some() && ids[0] == ids[1]) || (paths[0].is_some() && paths[0] == paths[1])
        }
        _ => false,
    }
}

/// Device and inode.
fn file_id(path: &Path) -> Option<(u64, u64)> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        let found = fs::metadata(path).ok()?;
        Some((found.dev(), found.ino()))
    }
    #[cfg(not(unix))]
    {
        let _ = path;
        None
    }
}

fn full_path(path: &Path) -> Option<PathBuf> {
    let name = path.file_name()?;
    fs::canonicalize(path)
        .ok()
        .or_else(|| Some(fs::canonicalize(folder_of(path)).ok()?.join(name)))
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use crate::container::{AtomicFile, check_target};
    use std::io::Write;
    use std::os::unix::fs::symlink;

    #[test]
    fn a_declared_input_is_never_replaced_under_any_of_its_names() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::create_dir(at("sub")).unwrap();
        fs::write(at("input"), "kept").unwrap();
        fs::write(at("linked"), "kept").unwrap();
        symlink("linked", at("link")).unwrap();
        fs::hard_link(at("input"), at("hard")).unwrap();
        // An output that was started before the file was declared.
        let mut early = AtomicFile::create(&at("input")).unwrap();
        early.write_all(b"new").unwrap();
        for input in ["input", "link", "missing"] {
            declare_input(&at(input));
        }
        let refused = early.persist().unwrap_err().to_string();
        assert!(refused.contains("replace the input"), "{refused}");
        for output in ["input", "hard", "sub/../input", "linked"] {
            for refused in [
                check_target(&at(output)).unwrap_err(),
                AtomicFile::create(&at(output)).unwrap_err(),
            ] {
                let text = refused.to_string();
                assert!(text.contains("would replace the input"), "{output}: {text}");
            }
        }
        for name in ["input", "hard", "linked"] {
            assert_eq!(fs::read(at(name)).unwrap(), b"kept");
        }
        AtomicFile::write_whole(&at("missing"), b"new").unwrap();
        assert!(input_in(folder.path()).is_some() && input_in(&at("sub")).is_none());
    }
}
