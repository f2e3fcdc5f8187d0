multibody::mbd_model! { path = "models/double_pendulum.toml", name = Arm, frames = [tipp, "left-foot", upper] }

fn main() {
    let _ = Arm::FRAME_UPPER;
}
