multibody::mbd_model! { path = "no/such/arm.toml", name = Arm }

fn main() {}
