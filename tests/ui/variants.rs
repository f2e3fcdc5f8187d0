//! Variants that there are not, and types from which no state can be carried over.

mod model {
    multibody::mbd_model! { path = "models/gripper.toml", variant = "hold", name = NoVariant }
    multibody::mbd_model! { path = "models/gripper.toml", variant = held, name = NoText }
    multibody::mbd_model! { path = "models/gripper.toml", name = Whole }
    multibody::mbd_model! { path = "models/gripper.toml", variant = "held", name = Held, from = [Whole, "holding": Other] }
    multibody::mbd_model! { path = "models/gripper.toml", variant = "held", name = Wrong, from = ["held" = Held] }
    multibody::mbd_model! { path = "models/gripper.toml", variant = "welded", name = Welded, from = Whole }
}

fn main() {}
