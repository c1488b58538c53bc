//! `tracegen`: scene to trace.

/// Running out of memory is reported and ends with exit code 2.
#[global_allocator]
static ALLOCATOR: shell::Allocator = shell::Allocator;

fn main() -> std::process::ExitCode {
    tracegen::cli::main()
}
