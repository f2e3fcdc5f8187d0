//! `mbd`: checks, counts, generates, evaluates and simulates models of mechanisms.

fn main() -> std::process::ExitCode {
    mbd_cli::main()
}
