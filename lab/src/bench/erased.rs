//! A system behind a trait object, so that every method is compiled once for all scenes.

use crate::scenes::{Dynamics, Scene};
use multibody::runtime::system::LieJoint;
use multibody::runtime::{
    Accelerated, Conjugate, Differentiable, Energetic, Interpreter, Real, Scalar, StateDerivatives, System,
};

/// Lanes of the method that evaluates its stages at once.
const LANES: usize = 8;
/// Bytes of an array of velocities. Larger systems are evaluated one state after the other, because their code for lanes
/// takes long to compile.
const LARGEST: usize = 160;

/// The functions of a scene's system, on slices.
trait Calls<S> {
    /// As [`System::rates_in_lanes`], the rows of `LANES` numbers one after the other.
    fn rates_in_lanes(&mut self, q: &[S], p: &[S], qd: &mut [S], pd: &mut [S]) -> bool;
    fn rates(&mut self, t: S, q: &[S], p: &[S], qd: &mut [S], pd: &mut [S]);
    fn coordinate_rates(&mut self, q: &[S], v: &[S], qd: &mut [S]);
    fn energy(&mut self, q: &[S], p: &[S]) -> (S, S);
    fn accelerations(&mut self, q: &[S], v: &[S], a: &mut [S]);
    fn momenta(&mut self, q: &[S], v: &[S], p: &mut [S]);
}

/// A system with memory for one state in its own types.
struct Held<Y: System> {
    y: Y,
    q: Y::Coordinates,
    p: Y::Momenta,
    qd: Y::Coordinates,
    pd: Y::Momenta,
}

impl<Y: Dynamics> Held<Y> {
    fn take(&mut self, q: &[Y::Scalar], p: &[Y::Scalar]) {
        self.q.as_mut().copy_from_slice(q);
        self.p.as_mut().copy_from_slice(p);
    }
}

impl<Y: Dynamics> Calls<Y::Scalar> for Held<Y> {
    fn rates_in_lanes(&mut self, q: &[Y::Scalar], p: &[Y::Scalar], qd: &mut [Y::Scalar], pd: &mut [Y::Scalar]) -> bool {
        if const { size_of::<Y::Momenta>() > LARGEST } {
            return false;
        }
        let (q, p) = (q.as_chunks::<LANES>().0, p.as_chunks::<LANES>().0);
        let (qd, pd) = (qd.as_chunks_mut::<LANES>().0, pd.as_chunks_mut::<LANES>().0);
        // Scenes do not depend on time.
        self.y.rates_in_lanes(&[Y::Scalar::zero(); LANES], q, p, qd, pd)
    }

    fn rates(&mut self, t: Y::Scalar, q: &[Y::Scalar], p: &[Y::Scalar], qd: &mut [Y::Scalar], pd: &mut [Y::Scalar]) {
        self.take(q, p);
        self.y.rates_at(t, &self.q, &self.p, &mut self.qd, &mut self.pd);
        qd.copy_from_slice(self.qd.as_ref());
        pd.copy_from_slice(self.pd.as_ref());
    }

    fn coordinate_rates(&mut self, q: &[Y::Scalar], v: &[Y::Scalar], qd: &mut [Y::Scalar]) {
        self.take(q, v);
        self.y.coordinate_rates(&self.q, &self.p, &mut self.qd);
        qd.copy_from_slice(self.qd.as_ref());
    }

    fn energy(&mut self, q: &[Y::Scalar], p: &[Y::Scalar]) -> (Y::Scalar, Y::Scalar) {
        self.take(q, p);
        self.y.energies(&self.q, &self.p)
    }

    fn accelerations(&mut self, q: &[Y::Scalar], v: &[Y::Scalar], a: &mut [Y::Scalar]) {
        self.take(q, v);
        self.y.generalized_accelerations(&self.q, &self.p, &mut self.pd);
        a.copy_from_slice(self.pd.as_ref());
    }

    fn momenta(&mut self, q: &[Y::Scalar], v: &[Y::Scalar], p: &mut [Y::Scalar]) {
        self.take(q, v);
        self.y.conjugate_momenta(&self.q, &self.p, &mut self.pd);
        p.copy_from_slice(self.pd.as_ref());
    }
}

/// Rates and their derivatives, in vectors.
type Rows<S> = StateDerivatives<Vec<S>, Vec<Vec<S>>>;

/// Computes them at a time and a state.
type Derivatives<S> = Box<dyn FnMut(S, &[S], &[S], &mut Rows<S>)>;

fn derivatives<Y: Dynamics + Differentiable + 'static>(mut y: Y) -> Derivatives<Y::Scalar> {
    let (mut q, mut p, mut d) = (y.neutral(), y.zero_momenta(), y.zero_derivatives());
    Box::new(move |t, q_, p_, out| {
        q.as_mut().copy_from_slice(q_);
        p.as_mut().copy_from_slice(p_);
        y.rate_derivatives(t, &q, &p, &mut d);
        out.v.copy_from_slice(d.v.as_ref());
        out.pd.copy_from_slice(d.pd.as_ref());
        for (to, from) in out.blocks_mut().into_iter().flatten().zip(d.blocks().into_iter().flatten()) {
            for (to, from) in to.iter_mut().zip(from.as_ref()) {
                to.copy_from_slice(from.as_ref());
            }
        }
    })
}

/// The system of any scene.
pub struct Erased<S: Real> {
    calls: std::cell::RefCell<Box<dyn Calls<S>>>,
    interpreter: Interpreter<S>,
    /// Generated derivatives; where there are none, those of the interpreter.
    derivatives: Option<Derivatives<S>>,
}

impl<S: Real + 'static> Erased<S> {
    /// The scene's interpreter.
    pub fn interpreted(scene: &Scene) -> Self {
        Self::new(scene, scene.interpreter::<S>())
    }

    /// Wraps a system of the scene.
    pub fn new<Y: Dynamics<Scalar = S> + 'static>(scene: &Scene, y: Y) -> Self {
        let held = Held { q: y.neutral(), p: y.zero_momenta(), qd: y.neutral(), pd: y.zero_momenta(), y };
        let calls = std::cell::RefCell::new(Box::new(held) as Box<dyn Calls<S>>);
        Erased { calls, interpreter: scene.interpreter(), derivatives: None }
    }

    /// Adds the derivatives of another instance of the system.
    pub fn with_derivatives<Y: Dynamics<Scalar = S> + Differentiable + 'static>(self, y: Y) -> Self {
        Erased { derivatives: Some(derivatives(y)), ..self }
    }
}

impl<S: Real + 'static> System for Erased<S> {
    type Scalar = S;
    type Coordinates = Vec<S>;
    type Momenta = Vec<S>;

    fn neutral(&self) -> Vec<S> {
        self.interpreter.neutral()
    }

    fn zero_momenta(&self) -> Vec<S> {
        self.interpreter.zero_momenta()
    }

    fn lie_joints(&self) -> &[LieJoint] {
        self.interpreter.lie_joints()
    }

    fn rates_at(&mut self, t: S, q: &Vec<S>, p: &Vec<S>, qd: &mut Vec<S>, pd: &mut Vec<S>) {
        self.calls.get_mut().rates(t, q, p, qd, pd);
    }

    fn rates_in_lanes<const L: usize>(
        &mut self,
        _t: &[S; L],
        q: &[[S; L]],
        p: &[[S; L]],
        qd: &mut [[S; L]],
        pd: &mut [[S; L]],
    ) -> bool {
        let calls = self.calls.get_mut();
        L == LANES
            && calls.rates_in_lanes(q.as_flattened(), p.as_flattened(), qd.as_flattened_mut(), pd.as_flattened_mut())
    }

    fn coordinate_rates(&self, q: &Vec<S>, v: &Vec<S>, qd: &mut Vec<S>) {
        self.calls.borrow_mut().coordinate_rates(q, v, qd);
    }
}

impl<S: Real + 'static> Energetic for Erased<S> {
    fn energies(&mut self, q: &Vec<S>, p: &Vec<S>) -> (S, S) {
        self.calls.get_mut().energy(q, p)
    }
}

impl<S: Real + 'static> Accelerated for Erased<S> {
    fn generalized_accelerations(&mut self, q: &Vec<S>, v: &Vec<S>, a: &mut Vec<S>) {
        self.calls.get_mut().accelerations(q, v, a);
    }
}

impl<S: Real + 'static> Conjugate for Erased<S> {
    fn conjugate_momenta(&mut self, q: &Vec<S>, v: &Vec<S>, p: &mut Vec<S>) {
        self.calls.get_mut().momenta(q, v, p);
    }
}

impl<S: Real + 'static> Differentiable for Erased<S> {
    type Square = Vec<Vec<S>>;

    fn square(&self) -> Vec<Vec<S>> {
        self.interpreter.square()
    }

    fn rate_derivatives(&mut self, t: S, q: &Vec<S>, p: &Vec<S>, out: &mut Rows<S>) {
        match &mut self.derivatives {
            None => self.interpreter.rate_derivatives(t, q, p, out),
            Some(derivatives) => derivatives(t, q, p, out),
        }
    }
}
