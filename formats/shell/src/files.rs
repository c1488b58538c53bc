//! The files that commands read and write: a table of arguments per program, and the check that no output
//! replaces an input.

use anyhow::bail;
use clap::ArgMatches;
use formats::container::{declare_input, input_in, is_stdout, replaced_input};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

/// What a command does with the value of an argument.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileUse {
    /// Reads a file. The value may have more around its name: `LABEL=FILE`, `FILE#PART`.
    Input,
    /// Reads a file if the value has an extension. Other values are names, such as those of built-in scenes.
    NamedInput,
    /// Runs a program; further values are its arguments, which may be files that it reads.
    Program,
    /// Reads a folder; the command itself declares what it reads in it.
    InputFolder,
    /// Writes a file.
    Output,
    /// Writes files into a folder under names that are known before the work.
    Folder,
    /// Writes files into a folder whose names follow from the work, so the folder may not hold an input.
    FolderOfNewNames,
    /// The value is not a file.
    NoFile,
}

/// Uses of the arguments of a program: names of subcommands (all, if empty), names of arguments, use. A row for
/// a subcommand comes before one for all.
pub type FileUses = [(&'static [&'static str], &'static [&'static str], FileUse)];

pub(crate) fn use_of(uses: &FileUses, command: &str, argument: &str) -> Option<FileUse> {
    let mut rows = uses.iter();
    let found = rows.find(|(commands, arguments, _)| {
        (commands.is_empty() || commands.contains(&command)) && arguments.contains(&argument)
    });
    found.map(|(_, _, of)| *of)
}

/// Declares the files that the arguments name as inputs, and refuses outputs that would replace one.
///
/// # Errors
/// An output that would replace an input.
pub(crate) fn check(uses: &FileUses, matches: &ArgMatches) -> anyhow::Result<()> {
    let Some((command, matches)) = matches.subcommand() else {
        return Ok(());
    };
    let mut outputs = Vec::new();
    for id in matches.ids() {
        let Some(of) = use_of(uses, command, id.as_str()) else {
            continue;
        };
        let values = matches.try_get_raw(id.as_str()).ok().flatten();
        for (number, value) in values.into_iter().flatten().enumerate() {
            match of {
                FileUse::NamedInput if Path::new(value).extension().is_none() => {}
                FileUse::Input | FileUse::NamedInput => declare_named(value),
                FileUse::Program if number == 0 => {
                    if let Some(program) = find_program(value) {
                        declare_input(&program);
                    }
                }
                FileUse::Program => declare_named(value),
                FileUse::Output | FileUse::FolderOfNewNames => {
                    outputs.push((id.as_str(), Path::new(value), of));
                }
                FileUse::InputFolder | FileUse::Folder | FileUse::NoFile => {}
            }
        }
    }
    for (id, path, of) in outputs.into_iter().filter(|(_, path, _)| !is_stdout(path)) {
        let output = format!("--{} {}", id.replace('_', "-"), path.display());
        if of == FileUse::Output
            && let Some(input) = replaced_input(path)
        {
            bail!("{output}: would replace the input {}", input.display());
        }
        if of == FileUse::FolderOfNewNames
            && let Some(input) = input_in(path)
        {
            bail!(
                "{output}: expected a folder without inputs, found {}, which could be replaced",
                input.display()
            );
        }
    }
    Ok(())
}

/// Declares the files that a value may name: all of it, the part after `=`, the part before `#`.
fn declare_named(value: &OsStr) {
    declare_input(Path::new(value));
    let Some(text) = value.to_str() else {
        return;
    };
    let parts = [
        text.split_once('=').map(|(_, file)| file),
        text.rsplit_once('#').map(|(file, _)| file),
    ];
    for part in parts.into_iter().flatten() {
        declare_input(Path::new(part));
    }
}

/// The file of a program: a path, or a name that is looked for in the folders of `PATH`.
pub fn find_program(name: &OsStr) -> Option<PathBuf> {
    let is_path = name.as_encoded_bytes().contains(&b'/');
    let folders = match std::env::var_os("PATH").filter(|_| !is_path) {
        Some(path) => std::env::split_paths(&path).collect(),
        None => vec![PathBuf::new()],
    };
    let mut files = folders.into_iter().map(|folder| folder.join(name));
    files.find(|file| file.is_file())
}
