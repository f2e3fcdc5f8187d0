multibody::mbd_model! {}
multibody::mbd_model! { "models/double_pendulum.toml", Arm }

fn main() {}
