multibody::mbd_model! { path = "unknown_format.rs", name = Arm }

fn main() {}
