//! Writes output files atomically and creates their folders.

use anyhow::Context;
use formats::container::AtomicFile;
use shell::Output;
use std::path::Path;

/// Writes `bytes` to a temporary file in the same folder and renames it to `path`.
///
/// # Errors
/// The folder cannot be made, or the file cannot be written; the message names the path.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    make_folder(path)
        .and_then(|()| AtomicFile::write_whole(path, bytes))
        .with_context(|| format!("{}: cannot write", path.display()))
}

fn make_folder(path: &Path) -> std::io::Result<()> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty());
    folder.map_or(Ok(()), std::fs::create_dir_all)
}

/// Creates the folders of outputs and checks that each output can be written and replaces neither
/// an input nor another output. Returns whether standard output is free for the command's own
/// result.
///
/// # Errors
/// The first output that fails a check.
pub fn check_outputs<'a>(
    outputs: &[Output],
    inputs: impl IntoIterator<Item = &'a Path>,
) -> anyhow::Result<bool> {
    for output in outputs {
        let path = output.path();
        make_folder(path).map_err(|e| anyhow::anyhow!("{}: cannot write: {e}", path.display()))?;
    }
    shell::check_outputs(outputs, inputs)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_atomically_without_leaving_another_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("new/report.html");
        write_atomically(&path, b"one").unwrap();
        write_atomically(&path, b"two").unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"two");
        assert_eq!(
            std::fs::read_dir(path.parent().unwrap()).unwrap().count(),
            1
        );
    }

    #[test]
    fn the_error_for_a_folder_that_cannot_be_created_names_it() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        std::fs::write(&file, b"").unwrap();
        let error = write_atomically(&file.join("x.csv"), b"")
            .unwrap_err()
            .to_string();
        assert!(error.contains("file/x.csv: cannot write"), "{error}");
    }
}
