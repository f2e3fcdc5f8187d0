//! `mbd-lab`: experiments of the thesis and benches of the integrators.

fn main() -> std::process::ExitCode {
    mbd_lab::main()
}
