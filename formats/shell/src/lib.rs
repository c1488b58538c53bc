//! Command-line behaviour that the programs share: exit codes, messages, progress, checks of outputs,
//! signals, threads, completions and manual pages, and distribution over many machines.

mod arguments;
mod children;
mod documents;
mod file_table;
mod files;
mod memory;
mod message;
mod outputs;
mod program;
mod progress;
mod settings;
mod shards;
mod signals;
mod slurm;
mod supervise;

pub use arguments::{Threads, WITHOUT_EFFECT, lasting_arguments};
pub use children::run_child;
pub use documents::Documents;
pub use file_table::assert_command_line;
pub use files::{FileUse, FileUses, find_program};
pub use formats::container::is_stdout;
pub use memory::Allocator;
pub use message::{error, has_warned, note, print, print_beside, stdout, warn};
pub use outputs::{Output, cannot_write, check_folder, check_outputs, write_file};
pub use program::{Common, VERSION, described, run};
pub use progress::Progress;
pub use settings::read_settings;
pub use shards::{MOST_SHARDS, Piece, Shard, ShardArgs, balanced};
pub use slurm::{Needs, SlurmArray, absolute, quoted};
pub use supervise::{Program, SuperviseArgs};
