//! Generates the code of the mechanisms. The environment variable `LANES` names those that are wanted, with commas
//! between; without it, all are. `LANES_MORE` names further URDF files, with floating bases.

use std::fmt::Write;

use mbd_codegen::code::{compile, Code};
use mbd_codegen::generate::generate_from;
use mbd_codegen::model::Model;
use mbd_codegen::plan::Plan;
use mbd_codegen::read::{self, Base, ImportOptions};
use mbd_codegen::{search, Options, Output};

/// Names, files and bases; chains without a file are made here.
const MODELS: [(&str, &str, Base); 13] = [
    ("double_pendulum", "double_pendulum.toml", Base::Fixed),
    ("chain10_planar", "chain10_planar.toml", Base::Fixed),
    ("ur5", "ur5.urdf", Base::Fixed),
    ("panda_arm", "panda_arm.urdf", Base::Fixed),
    ("iiwa14", "iiwa14.urdf", Base::Fixed),
    ("chain6", "chain6.toml", Base::Fixed),
    ("solo12", "solo12.urdf", Base::Floating),
    ("g1", "g1.urdf", Base::Floating),
    ("general20", "", Base::Fixed),
    ("general100", "", Base::Fixed),
    ("general1000", "", Base::Fixed),
    ("planar100", "", Base::Fixed),
    ("planar1000", "", Base::Fixed),
];

fn main() {
    println!("cargo:rerun-if-env-changed=LANES");
    println!("cargo:rerun-if-env-changed=LANES_MORE");
    let wanted = std::env::var("LANES").unwrap_or_default();
    let more = std::env::var("LANES_MORE").unwrap_or_default();
    let mut list = String::from("models! {\n");
    for (name, file, base) in MODELS {
        if !wanted.is_empty() && !wanted.split(',').any(|w| w == name) {
            continue;
        }
        let path = format!("../../models/{file}");
        match name.strip_prefix("general").or(name.strip_prefix("planar")).filter(|_| file.is_empty()) {
            Some(links) => {
                let links = links.parse().expect("a number of links");
                model(&mut list, name, "chain.toml", &chain(links, name.starts_with("planar")), base);
            }
            None => {
                println!("cargo:rerun-if-changed={path}");
                model(&mut list, name, &path, &std::fs::read_to_string(&path).expect("the model"), base);
            }
        }
    }
    for path in more.split(',').filter(|p| !p.is_empty()) {
        let name = path.rsplit('/').next().unwrap_or(path).trim_end_matches(".urdf");
        model(&mut list, name, path, &std::fs::read_to_string(path).expect("the model"), Base::Floating);
    }
    list.push_str("}\n");
    write("models.rs", &list);
}

fn model(list: &mut String, name: &str, path: &str, text: &str, base: Base) {
    let mut model: Model = read::model(path, text, &ImportOptions { base, ..ImportOptions::default() })
        .unwrap_or_else(|findings| panic!("{findings}"))
        .model;
    for joint in &mut model.joints {
        joint.damping.fill(mbd_codegen::model::Value::ZERO);
    }
    let options = Options {
        type_name: "Robot".to_string(),
        outputs: vec![Output::Rates, Output::Accelerations],
        runtime: "::mbd_runtime".to_string(),
        source: name.to_string(),
        ..Options::default()
    }
    .of_model(false);
    let plan = search::plan(&model, options.searches());
    write(&format!("{name}.rs"), &generate_from(&plan, &options).expect("code").source);
    let [one, chain, lane] = bounds(&plan, Output::Rates, &options);
    let [.., lane_q] = bounds(&plan, Output::Accelerations, &options);
    let _ = writeln!(list, "    {name} [{one:.2} {chain:.2} {lane:.2} {lane_q:.2}];");
}

/// Cycles that the processor of the cost model needs at least, as `mbd count` prints them: for one of many states, for one that
/// waits for the one before it, and for each of eight at once. No code for these operations takes less, but for loops over like
/// branches, which compute four in one instruction.
fn bounds(plan: &Plan, output: Output, options: &Options) -> [f64; 3] {
    let (path, [one, lane]) = match compile(plan, output, options).expect("a program").program {
        Code::Straight(program) => (program.critical_path(), [program.bound(), program.bound_of_lanes()]),
        Code::Rolled(program) => (program.cost().critical_path, program.bounds()),
    };
    [one, one.max(f64::from(path)), lane]
}

/// A chain of revolute joints: of equal bars in the plane, or of bodies in space that have nothing in common.
fn chain(links: usize, planar: bool) -> String {
    let mut seed = links as u64;
    let mut random = |low: f64, high: f64| {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        low + (high - low) * ((seed >> 11) as f64 / (1u64 << 53) as f64)
    };
    let mut text = String::from("name = \"chain\"\ngravity = [0, 0, -9.81]\n");
    for k in 1..=links {
        let parent = if k == 1 { "ground".to_string() } else { format!("link{}", k - 1) };
        let mut three =
            |low, high| format!("[{:.3}, {:.3}, {:.3}]", random(low, high), random(low, high), random(low, high));
        let (com, inertia, xyz, rpy, axis) = match planar {
            true => (
                "[0, 0, -0.125]".to_string(),
                "[0.0021, 0.0021, 0.00005]".to_string(),
                format!("[0, 0, {}]", if k > 1 { -0.25 } else { 0.0 }),
                "[0, 0, 0]".to_string(),
                "[0, 1, 0]".to_string(),
            ),
            false => (
                three(-0.2, 0.2),
                "{ xx = 0.021, yy = 0.023, zz = 0.018, xy = 0.002, xz = -0.003, yz = 0.0014 }".to_string(),
                three(-0.4, 0.4),
                three(-3.0, 3.0),
                three(0.1, 1.0),
            ),
        };
        let mass = if planar { 0.4 } else { random(0.5, 3.0) };
        let _ = writeln!(
            text,
            "\n[[body]]\nname = \"link{k}\"\nmass = {mass:.3}\ncom = {com}\ninertia = {inertia}\n\n[[joint]]\nname = \"pin{k}\"\n\
             type = \"revolute\"\nparent = \"{parent}\"\nchild = \"link{k}\"\nxyz = {xyz}\nrpy = {rpy}\naxis = {axis}"
        );
    }
    text
}

fn write(file: &str, text: &str) {
    let out = std::env::var("OUT_DIR").expect("cargo sets it");
    std::fs::write(format!("{out}/{file}"), text).expect("written");
}
