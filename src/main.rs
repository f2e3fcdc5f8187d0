//! `mbd`: checks, counts, generates, evaluates and simulates models of mechanisms.

mod cli;

fn main() -> std::process::ExitCode {
    cli::main()
}
