multibody::mbd_model! { path = "models/broken.urdf", name = Arm, base = floating }

fn main() {}
