multibody::mbd_model! { path = "models/double_pendulum.toml", name = Arm, base = floating }

fn main() {}
