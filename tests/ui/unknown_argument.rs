//! The rest is understood: no error about what is missing, and none at the uses.
multibody::mbd_model! { pth = "models/double_pendulum.toml", name = First }
multibody::mbd_model! { path = "models/double_pendulum.toml", name = Second, colour = red, scaler = f32 }

fn main() {
    let _ = (First::new(), Second::new().tau[Second::V_ELBOW]);
}
