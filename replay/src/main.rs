//! `replay`: trace to answer.

/// Memory that ends is told with exit code 2.
#[global_allocator]
static ALLOCATOR: shell::Allocator = shell::Allocator;

fn main() -> std::process::ExitCode {
    replay::cli::main()
}
