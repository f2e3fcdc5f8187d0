//! Large models: the time to read, check and plan one grows with its size, not with the square of it.

use std::fmt::Write;
use std::time::{Duration, Instant};

use mbd_codegen::model::Model;
use mbd_codegen::options::PlanOptions;
use mbd_codegen::plan::{state_layout, Plan};
use mbd_codegen::read::{self, ImportOptions};
use mbd_codegen::search;

/// A comb: a chain of bodies, each with a start, a mimic and perhaps a wrench, and a body fixed to it.
fn text(bodies: usize, wrenches: bool) -> String {
    let mut text = String::from("name = \"comb\"\n");
    for k in 0..bodies / 3 {
        let parent = if k == 0 { "ground".to_string() } else { format!("a{}", k - 1) };
        let body = "com = [0.1, 0, 0]\ninertia = { xx = 0.1, yy = 0.1, zz = 0.1 }";
        let _ = write!(
            text,
            "[[body]]\nname = \"a{k}\"\nmass = 1\n{body}\n[[body]]\nname = \"b{k}\"\nmass = 1\n{body}\n\
             [[body]]\nname = \"c{k}\"\nmass = 1\n{body}\n\
             [[joint]]\nname = \"ja{k}\"\ntype = \"revolute\"\nparent = \"{parent}\"\nchild = \"a{k}\"\naxis = [0, 1, 0]\n\
             xyz = [0.2, 0, 0]\nstart = 0.1\n\
             [[joint]]\nname = \"jb{k}\"\ntype = \"revolute\"\nparent = \"a{k}\"\nchild = \"b{k}\"\naxis = [0, 0, 1]\n\
             mimic = {{ joint = \"ja{k}\", ratio = 2 }}\n\
             [[joint]]\nname = \"jc{k}\"\ntype = \"fixed\"\nparent = \"b{k}\"\nchild = \"c{k}\"\n"
        );
        if wrenches {
            let _ = writeln!(text, "[[wrench]]\nbody = \"a{k}\"");
        }
    }
    text
}

fn time<R>(work: impl FnOnce() -> R) -> (Duration, R) {
    let clock = Instant::now();
    let result = work();
    (clock.elapsed(), result)
}

/// Times of the stages.
fn stages(text: &str) -> [Duration; 4] {
    let (reading, read) = time(|| read::model("comb.toml", text, &ImportOptions::default()));
    let model: Model = read.unwrap_or_else(|findings| panic!("{findings}")).model;
    let (planning, plan) = time(|| Plan::new(&model, 1e-6));
    let (searching, plan) = time(|| search::best(plan, PlanOptions::default()).plan);
    let (looking, _) = time(|| (plan.start(), plan.held(), state_layout::pinocchio(&plan)));
    [reading, planning, searching, looking]
}

#[test]
fn time_is_proportional_to_size() {
    proportional_to_size(false);
}

#[test]
fn time_is_proportional_to_size_with_a_wrench_on_every_link() {
    proportional_to_size(true);
}

fn proportional_to_size(wrenches: bool) {
    const SMALL: usize = 1500;
    const TIMES: u32 = 8;
    let texts = [SMALL, SMALL * TIMES as usize].map(|bodies| text(bodies, wrenches));
    let mut best = [[Duration::MAX; 4]; 2];
    // 8 for work in proportion, 64 for its square. A millisecond hides what is too fast to be measured.
    let proportional = |[small, large]: &[[Duration; 4]; 2]| {
        let mut both = small.iter().zip(large);
        both.all(|(small, large)| *large < 24 * (*small + Duration::from_millis(1)))
    };
    // The sizes take turns, so that they share the quiet and busy times of the machine; more turns where these are mixed.
    for _ in 0..12 {
        for (best, text) in best.iter_mut().zip(&texts) {
            best.iter_mut().zip(stages(text)).for_each(|(best, time)| *best = time.min(*best));
        }
        if proportional(&best) {
            return;
        }
    }
    panic!("times of reading, planning, searching and looking, and those for {TIMES} times the size: {best:?}");
}
