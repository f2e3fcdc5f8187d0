const PATH: &str = "models/double_pendulum.toml";
multibody::mbd_model! { path = PATH, name = First }
multibody::mbd_model! { path = concat!("models/", "double_pendulum.toml"), name = Second }
multibody::mbd_model! { toml = b"", name = Third }

fn main() {
    let _ = (PATH, First::new(), Second::new(), Third::new());
}
