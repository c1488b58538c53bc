//! `tracegen`: scene to trace.

fn main() -> std::process::ExitCode {
    tracegen::cli::main()
}
