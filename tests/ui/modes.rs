multibody::mbd_model! { path = "../../models/double_pendulum.toml", name = None, modes = masked }
multibody::mbd_model! { path = "../../models/contacts/hopper.toml", name = Some, modes = ["open stuck open", "open"] }
multibody::mbd_model! { path = "../../models/contacts/hopper.toml", name = File, modes = recorded("missing.modes") }
multibody::mbd_model! { path = "../../models/contacts/hopper.toml", name = Word, modes = some }

fn main() {}
