//! Prints the final state of the scene named by the argument, as bits, one number a line.

use scenes::Bits;

fn main() {
    let wanted = std::env::args().nth(1).unwrap_or_default();
    let mut known = Vec::new();
    macro_rules! scene {
        ($name:ident, $system:ty, $method:path) => {
            known.push(stringify!($name));
            if wanted == stringify!($name) {
                match scenes::run(&mut <$system>::new(), $method) {
                    Ok((q, p)) => q.iter().chain(&p).for_each(|x| println!("state {:016x}", x.bits())),
                    Err(step) => fail(&format!("{wanted}: the state is unusable after step {step}")),
                }
                return;
            }
        };
    }
    scenes::each_scene!(scene);
    fail(&format!("no scene `{wanted}`; there are: {}", known.join(", ")));
}

fn fail(message: &str) {
    eprintln!("twin: {message}");
    std::process::exit(1);
}
