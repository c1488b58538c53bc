//! `tracegen`: scene to trace.

/// Reports exhausted memory with exit code 2.
#[global_allocator]
static ALLOCATOR: shell::Allocator = shell::Allocator;

fn main() -> std::process::ExitCode {
    tracegen::cli::main()
}
