//! Checks a program's table of file arguments against its command line, for the programs' tests.

use super::files::{FileUse, FileUses, check, use_of};
use clap::{Arg, Command};
use formats::container::ScratchFolder;
use std::any::TypeId;
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};

/// Checks a program's command line: that it is well formed, and that no output replaces an input.
///
/// # Panics
/// If it is not.
pub fn assert_command_line(command: &Command, uses: &FileUses) {
    command.clone().debug_assert();
    let pairs = check_file_table(command, uses).expect("a whole table");
    assert!(pairs > 20, "{pairs} pairs of an input and an output");
}

/// Checks that the table has every argument that may name a file and no other, and that every output of every
/// command is refused over every input. Returns the number of these pairs.
///
/// # Errors
/// An argument that the table lacks, a row without an argument, or an output that is not refused.
fn check_file_table(command: &Command, uses: &FileUses) -> anyhow::Result<usize> {
    // Requirements and conflicts of arguments do not matter here.
    let mut command = command.clone().ignore_errors(true);
    command.build();
    check_rows(&command, uses)?;
    let mut pairs = 0;
    for of in command.get_subcommands() {
        pairs += check_pairs(&command, of, uses)?;
    }
    Ok(pairs)
}

/// Every row names arguments that exist.
fn check_rows(command: &Command, uses: &FileUses) -> anyhow::Result<()> {
    for (names, arguments, _) in uses {
        for argument in *arguments {
            let has = |of: &&Command| of.get_arguments().any(|a| a.get_id() == *argument);
            let having = command.get_subcommands().filter(has);
            let having: Vec<&str> = having.map(Command::get_name).collect();
            let without = names.iter().find(|name| !having.contains(name));
            anyhow::ensure!(
                without.is_none() && !having.is_empty(),
                "{names:?} {argument}: there is no such argument"
            );
        }
    }
    Ok(())
}

/// Every file argument of a command is in the table, and every output is refused over every input.
fn check_pairs(command: &Command, of: &Command, uses: &FileUses) -> anyhow::Result<usize> {
    let name = of.get_name();
    let (mut inputs, mut outputs) = (Vec::new(), Vec::new());
    for argument in of.get_arguments().filter(|argument| may_be_file(argument)) {
        let id = argument.get_id().as_str();
        match use_of(uses, name, id) {
            Some(FileUse::Input | FileUse::NamedInput | FileUse::Program) => inputs.push(argument),
            Some(used @ (FileUse::Output | FileUse::FolderOfNewNames)) => {
                outputs.push((argument, used));
            }
            Some(FileUse::InputFolder | FileUse::Folder | FileUse::NoFile) => {}
            None => anyhow::bail!("{name} {id}: not in the table of file arguments"),
        }
    }
    for input in &inputs {
        for (output, used) in &outputs {
            let folder = ScratchFolder::create_in(&std::env::temp_dir())?;
            // Some arguments take files of certain kinds only, all of them this one.
            let file = folder.path().join("file.csv");
            fs::write(&file, "kept")?;
            let target = match used {
                FileUse::Output => file.as_path(),
                _ => folder.path(),
            };
            let mut line = vec![OsString::from("program"), OsString::from(name)];
            line.extend(written(output, target));
            line.extend(written(input, &file));
            let refused = check(uses, &command.clone().try_get_matches_from(&line)?).is_err();
            anyhow::ensure!(refused, "{line:?}: not refused");
        }
    }
    Ok(inputs.len() * outputs.len())
}

/// Whether an argument's value may name a file.
fn may_be_file(argument: &Arg) -> bool {
    let kind = argument.get_value_parser().type_id();
    let is_text = [
        TypeId::of::<PathBuf>(),
        TypeId::of::<OsString>(),
        TypeId::of::<String>(),
    ]
    .iter()
    .any(|of| kind == *of);
    let names = argument.get_value_names().unwrap_or_default();
    let says_file = |name: &str| {
        ["FILE", "FOLDER", "DIR"]
            .iter()
            .any(|word| name.contains(word))
    };
    argument.get_action().takes_values()
        && argument.get_possible_values().is_empty()
        && (is_text || names.iter().any(|name| says_file(name)))
}

/// An argument with a path as its value.
fn written(argument: &Arg, path: &Path) -> Vec<OsString> {
    match argument.get_long() {
        Some(long) => {
            let mut word = OsString::from(format!("--{long}="));
            word.push(path);
            vec![word]
        }
        None if argument.is_last_set() => vec!["--".into(), path.into()],
        None => vec![path.into()],
    }
}
