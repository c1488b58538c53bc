//! The `replay` program.

/// Reports an exhausted memory and exits with code 2.
#[global_allocator]
static ALLOCATOR: shell::Allocator = shell::Allocator;

fn main() -> std::process::ExitCode {
    replay::cli::main()
}
