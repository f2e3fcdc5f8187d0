multibody::mbd_model! { path = "models/double_pendulum.toml" }

fn main() {}
