//! Generates the code of the scenes that run compiled (feature `generated`), as the build script of a user does.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    #[cfg(feature = "generated")]
    generated::write();
}

// The scenes belong to the crate that this script builds, so the script includes their source.
#[cfg(feature = "generated")]
#[allow(dead_code, unused_imports)]
#[path = "src/scenes/mod.rs"]
mod scenes;

#[cfg(feature = "generated")]
mod generated {
    use std::fmt::Write;
    use std::path::{Path, PathBuf};

    use multibody::codegen::model::Model;
    use multibody::codegen::options::PlanOptions;
    use multibody::codegen::read::{self, ImportOptions};
    use multibody::codegen::{generate, Options, Output, Precision, RolledCode};

    use super::scenes;

    const SMOOTH: &[Output] =
        &[Output::Rates, Output::Momenta, Output::Energy, Output::Accelerations, Output::Derivatives];
    /// Outputs for mechanisms with quaternions.
    const SMOOTH_ON_GROUP: &[Output] = &[
        Output::Rates,
        Output::Velocities,
        Output::Momenta,
        Output::Energy,
        Output::Accelerations,
        Output::Derivatives,
    ];
    /// Derivatives grow with the square of the number of joints.
    const PLAIN: &[Output] = &[Output::Rates, Output::Momenta, Output::Energy, Output::Accelerations];
    const PLAIN_ON_GROUP: &[Output] =
        &[Output::Rates, Output::Velocities, Output::Momenta, Output::Energy, Output::Accelerations];

    /// Scene, another scene of the same model, outputs, and whether there is code in single precision too.
    const SCENES: [(&str, Option<&str>, &[Output], bool); 11] = [
        ("double_pendulum", Some("double_pendulum_chaotic"), SMOOTH, true),
        ("ur5", None, SMOOTH, true),
        ("panda_arm", None, SMOOTH, true),
        ("arm7", None, SMOOTH, true),
        ("chain10", Some("chain10_swing"), SMOOTH, true),
        ("chain10_friction", None, SMOOTH, false),
        ("rotor", None, SMOOTH_ON_GROUP, false),
        ("chain50_friction", None, PLAIN, false),
        ("chain100_friction", None, PLAIN, false),
        ("tree150_friction", None, PLAIN, false),
        ("quadruped", None, PLAIN_ON_GROUP, false),
    ];
    /// Numbers of links of closed chains, for which only the rates are generated.
    const CLOSED: [usize; 2] = [10, 100];

    /// Writes one module for each type, and the list of types and their scenes.
    pub fn write() {
        println!("cargo::rerun-if-changed=src/scenes");
        println!("cargo::rerun-if-changed=../models");
        let mut all = String::new();
        for precision in [Precision::F64, Precision::F32] {
            let (mut smooth, mut plain) = (String::new(), String::new());
            for (name, also, outputs, single) in SCENES {
                if precision == Precision::F32 && !single {
                    continue;
                }
                let scene = scenes::by_name(name).unwrap_or_else(|| panic!("no scene `{name}`"));
                let path = module(&mut all, name, &scene.model, outputs, precision);
                let list = if outputs.contains(&Output::Derivatives) { &mut smooth } else { &mut plain };
                let also = also.map_or(String::new(), |also| format!(" | {also:?}"));
                let _ = writeln!(list, "    {name:?}{also} => {path},");
            }
            let scalar = precision.name();
            let _ = writeln!(
                all,
                "scenes!({scalar}, visit_{scalar}, visit_differentiable_{scalar}, {{\n{smooth}}}, {{\n{plain}}});"
            );
        }
        for links in CLOSED {
            let (name, text) = (format!("closed{links}"), scenes::experiments::closed(links, "pin", false));
            let model = read::model(&format!("{name}.toml"), &text, &ImportOptions::default())
                .unwrap_or_else(|findings| panic!("{findings}"))
                .model;
            module(&mut all, &name, &model, &[Output::Rates], Precision::F64);
        }
        write_file(&directory().join("scenes.rs"), &all);
    }

    /// Writes the code of a model and a module for it. Returns the path of the type.
    fn module(all: &mut String, name: &str, model: &Model, outputs: &[Output], precision: Precision) -> String {
        let single = precision == Precision::F32;
        let module = format!("{name}{}", if single { "_f32" } else { "" });
        // Branches of ten links are short for rolled code, but straight-line code of all of them has 2.4 MB.
        let loops = if name.starts_with("tree") { RolledCode::Always } else { RolledCode::default() };
        let default = Options::default();
        let options = Options {
            type_name: "Scene".to_string(),
            outputs: outputs.to_vec(),
            precision,
            efforts: false,
            plan: PlanOptions { rolled: loops, ..default.plan },
            runtime: "::multibody::runtime".to_string(),
            source: format!("scene {name}"),
            ..default
        };
        let code = generate(model, &options).unwrap_or_else(|e| panic!("{name}: {e}"));
        let file = directory().join(format!("{module}.rs"));
        write_file(&file, &code.source);
        let file = file.display().to_string();
        let _ = writeln!(
            all,
            "/// Generated code of the scene `{name}`.\npub mod {module} {{\n    include!({file:?});\n}}"
        );
        format!("{module}::Scene")
    }

    fn directory() -> PathBuf {
        PathBuf::from(std::env::var("OUT_DIR").expect("cargo sets it"))
    }

    fn write_file(path: &Path, text: &str) {
        std::fs::write(path, text).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    }
}
