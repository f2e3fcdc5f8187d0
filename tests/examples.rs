//! Runs the programs of `examples/`. Each of them asserts what it shows.

#[path = "../examples/arm_control.rs"]
mod arm_control;
#[path = "../examples/batch.rs"]
mod batch;
#[path = "../examples/closed_loop.rs"]
mod closed_loop;
#[path = "../examples/clutch.rs"]
mod clutch;
#[path = "../examples/docking.rs"]
mod docking;
#[path = "../examples/gripper.rs"]
mod gripper;
#[path = "../examples/identification.rs"]
mod identification;
#[path = "../examples/kalman.rs"]
mod kalman;
#[path = "../examples/known_at_run_time.rs"]
mod known_at_run_time;
#[path = "../examples/lqr.rs"]
mod lqr;
#[path = "../examples/mpc/main.rs"]
mod mpc;
#[path = "../examples/pendulum.rs"]
mod pendulum;

type Outcome = Result<(), Box<dyn std::error::Error>>;

#[test]
fn a_pendulum_keeps_its_energy() -> Outcome {
    pendulum::main()
}

#[test]
fn an_arm_is_held_and_follows_a_path() -> Outcome {
    arm_control::main()
}

#[test]
fn a_pole_is_balanced() -> Outcome {
    lqr::main()
}

#[test]
fn many_arms_fall_at_once() -> Outcome {
    batch::main()
}

#[test]
fn a_linkage_stays_closed() -> Outcome {
    closed_loop::main()
}

#[test]
fn a_clutch_locks() -> Outcome {
    clutch::main()
}

#[test]
fn a_ship_docks_and_leaves() -> Outcome {
    docking::main()
}

#[test]
fn an_arm_takes_a_box_and_throws_it() -> Outcome {
    gripper::main()
}

#[test]
fn a_robot_is_compiled_at_run_time() -> Outcome {
    known_at_run_time::main()
}

#[test]
fn a_robot_is_identified() -> Outcome {
    identification::main()
}

#[test]
fn a_pendulum_is_followed_by_a_filter() -> Outcome {
    kalman::main()
}

#[test]
fn an_acrobot_swings_up_and_an_arm_reaches() -> Outcome {
    mpc::main()
}
