//! Operation counts are gates: additions, multiplications and divisions of the emitted rates. General chains of many
//! lengths are counted among the random trees of `testing`.

use multibody::codegen::generate::trace;
use multibody::codegen::import::{load, Base, ImportOptions};
use multibody::codegen::plan::Plan;
use multibody::codegen::{Group, Options};

fn rates(file: &str, base: Base, gravity: Option<[f64; 3]>, efforts: bool) -> usize {
    operations(Group::Rates, file, base, gravity, efforts)
}

fn operations(group: Group, file: &str, base: Base, gravity: Option<[f64; 3]>, efforts: bool) -> usize {
    let root = env!("CARGO_MANIFEST_DIR");
    let text = std::fs::read_to_string(format!("{root}/models/{file}")).expect("the model");
    let (model, findings) = load(file, &text, &ImportOptions { base, gravity });
    let model = model.unwrap_or_else(|| panic!("{findings}"));
    let options = Options { efforts, ..Options::default() };
    let plan = Plan::new(&model, options.plan);
    trace(&plan, group, &options).expect("no frame is named").program.counts().total()
}

#[test]
fn real_robots_stay_below_their_limits() {
    for (file, limit) in [
        ("ur5.urdf", 500),
        ("panda_arm.urdf", 1000),
        ("chain10_planar.toml", 680),
        ("double_pendulum.toml", 40),
        ("iiwa14.urdf", 800),
    ] {
        let count = rates(file, Base::Fixed, None, true);
        println!("{file}: {count}");
        assert!(count <= limit, "{file}: {count} operations, at most {limit}");
    }
}

#[test]
fn the_general_chain_without_gravity() {
    let count = rates("chain6.toml", Base::Fixed, Some([0.0; 3]), false);
    assert!(count <= 294 * 6 - 440, "{count}");
}

#[test]
fn joint_forces_cost_one_addition_each_at_most_and_nothing_if_absent() {
    for (file, nv) in [("ur5.urdf", 6), ("panda_arm.urdf", 7)] {
        // A first joint with a vertical axis has no momentum rate but its force: nothing to add it to.
        let added = rates(file, Base::Fixed, None, true) - rates(file, Base::Fixed, None, false);
        assert!(added == nv || added == nv - 1, "{file}: {added}");
    }
}

#[test]
fn a_floating_base_without_gravity_costs_less() {
    let with = rates("solo12.urdf", Base::Floating, None, false);
    let without = rates("solo12.urdf", Base::Floating, Some([0.0; 3]), false);
    println!("solo12: {with} with gravity, {without} without");
    assert!(without < with);
}

/// Rates and all four blocks of derivatives. In comments the operations of CasADi's code of Pinocchio's
/// `computeABADerivatives` (`benches/rivals/derivatives`), where it has been made.
#[test]
fn derivatives_stay_below_their_limits() {
    for (file, base, limit) in [
        ("double_pendulum.toml", Base::Fixed, 70), // 173
        ("ur5.urdf", Base::Fixed, 1280),           // 7049
        ("panda_arm.urdf", Base::Fixed, 2760),     // 9837
        ("iiwa14.urdf", Base::Fixed, 2090),        // 9531
        ("chain6.toml", Base::Fixed, 2600),        // 10271
        ("chain10_planar.toml", Base::Fixed, 5420),
        ("satellite.toml", Base::Fixed, 580),
        ("solo12.urdf", Base::Floating, 10700), // 37411
        ("g1.urdf", Base::Floating, 56500),
    ] {
        let count = operations(Group::Derivatives, file, base, None, true);
        println!("{file}: {count}");
        assert!(count <= limit, "{file}: {count} operations, at most {limit}");
    }
}
