//! Arguments of all commands, and their help.

mod control;
mod generate;
mod values;
mod view;

use std::path::PathBuf;

use clap::{ArgGroup, Args, Parser, Subcommand, ValueEnum};
use multibody::codegen::options::DEFAULT_SNAP;
use multibody::codegen::read::{Base, Floor, ImportOptions};
use multibody::runtime::constrained::Stabilisation;
use values::{choice, finite, methods, not_negative, one_of, positive, snap, vector, whole};

pub use control::{ControlArgs, Gain, Interpolation};
pub use generate::{CodeArgs, GenerateArgs, Language, DEFAULT_RUNTIME};
pub use values::{type_name, HOLD};
pub use view::ViewArgs;

const ABOUT: &str = "Symbolic code generator for multibody dynamics in Hamilton's canonical form.

A model (`.toml`, `.urdf` of a robot, or `.xml` of MuJoCo) describes rigid bodies, joints and constraints. Its state consists of the coordinates
q and the momenta p. mbd generates straight-line Rust that computes (q, p) -> (q', p') and other outputs on request; what the
model does not need costs nothing. An interpreter runs the same equations without generated code.

Without a command, mbd shows a tour with a real robot, which takes a few seconds and writes mbd-tour.svg.";

const EXAMPLES: &str = "Examples:
  mbd                                                 the tour
  mbd check robot.urdf                                is the file sound, and what is in it?
  mbd convert robot.urdf -o robot.toml                the robot in a format that can be added to
  mbd check humanoid.xml                              the same of a model of MuJoCo, an MJCF file
  mbd count robot.urdf --base floating                what does each sweep cost?
  mbd generate robot.urdf --outputs rates -o robot.rs straight-line Rust
  mbd generate robot.urdf --lang c -o robot.c         the same in C99, with robot.h
  mbd simulate models/double_pendulum.toml            ten seconds, as CSV and as a picture
  mbd view robot.urdf                                 a page for browsers in which it moves and can be pulled
  mbd eval robot.urdf --input states.json             numbers out, to compare with other programs
  mbd certify robot.urdf --box states.json            guaranteed bounds over a box of states
  mbd explain robot.urdf --after frames               intermediate results of the generator

Findings, notices and progress go to standard error, results to standard output.
Exit status: 0 done, 1 a finding or a failure, 2 wrong arguments.";

/// The command line.
#[derive(Parser)]
#[command(name = "mbd", version, about = "Symbolic code generator for multibody dynamics", long_about = ABOUT, after_help = EXAMPLES)]
pub struct Arguments {
    #[command(subcommand)]
    pub command: Option<Command>,
}

/// The command to run.
#[derive(Subcommand)]
pub enum Command {
    /// Read models, and report what is wrong with them or what they contain
    Check(CheckArgs),
    /// Convert a description, such as a URDF robot or a model of MuJoCo, to the TOML format, where it can be changed and added to
    Convert(ConvertArgs),
    /// Count the operations of every output, sweep by sweep
    Count(CountArgs),
    /// Generate Rust, C or WebAssembly
    Generate(GenerateArgs),
    /// Evaluate states from a JSON file with the interpreter
    Eval(EvalArgs),
    /// Bound outputs at a state or over a box of states, rounding errors included
    Certify(CertifyArgs),
    /// Simulate; write a CSV file and a plot
    Simulate(SimulateArgs),
    /// Write a page for browsers, in which the mechanism moves and can be pulled
    View(ViewArgs),
    /// Find the modes of the contacts that a motion visits, and what they cost
    Modes(ModesArgs),
    /// Show intermediate results of the generator
    Explain(ExplainArgs),
    /// Name the combinations of masses and inertias that a motion can identify
    Identifiable(IdentifiableArgs),
    /// Print completions for a shell or an editor, or the manual page
    Completions(CompletionsArgs),
}

/// Options of the readers.
#[derive(Args, Clone, Copy)]
pub struct ImportArgs {
    /// Connection of a URDF's root to the ground; TOML and MJCF models state it themselves
    #[arg(long, value_parser = choice!(Base), default_value = Base::default().name())]
    pub base: Base,
    /// Gravity in ground axes, m/s², in place of that of the file; a URDF has 0,0,-9.81
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = vector)]
    pub gravity: Option<[f64; 3]>,
}

impl ImportArgs {
    /// Options for the readers.
    pub fn import(&self) -> ImportOptions {
        ImportOptions { base: self.base, gravity: self.gravity, ..ImportOptions::default() }
    }
}

/// What a robot touches: options of the readers, for commands to which it makes a difference.
#[derive(Args, Clone, Copy)]
#[command(group(ArgGroup::new("touched").multiple(true)))]
pub struct TouchArgs {
    /// Make stops of the joint limits of a URDF or an MJCF model; a TOML model states them itself
    #[arg(long)]
    pub limits: bool,
    /// Put a floor at this height that the collision shapes of a URDF or the geoms of an MJCF model touch, m
    #[arg(long, value_name = "Z", allow_hyphen_values = true, value_parser = finite, group = "touched")]
    pub floor: Option<f64>,
    /// Let the bodies of a URDF or an MJCF model touch each other by their shapes, but for bodies that a joint connects and
    /// shapes that overlap at the start
    #[arg(long, group = "touched")]
    pub self_contact: bool,
    /// Coefficient of friction on that floor and between bodies
    #[arg(long, value_name = "MU", default_value_t = 0.5, allow_negative_numbers = true, value_parser = not_negative, requires = "touched")]
    pub friction: f64,
}

impl TouchArgs {
    /// The same options for the readers, with these.
    pub fn of(&self, import: ImportOptions) -> ImportOptions {
        let floor = self.floor.map(|height| Floor { height, friction: self.friction });
        let self_contact = self.self_contact.then_some(self.friction);
        ImportOptions { limits: self.limits, floor, self_contact, ..import }
    }
}

/// A model and the options of its reader.
#[derive(Args)]
pub struct ModelArgs {
    /// Description of the mechanism, `.toml`, `.urdf` or `.xml`
    pub model: PathBuf,
    #[command(flatten)]
    pub import: ImportArgs,
    /// Variant of the model, a `[[variant]]` of its description
    #[arg(long, value_name = "NAME")]
    pub variant: Option<String>,
    /// Bodies on which external wrenches act, in body axes, in addition to those of the model; separated by commas
    #[arg(long = "wrench", value_name = "LIST", value_delimiter = ',')]
    pub wrenches: Vec<String>,
}

/// `mbd check`.
#[derive(Args)]
#[command(
    after_help = "Every finding states file, line and column and what to do. All findings of a file are reported at once.

With --generated, every file that is listed in manifest.toml of that directory is generated again and compared with the
existing file. In continuous integration, this ensures that generated code agrees with its model."
)]
pub struct CheckArgs {
    /// Descriptions of mechanisms, `.toml`, `.urdf` or `.xml`
    #[arg(required_unless_present = "generated")]
    pub models: Vec<PathBuf>,
    #[command(flatten)]
    pub import: ImportArgs,
    #[command(flatten)]
    pub touch: TouchArgs,
    /// Check the generated files of a directory with a manifest.toml instead
    #[arg(long, value_name = "DIR", num_args = 0..=1, default_missing_value = "generated", conflicts_with = "models")]
    pub generated: Option<PathBuf>,
    /// Write the files that --generated finds missing or different
    #[arg(long, requires = "generated")]
    pub update: bool,
}

/// `mbd convert`.
#[derive(Args)]
#[command(
    after_help = "The text is read back before it is written, and describes exactly the same mechanism: every number has as many
digits as give it back. What the readers do not use (meshes, colours, comments) is not converted."
)]
pub struct ConvertArgs {
    /// Description of the mechanism, `.toml`, `.urdf` or `.xml`
    pub model: PathBuf,
    #[command(flatten)]
    pub import: ImportArgs,
    /// Make stops of the joint limits of a URDF or an MJCF model
    #[arg(long)]
    pub limits: bool,
    /// File to write in place of standard output
    #[arg(short, long)]
    pub output: Option<PathBuf>,
}

/// `mbd completions`.
#[derive(Args)]
#[command(after_help = "Examples:
  mbd completions bash > ~/.local/share/bash-completion/completions/mbd
  mbd completions zsh > ~/.zfunc/_mbd
  mbd completions fish > ~/.config/fish/completions/mbd.fish
  mbd completions man > ~/.local/share/man/man1/mbd.1
  mbd completions schema > model.schema.json           a model that begins with `#:schema model.schema.json` is then
                                                       completed and checked by editors that know Taplo")]
pub struct CompletionsArgs {
    /// What to print
    #[arg(value_enum)]
    pub what: Completions,
}

/// What `mbd completions` prints.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Completions {
    /// Completions for bash
    Bash,
    /// Completions for elvish
    Elvish,
    /// Completions for fish
    Fish,
    /// Completions for PowerShell
    Powershell,
    /// Completions for zsh
    Zsh,
    /// The manual page, in roff
    Man,
    /// A JSON Schema (draft 4) of the TOML format of models, for editors
    Schema,
}

/// `mbd count`.
#[derive(Args)]
#[command(
    after_help = "Counted are additions, multiplications and divisions, and their sum; square roots and pairs of a sine and a cosine are
counted separately. The sweeps of each output are listed below it; operations that a sweep shares with an earlier one are counted there.
Of mechanisms with more than 600 bodies, the code that is generated is counted: of rolled code, every turn of a loop.
For serial chains of three or more revolute joints on a fixed base, published formulas stand beside."
)]
pub struct CountArgs {
    #[command(flatten)]
    pub model: ModelArgs,
    #[command(flatten)]
    pub code: CodeArgs,
    /// Show every elimination that was tried, not only the best of each branch
    #[arg(long)]
    pub candidates: bool,
    /// Count the code for modes of contacts: `masked`, `all`, `factored`, or a FILE with sets of modes
    #[arg(long, value_name = "masked|all|factored|FILE", conflicts_with_all = ["candidates", "json"])]
    pub modes: Option<String>,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
}

/// `mbd eval`.
#[derive(Args)]
#[command(after_help = "Input:   {\"states\": [{\"q\": [..], \"v\": [..], \"tau\": [..]}, ..]}
Output:  {\"states\": [{\"p\": [..], \"qd\": [..], \"pd\": [..], \"qdd\": [..], \"kinetic\": T, \"potential\": V, \"M\": [[..], ..]}, ..]}

`tau` is optional (zeros). The book's page on its JSON describes further inputs (wrenches, prescribed motions, gravity,
parameters), the layouts, and every output. In contrast to the other commands, eval takes all numbers of the file
exactly (--snap 0), for comparison with programs that do the same.")]
pub struct EvalArgs {
    #[command(flatten)]
    pub model: ModelArgs,
    /// States, JSON; `-` for standard input
    #[arg(short, long, value_name = "FILE")]
    pub input: PathBuf,
    /// Order and representation of the numbers in input and output
    #[arg(long, value_enum, default_value_t = LayoutArg::Mbd)]
    pub layout: LayoutArg,
    /// Outputs, separated by commas: p, qd, pd, qdd, kinetic, potential, M, h, tau, phi, lambda [default: all]
    #[arg(long, value_enum, value_delimiter = ',', value_name = "LIST", hide_possible_values = true)]
    pub outputs: Vec<Quantity>,
    /// Angles this close to right angles are taken as exact, rad
    #[arg(long, value_name = "RAD", default_value_t = 0.0, allow_negative_numbers = true, value_parser = snap)]
    pub snap: f64,
    /// Evaluate any number of states with the interpreter: the same numbers as the machine code that is otherwise made of
    /// the model for a thousand states or more
    #[arg(long)]
    pub interpreted: bool,
    /// File to write in place of standard output
    #[arg(short = 'o', long, value_name = "FILE")]
    pub output: Option<PathBuf>,
}

/// Layout of states.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum LayoutArg {
    /// This program's: joints depth first, children in file order; angles; quaternions x, y, z, w
    Mbd,
    /// Pinocchio's: children in alphabetical order; continuous and planar joints as cosine and sine
    Pinocchio,
    /// MuJoCo's: quaternions w, x, y, z; linear velocity of a floating base in ground axes
    Mujoco,
}

/// Output of `mbd eval`, under its name in the JSON.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Quantity {
    #[value(name = "p")]
    Momenta,
    #[value(name = "qd")]
    CoordinateRates,
    #[value(name = "pd")]
    MomentumRates,
    #[value(name = "qdd")]
    Accelerations,
    #[value(name = "kinetic")]
    Kinetic,
    #[value(name = "potential")]
    Potential,
    #[value(name = "M")]
    MassMatrix,
    #[value(name = "h")]
    Bias,
    #[value(name = "tau")]
    InverseDynamics,
    #[value(name = "phi")]
    Residuals,
    #[value(name = "lambda")]
    Multipliers,
}

/// `mbd certify`.
#[derive(Args)]
#[command(after_help = "Box:     {\"q\": [0.1, [-1, 1], ..], \"v\": [..], \"tau\": [..], \"a\": [..]}

Each entry is a number or a pair [low, high]; `v`, `tau` and `a` are zeros where they are left out. Prescribed joints and wrenches
are at zero, parameters have their defaults. As in `mbd eval`, all numbers of the model are taken exactly (--snap 0).

Where all entries are numbers, every output is computed in doubles and printed with a bound on its error. Otherwise it is bounded
over the box: by interval arithmetic, by the mean value form, and in parts (--split), of which the union is printed. All bounds
hold for exact arithmetic with the numbers of the model as they were read. The book's page on trust says what that costs, and where bounds
are too wide to be of use. An output without a bound is an error, after the others have been printed.")]
pub struct CertifyArgs {
    #[command(flatten)]
    pub model: ModelArgs,
    /// Box of states, JSON; `-` for standard input
    #[arg(long = "box", value_name = "FILE")]
    pub region: PathBuf,
    /// Outputs, separated by commas: p, qd, pd, qdd, kinetic, potential, M, h, tau, phi, lambda [default: all but phi, lambda]
    #[arg(long, value_enum, value_delimiter = ',', value_name = "LIST", hide_possible_values = true)]
    pub outputs: Vec<Quantity>,
    /// Number of parts into which the box is divided
    #[arg(long, value_name = "N", default_value_t = 1, allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub split: u32,
    /// Number of random states of the box that are evaluated in double-double numbers and compared with the bounds
    #[arg(long, value_name = "N", default_value_t = 0, allow_negative_numbers = true)]
    pub samples: u32,
    /// Angles this close to right angles are taken as exact, rad
    #[arg(long, value_name = "RAD", default_value_t = 0.0, allow_negative_numbers = true, value_parser = snap)]
    pub snap: f64,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
}

/// `mbd simulate`.
#[derive(Args)]
#[command(
    after_help = "Without one of the options under Control, the motion is free: joint forces and wrenches are zero. Prescribed joints are
at rest, dampers and springs of the model act. The book describes motion under control: its efforts are limited to what the
joints are made for, and the report tells where positions and speeds leave their bounds.

An interrupt (Ctrl-C) ends the run early: the table and the plot then hold what was computed, and the exit status is 130.

Steps are chosen by their error (--tolerance) with Verner's method of order 9, unless --method says otherwise; with --step
they are fixed, by the classical Runge-Kutta method of order 4 unless --method says otherwise. Rows of the table lie at
equal times, between the steps by dense output.

The start, unless --q and --v say otherwise: joints of one freedom at 0.3 and -0.3 rad in turn or 0.05 m, all others
neutral; every velocity 0.1 (rad/s or m/s), or zero under control. A model with `start`s, loops, couplings or
contacts starts from its `start`s, neutral where it states none, at rest or with its `start_velocity`s. A position that is not
stated and outside the range or the limits of its joint is moved to the middle of them, but for joints of loops and couplings.
Loops are closed from there (from --q, if given) without moving `held` joints.
Velocities then follow from those of the `held` joints; where none is held, they are the nearest ones that satisfy the
constraints.

Without dampers the energy is constant; with dampers it changes by their work. What it changes by otherwise is an error of the
simulation. It is printed relative to the largest kinetic energy, as a multiple of the tolerance, and beside what errors of the
tolerance in every step allow; a larger change gets a warning. A small one does not prove a good run: the error of the motion may
be larger, and --trust measures it. With fixed steps, one step is compared with two of half its size at states of the run.

Exit status 1 also where no digit can be trusted: a tolerance of 1 or more, a start between whose doubles lies a radian or
metre, steps that do not follow the motion, energy that is lost, and with --trust errors as large as the motion."
)]
pub struct SimulateArgs {
    #[command(flatten)]
    pub motion: MotionArgs,
    /// Project every step onto the energy of the start, for motion that neither gains nor loses energy. The error of
    /// the motion hardly changes
    #[arg(long)]
    pub project: bool,
    /// Run the motion again at a tenth of the tolerance (fixed steps: at a quarter of the step), or in double-double
    /// numbers; print the error of every coordinate at the end, how fast errors grow, and when no digit is left
    #[arg(long, value_enum, value_name = "HOW", num_args = 0..=1, default_missing_value = "tenth")]
    pub trust: Option<Trust>,
    /// Table to write; Parquet if the name ends in .parquet and the program was built with that feature, else CSV [default:
    /// NAME.csv in the current directory]
    #[arg(long, value_name = "FILE")]
    pub csv: Option<PathBuf>,
    /// Plot to write [default: NAME.svg in the current directory]
    #[arg(long, value_name = "FILE")]
    pub svg: Option<PathBuf>,
    /// Rows of the table after that of the start, at equal times [default: 1000]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = whole)]
    pub rows: Option<u64>,
    /// Time from one row of the table to the next, s
    #[arg(long, value_name = "S", allow_negative_numbers = true, value_parser = positive, conflicts_with = "rows")]
    pub every: Option<f64>,
    /// Columns of the table: `q`, `v`, `p`, `energy`, `tau` (joint forces of the control), `frames` (positions of all bodies and
    /// frames, m), `multipliers`, `reactions` (of joints), `forces` (of contacts), or names of single columns; separated by commas
    /// [default: q,v,p,energy, and tau under control]
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    pub columns: Vec<String>,
    /// File to write with the sets of modes of the contacts that the motion visits, for `mbd generate --modes`
    #[arg(long, value_name = "FILE")]
    pub record_modes: Option<PathBuf>,
    /// SVG picture of the motion to write: the mechanism at several instants, the last one darkest
    #[arg(long, value_name = "FILE")]
    pub picture: Option<PathBuf>,
    /// Direction from the mechanism to the eye [default: across its plane; in space from the front right, above]
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = vector, requires = "picture")]
    pub view: Option<[f64; 3]>,
    /// Bodies or frames whose paths are drawn, separated by commas
    #[arg(long, value_name = "LIST", value_delimiter = ',', requires = "picture")]
    pub trace: Vec<String>,
    /// Number of instants that are drawn
    #[arg(long, value_name = "N", default_value_t = 9, allow_negative_numbers = true, value_parser = clap::value_parser!(u16).range(1..=500), requires = "picture")]
    pub strobes: u16,
    /// Let the picture move: the motion in a loop, slowed down or sped up as the caption says, without a script. Readers who
    /// prefer reduced motion see the still picture
    #[arg(long, requires = "picture")]
    pub animate: bool,
    /// Names in the picture
    #[arg(long, value_enum, value_name = "WHICH", default_value_t = Names::Auto, requires = "picture")]
    pub names: Names,
}

/// What a picture names. A mechanism of many bodies has one colour for each limb, whose last body is named.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Names {
    /// The bodies, or the last ones of all limbs, where there are at most nine
    Auto,
    /// The same, where there are at most twelve
    All,
    /// Nothing
    None,
}

/// A motion: the model, its start, and how it is computed.
#[derive(Args)]
pub struct MotionArgs {
    #[command(flatten)]
    pub model: ModelArgs,
    #[command(flatten)]
    pub touch: TouchArgs,
    /// Length of the simulation, s
    #[arg(long, value_name = "S", default_value_t = 10.0, allow_negative_numbers = true, value_parser = positive)]
    pub time: f64,
    /// Method [default: verner9, with --step rk4]
    #[arg(long, value_name = "NAME", value_parser = methods())]
    pub method: Option<String>,
    /// Allowed error of a step, rad or m; for momenta relative to their size [default: 1e-9]
    #[arg(long, value_name = "X", allow_negative_numbers = true, value_parser = positive, conflicts_with = "step")]
    pub tolerance: Option<f64>,
    /// Choose steps by the errors of the coordinates alone, not of the momenta
    #[arg(long, conflicts_with = "step")]
    pub partial: bool,
    /// Compute everything with the interpreter: the same numbers as the machine code that is otherwise made of the model,
    /// many times slower
    #[arg(long)]
    pub interpreted: bool,
    /// Fixed step, s; shortened if the time is not a multiple of it
    #[arg(long, value_name = "S", allow_negative_numbers = true, value_parser = positive)]
    pub step: Option<f64>,
    /// Initial coordinates, separated by commas
    #[arg(long, value_name = "LIST", value_delimiter = ',', allow_hyphen_values = true, value_parser = finite)]
    pub q: Option<Vec<f64>>,
    /// Initial velocities, separated by commas
    #[arg(long, value_name = "LIST", value_delimiter = ',', allow_hyphen_values = true, value_parser = finite)]
    pub v: Option<Vec<f64>>,
    /// Table of another run, CSV: the motion starts where that one ended, with the coordinates `q.NAME` and velocities
    /// `v.NAME` of its last line
    #[arg(long, value_name = "FILE", conflicts_with_all = ["q", "v"])]
    pub start: Option<PathBuf>,
    /// Leave out the dampers of the model
    #[arg(long)]
    pub no_damping: bool,
    /// Angles this close to right angles are taken as exact, rad
    #[arg(long, value_name = "RAD", default_value_t = DEFAULT_SNAP, allow_negative_numbers = true, value_parser = snap)]
    pub snap: f64,
    /// How contacts are followed
    #[arg(long, value_enum, value_name = "HOW", default_value = "events")]
    pub contacts: ContactRegime,
    /// Time step of `--contacts stepping` and `auto`, s [default: 0.001]
    #[arg(long, value_name = "S", allow_negative_numbers = true, value_parser = positive)]
    pub contact_step: Option<f64>,
    /// How contacts act that collide at the same instant, in motions by events
    #[arg(long, value_enum, value_name = "HOW", default_value = "together")]
    pub impacts: Impacts,
    /// How loops are kept closed
    #[arg(long, value_parser = one_of(HOLD), default_value = "mass")]
    pub hold: Stabilisation,
    #[command(flatten)]
    pub control: ControlArgs,
}

/// `mbd modes`.
#[derive(Args)]
#[command(
    after_help = "The file lists the sets of modes, the one in which the motion was longest in front; `mbd generate --modes FILE` makes code for
them. Printed are the operations and the bytes of machine code of the rates in each of them, and of the functions that serve all."
)]
pub struct ModesArgs {
    #[command(flatten)]
    pub motion: MotionArgs,
    /// File to write with the sets of modes [default: NAME.modes in the current directory]
    #[arg(long, value_name = "FILE")]
    pub record: Option<PathBuf>,
}

/// How contacts are followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ContactRegime {
    /// From event to event: landings, slip and partings are found to rounding errors
    Events,
    /// By time steps of `--contact-step` with the impulses of all contacts at once; the error is about what happens in
    /// a step
    Stepping,
    /// From event to event, and by time steps while events crowd or cannot be resolved; the report says when
    Auto,
}

/// How contacts act that collide at the same instant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Impacts {
    /// All at once
    Together,
    /// The one whose bodies approach fastest, then the next, until none approach: Newton's cradle
    Sequential,
}

/// The second run of `--trust`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Trust {
    /// By the same method, at a tenth of the tolerance or a quarter of the step
    Tenth,
    /// In double-double numbers, at a tenth of the tolerance
    Wide,
}

/// `mbd explain`.
#[derive(Args)]
#[command(
    after_help = "frames    the tree on which the sweeps run: merged bodies, screws from joint to joint, zeros of the inertias
trace     operations that the sweeps made on symbols, and the number of them that an output needs
simplify  the program, one operation per line, under its body and quantity
schedule  its order: parts, values alive at once, longest chain of operations

Operations are simplified while the sweeps run (0 + x, 1 x, 0 x, signs, constants, equal operations): `trace` counts the
operations after this simplification, and `simplify` shows those that are also needed."
)]
pub struct ExplainArgs {
    #[command(flatten)]
    pub model: ModelArgs,
    /// Stage to show
    #[arg(long, value_enum, default_value_t = Stage::Frames)]
    pub after: Stage,
    #[command(flatten)]
    pub code: CodeArgs,
}

/// Arguments of `mbd identifiable`.
#[derive(Args)]
pub struct IdentifiableArgs {
    #[command(flatten)]
    pub model: ModelArgs,
}

/// Stage of the generator.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Stage {
    Frames,
    Trace,
    Simplify,
    Schedule,
}
