//! Every argument with a value it cannot have, in one call.
multibody::mbd_model! {
    path = "models/double_pendulum.toml",
    name = pub 3,
    scalar = f16,
    base = flaoting,
    efforts = maybe,
    snap = -1e-6,
    gravity = [0.0, 9.81],
    frames = [3],
}
multibody::mbd_model! {
    path = "models/double_pendulum.toml",
    name = Arm,
    gravity = [0.0, -g, 1.0],
    snap,
    = 3,
    path = "models/ur5.urdf",
}

fn main() {}
