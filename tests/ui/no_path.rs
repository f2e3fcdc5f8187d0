multibody::mbd_model! { name = Arm }

fn main() {
    let _ = Arm::new();
}
