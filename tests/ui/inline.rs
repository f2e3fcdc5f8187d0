multibody::mbd_model! {
    toml = r#"
        [[body]]
        name = "a"
        mas = 1
    "#,
    name = Arm,
}

fn main() {}
