//! Contacts that are far away: bounds of how fast gaps close, and what it costs to watch them.

use std::cell::Cell;
use std::rc::Rc;
use std::time::Instant;

use mbd_codegen::jit::Compiled;
use mbd_codegen::model::JointKind;
use mbd_codegen::options::Options;
use mbd_codegen::plan::Plan;
use mbd_runtime::catalogue::{self, BoxedMethod};
use mbd_runtime::constrained::{Effort, Projection, Stabilisation, WithPostStep};
use mbd_runtime::contact::{
    Contact, ContactEvent, ContactMotion, ContactObserver, Hybrid, ModeTable, Reach, Reducible, RegimeChoice,
    RegimeRules, Touching, Way, WithContacts,
};
use mbd_runtime::integrate::{Solver, Step, Tolerances, Tsit5, Verner9};
use mbd_runtime::system::{LieJoint, Row};
use mbd_runtime::tree::Source;
use mbd_runtime::{Conjugate, Constrained, Energetic, Interpreter, System};
use mbd_testing::random::with_contacts;
use mbd_testing::state::random_state;
use mbd_testing::toml::to_toml;

use super::scene::{closed_start, model, Scene};

/// A mechanism that counts the sweeps over it.
#[derive(Clone, Debug)]
pub struct Counted {
    inner: Interpreter<f64>,
    pub sweeps: Rc<Cell<u64>>,
    /// Whether nothing is said of how fast gaps close, nor of trees that do not feel each other.
    pub silent: bool,
    /// Whether all gaps are computed wherever some are asked for.
    whole: bool,
    /// Rows whose gaps were computed, and how often some were.
    pub rows: Rc<Cell<u64>>,
    looks: Rc<Cell<u64>>,
}

impl Counted {
    pub fn new(inner: Interpreter<f64>) -> Self {
        Counted { inner, sweeps: Rc::default(), silent: false, whole: false, rows: Rc::default(), looks: Rc::default() }
    }

    fn counted(&mut self) -> &mut Interpreter<f64> {
        self.sweeps.set(self.sweeps.get() + 1);
        &mut self.inner
    }
}

impl System for Counted {
    type Scalar = f64;
    type Coordinates = Vec<f64>;
    type Momenta = Vec<f64>;

    fn neutral(&self) -> Vec<f64> {
        self.inner.neutral()
    }
    fn zero_momenta(&self) -> Vec<f64> {
        self.inner.zero_momenta()
    }
    fn lie_joints(&self) -> &[LieJoint] {
        self.inner.lie_joints()
    }
    fn rates_at(&mut self, t: f64, q: &Vec<f64>, p: &Vec<f64>, qd: &mut Vec<f64>, pd: &mut Vec<f64>) {
        self.counted().rates_at(t, q, p, qd, pd);
    }
    fn coordinate_rates(&self, q: &Vec<f64>, v: &Vec<f64>, qd: &mut Vec<f64>) {
        self.inner.coordinate_rates(q, v, qd);
    }
}

impl Energetic for Counted {
    fn energies(&mut self, q: &Vec<f64>, p: &Vec<f64>) -> (f64, f64) {
        self.inner.energies(q, p)
    }
}

impl Conjugate for Counted {
    fn conjugate_momenta(&mut self, q: &Vec<f64>, v: &Vec<f64>, p: &mut Vec<f64>) {
        self.inner.conjugate_momenta(q, v, p);
    }
}

impl Constrained for Counted {
    type Rows = Vec<f64>;
    type Entries = Vec<f64>;

    fn zero_rows(&self) -> Vec<f64> {
        self.inner.zero_rows()
    }
    fn zero_entries(&self) -> Vec<f64> {
        self.inner.zero_entries()
    }
    fn rows(&self) -> &[Row] {
        self.inner.rows()
    }
    fn entry_columns(&self) -> &[usize] {
        self.inner.entry_columns()
    }
    fn constraint_residuals(&mut self, q: &Vec<f64>, residual: &mut Vec<f64>, jacobian: &mut Vec<f64>) {
        self.counted().constraint_residuals(q, residual, jacobian);
    }
    fn project_momenta(&mut self, t: f64, q: &Vec<f64>, p: &mut Vec<f64>, v: &mut Vec<f64>, sigma: &mut Vec<f64>) {
        self.counted().project_momenta(t, q, p, v, sigma);
    }
    fn position_correction(&mut self, q: &Vec<f64>, residual: &mut Vec<f64>, dq: &mut Vec<f64>, pivots: &mut Vec<f64>) {
        self.counted().position_correction(q, residual, dq, pivots);
    }
    fn multipliers(&mut self, t: f64, q: &Vec<f64>, v: &Vec<f64>, lambda: &mut Vec<f64>) {
        self.counted().multipliers(t, q, v, lambda);
    }
}

impl Reducible for Counted {
    fn acting(&self, acts: &[bool]) -> Self {
        Counted { inner: self.inner.acting(acts), ..self.clone() }
    }
    fn swap_inputs(&mut self, other: &mut Self) {
        Reducible::swap_inputs(&mut self.inner, &mut other.inner);
    }
    fn way(&self) -> Way {
        Way::Interpreted
    }
    fn reaches(&self, contacts: &[Contact<f64>]) -> Vec<Reach<f64>> {
        let mut reaches = Reducible::reaches(&self.inner, contacts);
        reaches.iter_mut().filter(|_| self.silent).for_each(|reach| reach.rate = f64::INFINITY);
        reaches
    }
    fn trees(&self) -> Vec<usize> {
        if self.silent {
            Vec::new()
        } else {
            Reducible::trees(&self.inner)
        }
    }
    fn gaps(
        &mut self,
        q: &Vec<f64>,
        v: &Vec<f64>,
        gaps: &mut Vec<f64>,
        velocities: &mut Vec<f64>,
        entries: &mut Vec<f64>,
    ) {
        self.rows.set(self.rows.get() + gaps.len() as u64);
        self.looks.set(self.looks.get() + 1);
        Reducible::gaps(self.counted(), q, v, gaps, velocities, entries);
    }
    fn sees_parts(&self) -> bool {
        !self.whole
    }
    fn gaps_of(
        &mut self,
        wanted: &[bool],
        state: (&Vec<f64>, &Vec<f64>),
        gaps: &mut Vec<f64>,
        velocities: &mut Vec<f64>,
        entries: &mut Vec<f64>,
    ) {
        if self.whole {
            return Reducible::gaps(self, state.0, state.1, gaps, velocities, entries);
        }
        self.rows.set(self.rows.get() + wanted.iter().filter(|wanted| **wanted).count() as u64);
        self.looks.set(self.looks.get() + 1);
        Reducible::gaps_of(self.counted(), wanted, state, gaps, velocities, entries);
        // What is not asked for means nothing.
        for (k, row) in self.inner.rows().iter().enumerate().filter(|(k, _)| !wanted[*k]) {
            (gaps[k], velocities[k]) = (f64::NAN, f64::NAN);
            entries[row.first..][..row.len].fill(f64::NAN);
        }
    }
}

/// Absolute values of coordinates, at the places of their velocities; zero for quaternions.
fn sizes(plan: &Plan, q: &[f64]) -> Vec<f64> {
    let mut sizes = vec![0.0; plan.dims.nv];
    for slot in &plan.slots {
        let kind = plan.model.joints[slot.joint].kind;
        let n = match kind {
            JointKind::Spherical => 0,
            JointKind::Floating => 3,
            _ => kind.nv(),
        };
        if let Some(Source::State { q: from, v }) = slot.at {
            (0..n).for_each(|k| sizes[v + k] = q[from + k].abs());
        }
    }
    sizes
}

#[test]
fn gaps_close_no_faster_than_their_bounds() {
    let (mut count, mut tightest) = (0, 0.0_f64);
    for seed in 0..300 {
        let Some(model) = with_contacts(seed) else { continue };
        let plan = Plan::new(&model, 1e-9);
        let mut mechanism = plan.default_contact_interpreter::<f64>();
        let reaches = mechanism.reaches().to_vec();
        let contacts = mechanism.contacts().to_vec();
        assert!(reaches.is_sorted_by_key(|reach| (reach.contact, reach.velocity)));
        for k in 0..20 {
            let state = random_state(&plan, 100 * seed + k);
            let (mut gaps, mut rates) = (mechanism.zero_rows(), mechanism.zero_rows());
            let mut entries = mechanism.zero_entries();
            // One velocity at a time, and all of them.
            let mut v = state.v.clone();
            if k > 0 && !v.is_empty() {
                let only = k as usize % v.len();
                v.iter_mut().enumerate().filter(|(j, _)| *j != only).for_each(|(_, v)| *v = 0.0);
            }
            mechanism.gaps(0.0, &state.q, &v, &mut gaps, &mut rates, &mut entries);
            let size = sizes(&plan, &state.q);
            for (k, contact) in contacts.iter().enumerate() {
                let row = reaches.iter().filter(|reach| reach.contact == k);
                let sum = |of: &dyn Fn(&Reach<f64>, usize) -> f64| -> f64 {
                    row.clone().map(|reach| of(reach, reach.velocity)).sum()
                };
                let arm = sum(&|reach, j| reach.slide * size[j]);
                let bound = sum(&|reach, j| (reach.rate + reach.turn * arm) * v[j].abs());
                let rate = rates[contact.row].abs();
                count += 1;
                assert!(
                    bound.is_finite() && rate <= bound * (1.0 + 1e-12) + 1e-12,
                    "{seed}: {rate} {bound}\n{}",
                    to_toml(&model)
                );
                if bound > 0.0 {
                    tightest = tightest.max(rate / bound);
                }
            }
        }
    }
    assert!(count > 2000, "{count}");
    assert!(tightest > 0.99, "{tightest}");
}

type Timed = WithContacts<ModeTable<Counted>>;

fn projection<Y: Constrained<Scalar = f64>>(system: &Y) -> Projection<Y> {
    projection_by(system, Stabilisation::Mass)
}

fn projection_by<Y: Constrained<Scalar = f64>>(system: &Y, stabilisation: Stabilisation) -> Projection<Y> {
    Projection::new(system, stabilisation, Effort { energy: f64::INFINITY, ..Effort::default() })
}

/// A quadruped 10 m above the floor whose legs swing.
fn quadruped() -> (Plan, Vec<f64>, Vec<f64>) {
    // Springs keep the knees off their stops.
    let text = include_str!("../../../models/contacts/quadruped.toml");
    let text = ["1.4", "-1.4"].into_iter().fold(text.to_string(), |text, at| {
        let sprung = format!("start = {at}\nstiffness = 1\nrest = {at}\ndamping = 0.005\n");
        text.replace(&format!("start = {at}\n"), &sprung)
    });
    let plan = Plan::new(&model(&text), 1e-9);
    let mut q = plan.start();
    q[2] = 10.0;
    let mut v = vec![0.0; plan.dims.nv];
    v[2] = 3.0;
    for leg in 0..4 {
        let sign = if leg == 0 || leg == 3 { 1.0 } else { -1.0 };
        v[6 + 3 * leg..9 + 3 * leg].copy_from_slice(&[0.5 * sign, 8.0 * sign, 0.0]);
    }
    (plan, q, v)
}

/// A body with a telescopic leg, 10 m above the floor, that turns over.
fn monopod() -> (Plan, Vec<f64>, Vec<f64>) {
    let text = include_str!("../../../benches/instructions/leg.toml");
    let plan = Plan::new(&model(text), 1e-9);
    let q = plan.start();
    (plan, q, vec![1.0, 3.0, 5.0, -4.0, 0.2])
}

/// A four-bar that turns, 10 m above a floor.
fn fourbar() -> (Plan, Vec<f64>, Vec<f64>) {
    let text = include_str!("../../../models/contacts/fourbar_stop.toml");
    let text = text.replace("limits = { lower = { deg = 91 } }\nlimit_restitution = 0.5\n", "");
    let floor = r#"
[[shape]]
name = "floor"
type = "plane"
xyz = [0, 0, -10]

[[shape]]
name = "tip"
body = "coupler"
type = "point"
xyz = [0.18, 0, 0.12]

[[contact]]
name = "touch"
between = ["floor", "tip"]
"#;
    let plan = Plan::new(&model(&format!("{text}{floor}")), 1e-9);
    let (q, v) = (closed_start(&plan), vec![0.0; plan.dims.nv]);
    (plan, q, v)
}

/// Sweeps over a mechanism with and without contacts.
fn sweeps((plan, q, v): &(Plan, Vec<f64>, Vec<f64>), method: &str, tolerance: f64, time: f64) -> [u64; 2] {
    let step = Step::Adaptive(Tolerances::new(tolerance));
    let mut p = v.clone();
    let mut free = Counted::new(plan.default_interpreter());
    free.conjugate_momenta(q, v, &mut p);
    let count = free.sweeps.clone();
    let mut by: BoxedMethod<Counted> = catalogue::explicit(method, &free, false).unwrap();
    if !free.rows().is_empty() {
        by = Box::new(WithPostStep::new(&free, by, projection(&free)));
    }
    let mut solver = Solver::new(&mut free, by, step, 0.0, q, &p).unwrap();
    count.set(0);
    solver.run(&mut free, time).unwrap();
    let without = count.get();

    let params = plan.default_params();
    let full = Counted::new(plan.with_contacts().interpreter(&params));
    let count = full.sweeps.clone();
    let mut system = WithContacts::new(ModeTable::new(full, plan.contacts()));
    let by: BoxedMethod<Timed> = catalogue::explicit(method, &system, false).unwrap();
    let by = WithPostStep::new(&system, by, projection(&system));
    let mut motion = Hybrid::new(&mut system, by, step, 0.0, q, &p).unwrap();
    count.set(0);
    motion.run(&mut system, time, &mut ()).unwrap();
    assert_eq!(motion.contact_statistics().events, 0);
    [count.get(), without]
}

#[test]
fn far_contacts_cost_a_twentieth_at_most() {
    for (name, scene) in [("quadruped", quadruped()), ("monopod", monopod()), ("fourbar", fourbar())] {
        for method in ["verner9", "dop853", "tsit5"] {
            for tolerance in [1e-9, 1e-12] {
                let [with, without] = sweeps(&scene, method, tolerance, 1.0);
                println!("{name} {method} {tolerance:e}: {with} sweeps, {without} without contacts");
                assert!(20 * with <= 21 * without, "{name} {method} {tolerance:e}: {with} {without}");
            }
        }
    }
}

#[derive(Default)]
struct Landings(Vec<(f64, usize)>);

impl ContactObserver<ModeTable<Counted>> for Landings {
    fn event(&mut self, _system: &mut Timed, event: &ContactEvent<f64>) {
        self.0.push((event.time, event.contact));
    }
}

#[test]
fn what_is_not_looked_at_changes_nothing() {
    let (plan, q, v) = quadruped();
    let events = [false, true].map(|silent| {
        let mut full = Counted::new(plan.with_contacts().interpreter(&plan.default_params()));
        full.silent = silent;
        let count = full.sweeps.clone();
        let mut mechanism = ModeTable::new(full, plan.contacts());
        let mut p = v.clone();
        mechanism.conjugate_momenta(&q, &v, &mut p);
        let mut system = WithContacts::new(mechanism);
        let by = WithPostStep::new(&system, Verner9::new(&system), projection(&system));
        let step = Step::Adaptive(Tolerances::new(1e-12));
        let mut motion = Hybrid::new(&mut system, by, step, 0.0, &q, &p).unwrap();
        let mut landings = Landings::default();
        while landings.0.len() < 3 {
            motion.advance(&mut system, 3.0, &mut landings).unwrap();
        }
        (landings.0, count.get())
    });
    let [(found, few), (other, many)] = events;
    // It falls for more than 1.7 s.
    assert!(found[0].0 > 1.7 && many > few + 300, "{found:?} {few} {many}");
    for (a, b) in found.iter().zip(&other) {
        assert!(a.1 == b.1 && (a.0 - b.0).abs() < 1e-13, "{found:?} {other:?}");
    }
}

/// Points of an ellipsoid, for a hull.
fn pebble(corners: u32) -> String {
    let point = |k: u32| {
        let (z, angle) = (1.0 - (2.0 * f64::from(k) + 1.0) / f64::from(corners), 2.4 * f64::from(k));
        let r = (1.0 - z * z).sqrt();
        format!("[{}, {}, {}]", 0.2 * r * angle.cos(), 0.15 * r * angle.sin(), 0.1 * z)
    };
    let points: Vec<String> = (0..corners).map(point).collect();
    format!("type = \"hull\"\nmost = {corners}\npoints = [{}]", points.join(", "))
}

/// A body `a` that floats, with a shape, and a shape on the ground.
fn thrown(still: &str, shape: &str) -> Plan {
    let text = format!(
        r#"
name = "thrown"
gravity = [0, 0, -9.81]
body = [{{ name = "a", mass = 0.7, inertia = [0.01, 0.02, 0.025] }}]
joint = [{{ name = "motion", type = "floating", child = "a" }}]
contact = [{{ name = "c", between = ["still", "a"], friction = 0.4, restitution = 0.1 }}]
[[shape]]
name = "still"
{still}
[[shape]]
name = "a"
body = "a"
{shape}
"#
    );
    Plan::new(&model(&text), 1e-9)
}

/// Events and the state after 1 s of a body that is thrown, and the numbers of rows whose gaps were computed and of looks.
fn followed(plan: &Plan, change: impl Fn(&mut Counted)) -> (Vec<(f64, usize)>, Vec<f64>, [u64; 2]) {
    let q = [0.05, 0.02, 0.7, 0.3_f64.sin(), 0.0, 0.0, 0.3_f64.cos()].to_vec();
    let v = vec![0.3, -0.2, 0.1, 1.0, 2.0, -1.5];
    let mut full = Counted::new(plan.with_contacts().interpreter(&plan.default_params()));
    change(&mut full);
    let counts = [full.rows.clone(), full.looks.clone()];
    let mut mechanism = ModeTable::new(full, plan.contacts());
    let mut p = v.clone();
    mechanism.conjugate_momenta(&q, &v, &mut p);
    let mut system = WithContacts::new(mechanism);
    let by = WithPostStep::new(&system, Verner9::new(&system), projection(&system));
    let step = Step::Adaptive(Tolerances::new(1e-9));
    let mut motion = Hybrid::new(&mut system, by, step, 0.0, &q, &p).unwrap();
    let mut events = Landings::default();
    motion.run(&mut system, 1.0, &mut events).unwrap();
    let mut end = q;
    motion.state(&system, &mut end, &mut p);
    (events.0, end, counts.map(|count| count.get()))
}

/// Boxes, hulls and rods that are thrown on boxes land, slide and roll bit for bit as where all gaps are computed at every look.
#[test]
fn gaps_that_are_not_computed_change_nothing() {
    for (name, shape) in [
        ("box", "type = \"box\"\nsize = [0.3, 0.2, 0.4]\nrounding = 0.01"),
        (
            "hull",
            "type = \"hull\"\npoints = [[0.1, 0, 0], [-0.1, 0.1, 0], [-0.1, -0.1, 0], [0, 0, 0.2]]\nrounding = 0.02",
        ),
        ("rod", "type = \"capsule\"\nradius = 0.05\nlength = 0.5"),
    ] {
        let plan = thrown("type = \"box\"\nsize = [0.6, 0.4, 0.4]", shape);
        let [(events, end, [few, _]), (others, other_end, [many, _])] =
            [false, true].map(|whole| followed(&plan, |full| full.whole = whole));
        println!("{name}: {} events, {few} rows of {many}, {:?} {:?}", events.len(), events.last(), others.last());
        assert!(events.len() > 5, "{name}: {}", events.len());
        assert!(events == others && end == other_end, "{name}: {end:?} {other_end:?}");
        assert!(4 * few < 3 * many, "{name}: {few} {many}");
    }
}

/// Bits of the events' times and of the last state of a motion that starts as a model says. `whole`: all gaps are computed
/// wherever some are asked for.
fn bits(plan: &Plan, (choice, step, time): (RegimeChoice, Step, f64), whole: bool) -> (Vec<u64>, Vec<u64>) {
    let mut full = Counted::new(plan.with_contacts().interpreter(&plan.default_params()));
    full.whole = whole;
    let (mut q, mut p) = (plan.start(), vec![0.0; plan.dims.nv]);
    let mut system = WithContacts::new(ModeTable::new(full, plan.contacts()));
    let [after, close] = [(); 2].map(|()| projection_by(&system, Stabilisation::default()));
    let (method, rules) = (WithPostStep::new(&system, Tsit5::new(&system), after), RegimeRules::new(choice, 1e-3));
    let mut motion = ContactMotion::new(&mut system, (method, step), close, rules, 0.0, (&q, &p)).unwrap();
    let mut events = Landings::default();
    motion.run(&mut system, time, &mut events).unwrap();
    motion.state(&system, &mut q, &mut p);
    (events.0.iter().map(|(time, _)| time.to_bits()).collect(), q.iter().chain(&p).map(|x| x.to_bits()).collect())
}

/// A quadruped falls and lies down on its knees' stops: what computes all gaps and what computes some of them give the same
/// bits, by events and by time steps.
#[test]
fn gaps_that_are_not_computed_change_no_bit() {
    let text = include_str!("../../../models/contacts/quadruped.toml");
    let plan = Plan::new(&model(&text.replace("start = [0, 0, 0.3,", "start = [0, 0, 0.43,")), 1e-9);
    let adaptive = Step::Adaptive(Tolerances::new(1e-7));
    for (of, least) in
        [((RegimeChoice::Automatic, adaptive, 3.6), 70), ((RegimeChoice::TimeSteps, Step::Fixed(2e-3), 3.0), 0)]
    {
        let [few, whole] = [false, true].map(|whole| bits(&plan, of, whole));
        assert!(few.0.len() >= least && few == whole, "{of:?}: {} {} events", few.0.len(), whole.0.len());
    }
}

/// A hull that is thrown on a floor: gaps alone are computed of corners that are open, and while a step is searched only those
/// that may have closed in it.
#[test]
fn few_rows_of_a_hull_are_computed() {
    let plan = thrown("type = \"plane\"", &pebble(50));
    let (events, _, [rows, looks]) = followed(&plan, |_| {});
    println!("{} events, {rows} rows in {looks} looks", events.len());
    assert!(events.len() > 5 && 4 * rows < looks * 150, "{rows} {looks}");
}

#[test]
fn a_box_that_spins_fast_lands_when_it_does_in_short_steps() {
    let text = r#"
name = "spinning_box"
gravity = [0, 0, -9.81]
body = [{ name = "box", mass = 1, inertia = [0.01, 0.02, 0.025] }]
joint = [{ name = "motion", type = "floating", child = "box" }]
shape = [{ name = "floor", type = "plane" }, { name = "skin", body = "box", type = "box", size = [0.2, 0.3, 0.4] }]
contact = [{ name = "c", between = ["floor", "skin"] }]
"#;
    for spin in [[50.0, 0.0, 0.0], [0.0, 50.0, 0.1], [30.0, 30.0, 26.0]] {
        let landing = |longest: f64| {
            let v = [[0.3, 0.0, 0.0], spin].concat();
            let mut scene = Scene::new(model(text), &[0.0, 0.0, 20.0, 0.0, 0.0, 0.0, 1.0], &v);
            scene.tolerance = 1e-12;
            scene.start();
            if let Some(motion) = &mut scene.motion {
                motion.limits_mut().max_step = longest;
            }
            while scene.events.0.is_empty() {
                scene.advance(3.0);
            }
            (scene.events.0[0].time, scene.events.0[0].contact)
        };
        let ([free, short], contacts) = {
            let [a, b] = [f64::INFINITY, 1e-3].map(landing);
            ([a.0, b.0], [a.1, b.1])
        };
        assert_eq!(contacts[0], contacts[1]);
        assert!((free - short).abs() < 1e-10, "{spin:?}: {free} {short}");
    }
}

/// Lowers the least times, s, by those to make a motion of a system ready and to run it.
fn timed<Y, M>(least: &mut [f64; 2], system: &mut Y, make: impl Fn(&mut Y) -> M, run: impl Fn(&mut M, &mut Y)) {
    let start = Instant::now();
    let mut motion = make(system);
    let ready = Instant::now();
    run(&mut motion, system);
    let end = Instant::now();
    for (least, time) in least.iter_mut().zip([ready - start, end - ready]) {
        *least = least.min(time.as_secs_f64());
    }
}

/// Least times of a motion in machine code, s, in turns: without contacts, with contacts that are not minded, with contacts. First
/// the time to make the motion ready, then that of its steps.
fn times((plan, q, v): &(Plan, Vec<f64>, Vec<f64>), time: f64, rounds: u32) -> [[f64; 2]; 3] {
    type Contacts = WithContacts<ModeTable<Compiled>>;
    let step = Step::Adaptive(Tolerances::new(1e-9));
    let mut free = Compiled::from_plan(plan.clone(), Options::default().of_model(true)).unwrap();
    let mut p = v.clone();
    free.conjugate_momenta(q, v, &mut p);
    let mut system = WithContacts::new(plan.compiled_with_contacts::<f64>(&Options::default(), 10).unwrap());
    let mut least = [[f64::INFINITY; 2]; 3];
    for _ in 0..rounds {
        let solver = |free: &mut Compiled| {
            let by: BoxedMethod<Compiled> = catalogue::explicit("verner9", free, false).unwrap();
            Solver::new(free, by, step, 0.0, q, &p).unwrap()
        };
        timed(&mut least[0], &mut free, solver, |motion, free| motion.run(free, time).unwrap());
        let method =
            |system: &Contacts| -> BoxedMethod<Contacts> { catalogue::explicit("verner9", system, false).unwrap() };
        let solver = |system: &mut Contacts| Solver::new(system, method(system), step, 0.0, q, &p).unwrap();
        timed(&mut least[1], &mut system, solver, |motion, system| motion.run(system, time).unwrap());
        let hybrid = |system: &mut Contacts| {
            let by = WithPostStep::new(system, method(system), projection(system));
            Hybrid::new(system, by, step, 0.0, q, &p).unwrap()
        };
        timed(&mut least[2], &mut system, hybrid, |motion, system| {
            motion.run(system, time, &mut ()).unwrap();
            assert_eq!(motion.contact_statistics().events, 0);
        });
    }
    least
}

/// `cargo test --release -p mbd-testing --test contacts times_of_far -- --ignored --nocapture`
#[test]
#[ignore = "times"]
fn times_of_far_contacts() {
    for (name, scene) in [("quadruped", quadruped()), ("monopod", monopod())] {
        let [free, unseen, seen] = times(&scene, 1.0, 500).map(|times| times.map(|x| 1e6 * x));
        println!(
            "{name}: {:.1} µs without contacts, {:.1} µs with contacts that are not minded, {:.1} µs with contacts: {:.3} of \
             the first, {:.3} of the second; made ready before in {:.1}, {:.1} and {:.1} µs",
            free[1],
            unseen[1],
            seen[1],
            seen[1] / free[1],
            seen[1] / unseen[1],
            free[0],
            unseen[0],
            seen[0]
        );
    }
}
