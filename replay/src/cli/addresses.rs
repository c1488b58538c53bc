//! `replay run --addresses`: replays plain addresses of any program through the caches.

use super::ConfigArgs;
use super::experiment_args::parse_caches;
use super::outputs::Outputs;
use crate::files::check_outputs;
use anyhow::{Result, bail, ensure};
use formats::interop::plain::{AccessKind, AddressFile, AddressForm};
use report::addresses::AddressesReport;
use sim::addresses::{self, KindSet};
use sim::config::{RunConfig, SetIndex};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

/// Forms of address files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum FormName {
    /// Read addresses, 32 bits, little-endian
    U32,
    /// Read addresses, 64 bits, little-endian
    U64,
    /// Text of Dinero, `LABEL HEXADDR` per line, or of Dinero IV, with sizes
    Din,
    /// Packet trace of gem5
    Gem5,
}

/// Kinds of accesses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum KindName {
    /// Data reads (din label 0)
    Read,
    /// Data writes (din label 1); they look up and fill like reads
    Write,
    /// Instruction fetches (label 2)
    Fetch,
}

/// Plain addresses as input instead of a trace.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Plain addresses")]
pub(super) struct AddressInput {
    /// File with plain addresses instead of a trace, uncompressed, gzip or zstd; - is standard input
    #[arg(long, value_name = "FILE")]
    addresses: Option<PathBuf>,
    /// Form of the addresses [default: from the name (.u32, .u64, .din, .gem5) or the content]
    #[arg(long, value_name = "FORM", hide_short_help = true)]
    address_form: Option<FormName>,
    /// Kinds of accesses that the caches process [default: all]
    #[arg(
        long,
        value_name = "KINDS",
        value_delimiter = ',',
        hide_short_help = true
    )]
    kinds: Option<Vec<KindName>>,
}

impl AddressInput {
    /// The address file, if given.
    ///
    /// # Errors
    /// A flag that needs `--addresses` without it, or a flag of `machine` that cannot be used with it.
    /// (Clap does not check an argument that conflicts with the trace.)
    pub fn path(&self, machine: &ConfigArgs) -> Result<Option<&Path>> {
        let Some(path) = &self.addresses else {
            let flags = [
                ("--address-form", self.address_form.is_some()),
                ("--kinds", self.kinds.is_some()),
            ];
            only_with_addresses(&flags)?;
            return Ok(None);
        };
        if let Some(flag) = machine.first_of_traces() {
            bail!(
                "{flag} cannot be used with --addresses: it applies only to traces with tiles and textures"
            );
        }
        Ok(Some(path))
    }

    /// The file of `--addresses`; `None` for standard input.
    pub fn file(&self) -> Option<&Path> {
        self.addresses
            .as_deref()
            .filter(|path| *path != Path::new("-"))
    }

    /// Opens the address file at `path`.
    ///
    /// # Errors
    /// The file cannot be read, or its form is unknown.
    pub fn open(&self, path: &Path) -> Result<AddressFile<'static>> {
        let form = self.address_form.map(|form| match form {
            FormName::U32 => AddressForm::U32,
            FormName::U64 => AddressForm::U64,
            FormName::Din => AddressForm::Din,
            FormName::Gem5 => AddressForm::Gem5,
        });
        Ok(AddressFile::open(path, form)?)
    }

    /// The kinds of accesses to process.
    pub fn kinds(&self) -> KindSet {
        let kind = |name: &KindName| match name {
            KindName::Read => AccessKind::Read,
            KindName::Write => AccessKind::Write,
            KindName::Fetch => AccessKind::Fetch,
        };
        self.kinds.as_ref().map_or(KindSet::ALL, |names| {
            KindSet::of(&names.iter().map(kind).collect::<Vec<_>>())
        })
    }
}

/// Fails if any of these flags is given.
fn only_with_addresses(flags: &[(&str, bool)]) -> Result<()> {
    match flags.iter().find(|(_, given)| *given) {
        Some((flag, _)) => bail!("{flag}: only with --addresses"),
        None => Ok(()),
    }
}

/// Fails if the configuration has more than an L1 and an L2, because `place` cannot simulate it.
///
/// # Errors
/// The configuration has `[prefetch]`, `[[level]]`, `[dram]`, `[frame]`, sectors, a victim cache or an inclusion.
pub(super) fn two_levels_only(config: &RunConfig, place: &str) -> Result<()> {
    ensure!(
        !config.follows_l2_misses() && config.frame.is_none(),
        "{place}: expected an L1 and an L2 only, found [prefetch], [[level]], [dram], [frame] or l2.inclusion"
    );
    ensure!(
        [config.level.l1, config.level.l2].map(|cache| (
            cache.set_index,
            cache.sectors,
            cache.victim_lines
        )) == [(SetIndex::Modulo, 1, 0); 2],
        "{place}: expected caches of whole lines without victim caches, found sectors, victim_lines or set_index"
    );
    Ok(())
}

/// Display name of an address file.
pub fn name_of(path: &Path) -> String {
    let name = path.file_name().unwrap_or(path.as_os_str());
    name.to_string_lossy().into_owned()
}

/// Arguments of `replay run --addresses`.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Plain addresses")]
pub(super) struct AddressArgs {
    #[command(flatten)]
    input: AddressInput,
    /// L1/L2 sizes in KiB, comma-separated; LRU sizes are replayed in one pass
    #[arg(
        long,
        value_name = "L1/L2,...",
        conflicts_with_all = ["l1", "l2"],
        hide_short_help = true
    )]
    caches: Option<String>,
}

impl AddressArgs {
    /// The address file, if given.
    ///
    /// # Errors
    /// See [`AddressInput::path`].
    pub fn path(&self, machine: &ConfigArgs) -> Result<Option<&Path>> {
        let path = self.input.path(machine)?;
        if path.is_none() {
            only_with_addresses(&[("--caches", self.caches.is_some())])?;
        }
        Ok(path)
    }

    /// Replays the addresses at `path` and prints the cache statistics.
    ///
    /// # Errors
    /// Wrong cache sizes, unreadable input.
    pub fn run(&self, path: &Path, config: &RunConfig, outputs: &Outputs) -> Result<ExitCode> {
        let prints = check_outputs(&outputs.list::<AddressesReport>()?, self.input.file())?;
        let configs = self.configs(config)?;
        let kinds = self.input.kinds();
        let start = Instant::now();
        let file = self.input.open(path)?;
        let read_as = match file.compression() {
            None => file.form().name().to_owned(),
            Some(compression) => format!("{} in {}", file.form().name(), compression.name()),
        };
        let outcome = addresses::replay(file, &configs, kinds)?;
        let seconds = start.elapsed().as_secs_f64();
        let accesses: u64 = outcome.totals.accesses.iter().sum();
        shell::note(&format!(
            "{:.1} M accesses/s ({accesses} accesses in {seconds:.3} s, read as {read_as})",
            accesses as f64 / seconds / 1e6,
        ));
        let report = AddressesReport {
            input: &name_of(path),
            outcome: &outcome,
        };
        outputs.write(&report, prints)?;
        Ok(ExitCode::SUCCESS)
    }

    fn configs(&self, config: &RunConfig) -> Result<Vec<RunConfig>> {
        let Some(caches) = &self.caches else {
            return Ok(vec![*config]);
        };
        let mut configs = Vec::new();
        for (l1, l2) in parse_caches(caches)? {
            let mut config = *config;
            config.level.l1.size_bytes = l1;
            config.level.l2.size_bytes = l2;
            config.validate()?;
            configs.push(config);
        }
        Ok(configs)
    }
}
