//! Only the generator sees that a parameter leaves a freedom without inertia.
multibody::mbd_model! {
    toml = r#"
        [params]
        load = 1.0
        [[body]]
        name = "bob"
        mass = { param = "load" }
        com = [0, 0, -1]
        [[joint]]
        name = "pivot"
        type = "spherical"
        child = "bob"
    "#,
    name = Bob,
}

fn main() {}
