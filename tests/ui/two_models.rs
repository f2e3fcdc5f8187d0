multibody::mbd_model! { path = "models/double_pendulum.toml", toml = "", name = Arm }

fn main() {}
