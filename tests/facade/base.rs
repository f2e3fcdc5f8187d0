//! A robot in URDF with additions in TOML, through the macro.

use multibody::codegen::model::Model;
use multibody::codegen::plan::Plan;
use multibody::runtime::Interpreter;

multibody::mbd_model! { path = "models/ur5_tool.toml", name = Ur5Tool, outputs = [rates, momenta] }

#[test]
fn generated_code_is_that_of_the_changed_robot() {
    let model = Model::load("models/ur5_tool.toml").expect("a model");
    assert_eq!((model.wrenches.len(), model.params.len(), model.frames.len()), (1, 1, 1));
    let plan = Plan::new(&model, 1e-6);
    let mut interpreter: Interpreter<f64> = plan.default_interpreter();
    let mut arm = Ur5Tool::default();
    let q = [0.3, -1.1, 0.9, -0.4, 0.7, 0.2];
    let v = [0.5, -0.3, 0.8, 1.1, -0.6, 0.4];
    let mut p = [0.0; 6];
    arm.momenta(&q, &v, &mut p);
    arm.wrenches[Ur5Tool::WRENCH_GRIPPER] = [3.0, -2.0, 1.0, 0.1, 0.2, -0.3];
    interpreter.wrenches[0] = arm.wrenches[0];
    let (mut qd, mut pd) = ([0.0; 6], [0.0; 6]);
    arm.rates(&q, &p, &mut qd, &mut pd);
    let (mut v, mut expected_qd, mut expected_pd) = (vec![0.0; 6], vec![0.0; 6], vec![0.0; 6]);
    interpreter.rates(&q, &p, &mut v, &mut expected_qd, &mut expected_pd);
    for (a, b) in qd.iter().chain(&pd).zip(expected_qd.iter().chain(&expected_pd)) {
        // Sums of some hundred terms of the size of ten.
        assert!((a - b).abs() < 1e-11, "{a} {b}");
    }
}
