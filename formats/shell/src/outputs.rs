//! Checks a command's outputs before its work, which may take minutes.

use anyhow::{Context, bail, ensure};
use formats::container::{
    AtomicFile, check_target, declare_input, is_same_file, is_stdout, kind_of,
};
use std::fs;
use std::io::{self, IsTerminal};
use std::path::{Path, PathBuf};

/// A file that a command will write.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Output {
    flag: &'static str,
    path: PathBuf,
    kind: Kind,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Text,
    Binary,
    /// The command's own result, on stdout.
    Result,
}

impl Output {
    /// Text output, named by a flag.
    pub fn text(flag: &'static str, path: &Path) -> Self {
        Self::new(flag, path, Kind::Text)
    }

    /// A trace or picture, named by a flag.
    pub fn binary(flag: &'static str, path: &Path) -> Self {
        Self::new(flag, path, Kind::Binary)
    }

    /// The command's result in another form, selected by a flag such as `--json`.
    pub fn result(flag: &'static str) -> Self {
        Self::new(flag, Path::new("-"), Kind::Result)
    }

    fn new(flag: &'static str, path: &Path, kind: Kind) -> Self {
        let path = path.to_owned();
        Self { flag, path, kind }
    }

    /// Path of the output.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The flag that names it.
    pub fn flag(&self) -> &'static str {
        self.flag
    }

    fn named(&self) -> String {
        match self.kind {
            Kind::Result => self.flag.to_owned(),
            _ => format!("{} {}", self.flag, self.path.display()),
        }
    }
}

/// Declares inputs of the command, and checks that every output can be written and that none replaces an
/// input or another output. Returns whether stdout is free for the command's own result.
///
/// # Errors
/// The first output that fails a check.
pub fn check_outputs<'a>(
    outputs: &[Output],
    inputs: impl IntoIterator<Item = &'a Path>,
) -> anyhow::Result<bool> {
    for input in inputs {
        declare_input(input);
    }
    for (number, output) in outputs.iter().enumerate() {
        if is_stdout(&output.path) {
            let on_terminal = output.kind == Kind::Binary && io::stdout().is_terminal();
            ensure!(
                !on_terminal,
                "{}: binary output: name a file, or redirect standard output",
                output.named()
            );
        } else {
            check_target(&output.path).with_context(|| cannot_write(&output.path))?;
        }
        let earlier = &outputs[..number];
        if let Some(other) = earlier.iter().find(|o| is_same_file(&o.path, &output.path)) {
            bail!(
                "{} and {}: the same output twice",
                other.named(),
                output.named()
            );
        }
    }
    let taken = |o: &Output| o.kind != Kind::Result && is_stdout(&o.path);
    Ok(!outputs.iter().any(taken))
}

/// What could not be done, for the context of an error.
pub fn cannot_write(path: &Path) -> String {
    format!("cannot write {}", path.display())
}

/// Writes a file, which appears under its name when it is complete.
///
/// # Errors
/// The file cannot be written.
pub fn write_file(path: &Path, bytes: impl AsRef<[u8]>) -> anyhow::Result<()> {
    AtomicFile::write_whole(path, bytes.as_ref()).with_context(|| cannot_write(path))
}

/// Checks that a folder for outputs exists or can be created.
///
/// # Errors
/// The name of standard output, or a path to something other than a folder.
pub fn check_folder(flag: &str, path: &Path) -> anyhow::Result<()> {
    ensure!(
        !is_stdout(path),
        "{flag} -: expected a folder, found the name of standard output (a folder of that name is ./-)"
    );
    if let Ok(found) = fs::metadata(path) {
        ensure!(
            found.is_dir(),
            "cannot write {flag} {}: expected a folder, found {}",
            path.display(),
            kind_of(&found)
        );
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(outputs: &[Output], inputs: &[&Path]) -> String {
        let error = check_outputs(outputs, inputs.iter().copied()).unwrap_err();
        format!("{error:#}")
    }

    #[test]
    fn an_output_over_an_input_is_refused_by_any_of_its_names() {
        let folder = tempfile::tempdir().unwrap();
        let input = folder.path().join("a");
        fs::write(&input, "").unwrap();
        let other = folder.path().join("b");
        fs::hard_link(&input, &other).unwrap();
        let dotted = folder.path().join("./a");
        for name in [&input, &other, &dotted] {
            let text = refused(&[Output::text("--csv", name)], &[&input]);
            assert!(text.contains("would replace the input"), "{text}");
        }
        let new = folder.path().join("new");
        check_outputs(&[Output::text("--csv", &new)], [input.as_path()]).unwrap();
        // A file name equal to a built-in scene's name is not an input.
        check_outputs(&[Output::text("--csv", &new)], [new.as_path()]).unwrap();
    }

    #[test]
    fn two_outputs_with_the_same_name_are_refused_before_either_exists() {
        let folder = tempfile::tempdir().unwrap();
        let plain = folder.path().join("x.png");
        let dotted = folder.path().join("./x.png");
        let pair = [
            Output::binary("--output", &plain),
            Output::binary("--image", &dotted),
        ];
        assert!(refused(&pair, &[]).contains("the same output twice"));
        let stdout = Path::new("-");
        let pair = [
            Output::text("--csv", stdout),
            Output::text("--html", stdout),
        ];
        assert_eq!(
            refused(&pair, &[]),
            "--csv - and --html -: the same output twice"
        );
        assert!(!plain.exists());
        let pair = [Output::result("--json"), Output::text("--csv", stdout)];
        assert_eq!(
            refused(&pair, &[]),
            "--json and --csv -: the same output twice"
        );
    }

    #[test]
    fn an_output_on_stdout_replaces_the_result() {
        let is_left = |output| check_outputs(&[output], []).unwrap();
        assert!(is_left(Output::result("--json")));
        assert!(!is_left(Output::text("--csv", Path::new("-"))));
    }
}
