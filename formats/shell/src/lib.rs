//! Command-line behaviour that the programs share: exit codes, messages, progress, checks of outputs,
//! signals, threads, completions and manual pages, and distribution over many machines.

mod arguments;
mod children;
mod documents;
mod memory;
mod message;
mod outputs;
mod program;
mod progress;
mod settings;
mod shards;
mod signals;
mod slurm;

pub use arguments::{Threads, lasting_arguments};
pub use children::{Ended, run_child, run_child_until};
pub use documents::Documents;
pub use formats::container::is_stdout;
pub use memory::Allocator;
pub use message::{error, note, print, stdout, warn};
pub use outputs::{Output, check_folder, check_outputs};
pub use program::{Common, VERSION, described, run};
pub use progress::Progress;
pub use settings::read_settings;
pub use shards::{MOST_SHARDS, Piece, Shard, ShardArgs, balanced};
pub use slurm::{Needs, SlurmArray, absolute, quoted};
