//! `replay`: trace to answer.

fn main() -> std::process::ExitCode {
    replay::cli::main()
}
