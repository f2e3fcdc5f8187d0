multibody::mbd_model! { path = "models/syntax.toml", name = Arm }

fn main() {}
