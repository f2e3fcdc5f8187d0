multibody::mbd_model! { path = "models/double_pendulum.toml", name = First, outputs = [rates, enrgy] }
multibody::mbd_model! { path = "models/double_pendulum.toml", name = Second, outputs = [rates, snapshots, energy] }
multibody::mbd_model! { path = "models/double_pendulum.toml", name = Third, outputs = [rates, rates] }
multibody::mbd_model! { path = "models/double_pendulum.toml", name = Fourth, outputs = rates }

fn main() {
    let _ = First::new().energy(&[0.0; 2], &[0.0; 2]);
}
