//! Generates shell completions and manual pages from the definition of the command line.

use super::program;
use anyhow::Context;
use clap::{Command, CommandFactory, Subcommand};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Subcommands that document the program.
#[derive(Clone, Debug, Subcommand)]
pub enum Documents {
    /// Print a completion script for a shell.
    ///
    /// For bash: put it into ~/.local/share/bash-completion/completions/PROGRAM.
    Completions {
        /// The shell
        shell: clap_complete::Shell,
    },
    /// Write the manual pages, one per subcommand, into a folder.
    ///
    /// For `man`: a folder such as ~/.local/share/man/man1.
    Man {
        /// Folder; created if missing
        folder: PathBuf,
    },
}

impl Documents {
    /// Runs the subcommand for the program `C`.
    ///
    /// # Errors
    /// An output that cannot be written.
    pub fn run<C: CommandFactory>(self) -> anyhow::Result<ExitCode> {
        let mut command = program::command::<C>();
        command.build();
        match self {
            Self::Completions { shell } => {
                let name = command.get_name().to_owned();
                let mut script = Vec::new();
                clap_complete::generate(shell, &mut command, name, &mut script);
                let mut out = super::stdout();
                out.write_all(&script)?;
                out.flush()?;
            }
            Self::Man { folder } => {
                std::fs::create_dir_all(&folder)
                    .and_then(|()| write_pages(&command, &folder))
                    .with_context(|| format!("cannot write into {}", folder.display()))?;
            }
        }
        Ok(ExitCode::SUCCESS)
    }
}

fn write_pages(command: &Command, folder: &Path) -> std::io::Result<()> {
    let page = clap_mangen::Man::new(command.clone());
    let mut roff = Vec::new();
    page.render(&mut roff)?;
    formats::container::AtomicFile::write_whole(&folder.join(page.get_filename()), &roff)?;
    let shown = |s: &&Command| s.get_name() != "help" && !s.is_hide_set();
    for subcommand in command.get_subcommands().filter(shown) {
        write_pages(subcommand, folder)?;
    }
    Ok(())
}
