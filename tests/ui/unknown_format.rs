multibody::mbd_model! { path = "main.rs", name = Arm }

fn main() {}
