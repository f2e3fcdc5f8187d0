//! Arguments of `mbd view`.

use std::path::PathBuf;

use clap::Args;

use super::values::{finite, positive};
use super::ImportArgs;

/// `mbd view`.
#[derive(Args)]
// Options of the readers have no part in an empty page.
#[command(
    mut_arg("base", |arg| arg.requires("model")),
    mut_arg("gravity", |arg| arg.requires("model")),
    after_help = "The page is one file without requests: it works without a network and without this program. It has the readers and the
generator in it, so that any other model can be dropped on it. Without MODEL and FILE, an empty page for models to be dropped on
is served to browsers of this machine, until Ctrl-C.

Examples:
  mbd view models/double_pendulum.toml                writes double_pendulum.html
  mbd view robot.urdf --base floating --floor 0       a robot that falls on a floor
  mbd view                                            serves an empty page at a free port of 127.0.0.1
  mbd view -o drop.html                               writes the empty page
  mbd view models/ur5.urdf --gltf ur5.glb --time 5    the motion of five seconds for other viewers"
)]
pub struct ViewArgs {
    /// Description of the mechanism, `.toml`, `.urdf` or `.xml`; without it the page is empty, and is served
    pub model: Option<PathBuf>,
    #[command(flatten)]
    pub import: ImportArgs,
    /// Put a floor at this height that the collision shapes of a URDF or the geoms of an MJCF model touch, m
    #[arg(long, value_name = "Z", allow_hyphen_values = true, value_parser = finite, requires = "model")]
    pub floor: Option<f64>,
    /// File to write; `-` for standard output [default: that of the model, with .html]
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Port of 127.0.0.1 at which the empty page is served; 0 is a free one
    #[arg(long, value_name = "PORT", default_value_t = 0, allow_negative_numbers = true, conflicts_with_all = ["model", "output"])]
    pub port: u16,
    /// Write the motion as glTF 2.0 for other viewers instead: `.gltf`, or `.glb` in binary form
    #[arg(long, value_name = "FILE", requires = "model", conflicts_with = "output")]
    pub gltf: Option<PathBuf>,
    /// Length of that motion, s
    #[arg(long, value_name = "S", default_value_t = 10.0, allow_negative_numbers = true, value_parser = positive, requires = "gltf")]
    pub time: f64,
}
