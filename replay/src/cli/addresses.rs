//! `replay run --addresses`: the caches alone, fed with the addresses of any program.

use super::experiment_args::parse_caches;
use crate::addresses::{self, KindSet};
use crate::config::RunConfig;
use crate::report::addresses as report;
use anyhow::{Result, bail};
use formats::interop::plain::{AccessKind, AddressFile, AddressForm};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

/// Forms by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum FormName {
    /// 32-bit little-endian addresses of reads
    U32,
    /// 64-bit ones
    U64,
    /// Dinero's text, `LABEL HEXADDR` a line, or Dinero IV's with sizes
    Din,
    /// gem5's packet trace
    Gem5,
}

/// Kinds of access by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum KindName {
    /// Data reads (din label 0)
    Read,
    /// Data writes (label 1); they look up and fill as reads do
    Write,
    /// Instruction fetches (label 2)
    Fetch,
}

/// What has no meaning without tiles and a texture unit, or is not made for addresses.
const OF_TRACES: [&str; 24] = [
    "trace",
    "order",
    "mode",
    "cores",
    "assign",
    "hsr",
    "filter",
    "lod",
    "lod_bias",
    "helper_lanes",
    "texel_format",
    "block_order",
    "uncompressed_order",
    "base_align",
    "texture_order",
    "l1_penalty",
    "l2_penalty",
    "loop_cycles",
    "tmu_threads",
    "retry_footprints",
    "fetches_per_trip",
    "tiles",
    "compare_modes",
    "print_config",
];

/// Arguments of plain addresses.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Plain addresses")]
pub struct AddressArgs {
    /// Plain addresses in place of a trace, gzip or zstd or neither; - is standard input
    #[arg(long, value_name = "FILE", conflicts_with_all = OF_TRACES)]
    addresses: Option<PathBuf>,
    /// Form of the addresses [default: by name (.u32, .u64, .din, .gem5) or content]
    #[arg(long, value_name = "FORM")]
    address_form: Option<FormName>,
    /// Kinds of access that the caches see [default: all]
    #[arg(long, value_name = "KINDS", value_delimiter = ',')]
    kinds: Option<Vec<KindName>>,
    /// Several L1/L2 sizes in KiB, replayed in one pass if LRU
    #[arg(
        long,
        value_name = "L1/L2,...",
        conflicts_with_all = ["l1", "l2"]
    )]
    caches: Option<String>,
    /// Print CSV, a row a configuration
    #[arg(long, conflicts_with = "json")]
    csv: bool,
}

impl AddressArgs {
    /// Where the addresses are, if they were asked for.
    ///
    /// # Errors
    /// A flag that means nothing without addresses. (Clap does not ask for an argument that conflicts
    /// with the trace.)
    pub fn path(&self) -> Result<Option<&Path>> {
        let flags = [
            ("--address-form", self.address_form.is_some()),
            ("--kinds", self.kinds.is_some()),
            ("--caches", self.caches.is_some()),
            ("--csv", self.csv),
        ];
        let given = flags.into_iter().find(|(_, given)| *given);
        match (&self.addresses, given) {
            (None, Some((flag, _))) => bail!("{flag}: only with --addresses"),
            (path, _) => Ok(path.as_deref()),
        }
    }

    /// Replays the addresses at `path` and prints what the caches made of them.
    ///
    /// # Errors
    /// Wrong cache sizes, unreadable input.
    pub fn run(&self, path: &Path, config: &RunConfig, json: bool) -> Result<ExitCode> {
        let configs = self.configs(config)?;
        let form = self.address_form.map(|form| match form {
            FormName::U32 => AddressForm::U32,
            FormName::U64 => AddressForm::U64,
            FormName::Din => AddressForm::Din,
            FormName::Gem5 => AddressForm::Gem5,
        });
        let kind = |name: &KindName| match name {
            KindName::Read => AccessKind::Read,
            KindName::Write => AccessKind::Write,
            KindName::Fetch => AccessKind::Fetch,
        };
        let kinds = self.kinds.as_ref().map_or(KindSet::ALL, |names| {
            KindSet::of(&names.iter().map(kind).collect::<Vec<_>>())
        });
        let start = Instant::now();
        let file = AddressFile::open(path, form)?;
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
        let name = path
            .file_name()
            .unwrap_or(path.as_os_str())
            .to_string_lossy();
        super::print(&match (json, self.csv) {
            (true, _) => report::json(&name, &outcome)?,
            (_, true) => report::csv(&outcome),
            _ => report::text(&name, &outcome),
        })?;
        Ok(ExitCode::SUCCESS)
    }

    fn configs(&self, config: &RunConfig) -> Result<Vec<RunConfig>> {
        let Some(caches) = &self.caches else {
            return Ok(vec![*config]);
        };
        let mut configs = Vec::new();
        for (l1, l2) in parse_caches(caches)? {
            let mut config = *config;
            config.l1.size_bytes = l1;
            config.l2.size_bytes = l2;
            config.validate()?;
            configs.push(config);
        }
        Ok(configs)
    }
}
