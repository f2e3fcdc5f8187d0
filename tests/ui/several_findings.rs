//! Everything wrong with a file, at once.
multibody::mbd_model! {
    path = "models/several.toml",
    name = Arm,
}

fn main() {
    let _ = Arm::default();
}
