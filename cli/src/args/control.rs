//! Arguments of motion under control.

use std::path::PathBuf;

use clap::{ArgGroup, Args, ValueEnum};

use super::values::finite;

/// Heading of these arguments in the help. Each of them names it: `next_help_heading` would stay with the arguments of the
/// command that follow them.
const HEADING: &str = "Control";

/// What moves the joints.
#[derive(Args, Default)]
#[command(group(ArgGroup::new("tables").multiple(true)))]
pub struct ControlArgs {
    /// Joint forces over time, N m or N: a CSV table with a column `t` (s) and columns with names of velocities, as the
    /// table that this command writes has them with `tau.` in front
    #[arg(long, help_heading = HEADING, value_name = "FILE", group = "tables")]
    pub efforts: Option<PathBuf>,
    /// Positions over time that --kp and --kd follow, rad or m: a CSV table with a column `t` (s) and columns with names of
    /// joints; columns with `v.` in front are velocities. Joints that are not named stay where they start
    #[arg(long, help_heading = HEADING, value_name = "FILE", group = "tables")]
    pub set_points: Option<PathBuf>,
    /// External wrenches over time, N and N m: a CSV table with a column `t` (s) and columns NAME.fx, .fy, .fz, .mx, .my, .mz
    /// for wrenches of the model or of --wrench
    #[arg(long = "wrenches", help_heading = HEADING, value_name = "FILE", group = "tables")]
    pub wrench_table: Option<PathBuf>,
    /// What tables are between their rows
    #[arg(long, help_heading = HEADING, value_enum, value_name = "HOW", default_value_t = Interpolation::Hold, requires = "tables")]
    pub interpolation: Interpolation,
    /// Joint forces for each radian or metre from the set-point, N m/rad or N/m: one number for all joints, or
    /// JOINT=NUMBER, separated by commas. Without --set-points, joints are held where they start
    #[arg(long, help_heading = HEADING, value_name = "LIST", value_delimiter = ',', allow_hyphen_values = true, value_parser = gain)]
    pub kp: Vec<Gain>,
    /// Joint forces against velocities that differ from those of the set-points, N m s/rad or N s/m, like --kp
    #[arg(long, help_heading = HEADING, value_name = "LIST", value_delimiter = ',', allow_hyphen_values = true, value_parser = gain)]
    pub kd: Vec<Gain>,
    /// Add the joint forces that hold the mechanism at rest in its position
    #[arg(long, help_heading = HEADING)]
    pub gravity_compensation: bool,
    /// Joints on which --kp, --kd and --gravity-compensation act, separated by commas [default: all but spherical, planar and
    /// floating ones]
    #[arg(long, help_heading = HEADING, value_name = "LIST", value_delimiter = ',')]
    pub actuated: Vec<String>,
    /// Let joint forces exceed the efforts that the model allows
    #[arg(long, help_heading = HEADING)]
    pub unlimited: bool,
}

impl ControlArgs {
    /// Whether anything is asked for.
    pub fn any(&self) -> bool {
        let tables = [&self.efforts, &self.set_points, &self.wrench_table];
        let gains = [&self.kp, &self.kd];
        self.gravity_compensation
            || tables.iter().any(|table| table.is_some())
            || gains.iter().any(|gains| !gains.is_empty())
    }
}

/// What a table is between its rows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Interpolation {
    /// What it was in the row before: a zero-order hold
    #[default]
    Hold,
    /// A straight line from one row to the next
    Linear,
}

/// A gain of one joint, or of all.
#[derive(Clone, Debug)]
pub struct Gain {
    /// The joint.
    pub name: Option<String>,
    /// The gain.
    pub value: f64,
}

/// Parses `NUMBER` or `JOINT=NUMBER`.
fn gain(text: &str) -> Result<Gain, String> {
    let (name, number) = match text.rsplit_once('=') {
        Some((name, number)) => (Some(name.trim().to_string()), number),
        None => (None, text),
    };
    let value = finite(number)?;
    if value < 0.0 {
        return Err("a gain is not negative".to_string());
    }
    Ok(Gain { name, value })
}
