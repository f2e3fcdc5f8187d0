//! The inputs of generated functions as symbols.

use mbd_runtime::sweep::Inputs;

use crate::model::Gravity;
use crate::options::Options;
use crate::output::{Array, InputArray, Sizes, Spec, FIELDS};
use crate::plan::{Plan, RowsThatAct};
use crate::symbolic::{Expr, Graph};

/// Arrays of symbols with consecutively numbered entries.
struct Symbols<'g> {
    graph: &'g Graph,
    arrays: Vec<InputArray>,
    next: usize,
}

impl<'g> Symbols<'g> {
    fn array(&mut self, array: &Array, field: bool, sizes: &Sizes) -> Vec<Expr<'g>> {
        let array = InputArray::new(array, field, sizes);
        let first = self.next;
        self.next += array.len();
        self.arrays.push(array);
        (first..self.next).map(|k| self.graph.input(k)).collect()
    }
}

/// The inputs of a function as symbols.
pub(crate) struct SymbolicInputs<'g> {
    /// All input arrays, with consecutively numbered entries.
    pub arrays: Vec<InputArray>,
    /// Coordinates.
    pub q: Vec<Expr<'g>>,
    /// Momenta or velocities, whichever the function takes.
    pub second: Vec<Expr<'g>>,
    /// Accelerations, where the function takes them.
    pub third: Vec<Expr<'g>>,
    /// Joint forces.
    pub tau: Vec<Expr<'g>>,
    /// Prescribed positions, rates, accelerations.
    pub drive: [Vec<Expr<'g>>; 3],
    /// External wrenches.
    pub wrenches: Vec<[Expr<'g>; 6]>,
    /// Run-time parameters.
    pub params: Vec<Expr<'g>>,
    /// Gravity in ground axes.
    pub gravity: [Expr<'g>; 3],
    /// 1 for each row that acts, 0 for one that does not, where that is an input.
    pub acts: Vec<Expr<'g>>,
}

impl<'g> SymbolicInputs<'g> {
    /// Symbols for the arguments of a function and for the fields of the generated type.
    pub fn new(graph: &'g Graph, plan: &Plan, spec: &Spec, options: &Options) -> SymbolicInputs<'g> {
        let sizes = &sizes(plan, options, 0);
        let mut symbols = Symbols { graph, arrays: Vec::new(), next: 0 };
        let mut state =
            spec.inputs.iter().map(|array| symbols.array(array, false, sizes)).collect::<Vec<_>>().into_iter();
        let [q, second, third] = [0; 3].map(|_| state.next().unwrap_or_default());
        let [tau, drive_q, drive_v, drive_a, wrenches, params, acts, gravity] =
            FIELDS.map(|field| symbols.array(&field.array, true, sizes));
        let wrenches = wrenches.chunks(6).map(|c| std::array::from_fn(|k| c[k])).collect();
        let gravity = plan.gravity_or(&params, || std::array::from_fn(|k| gravity[k]));
        let drive = [drive_q, drive_v, drive_a];
        SymbolicInputs { arrays: symbols.arrays, q, second, third, tau, drive, wrenches, params, gravity, acts }
    }

    /// Number of the first entry of an array.
    pub fn first_of(&self, name: &str) -> usize {
        self.arrays.iter().take_while(|array| array.name != name).map(InputArray::len).sum()
    }

    /// The inputs in the form that the sweeps take.
    pub fn inputs(&self) -> Inputs<'_, Expr<'g>> {
        let [drive_q, drive_v, drive_a] = &self.drive;
        Inputs { tau: &self.tau, drive_q, drive_v, drive_a, wrenches: &self.wrenches, gravity: self.gravity }
    }
}

/// Lengths of all arrays of a generated type.
pub fn sizes(plan: &Plan, options: &Options, frames: usize) -> Sizes {
    let dims = plan.dims;
    Sizes {
        nq: dims.nq,
        nv: dims.nv,
        joints: plan.joint_nodes.len(),
        frames,
        rows: dims.rows,
        entries: plan.entry_columns().len(),
        params: plan.model.params.len(),
        parameters: plan.parameter_names().len(),
        efforts: if options.efforts { dims.nv } else { 0 },
        drive_q: dims.drive_q,
        drive_v: dims.drive_v,
        wrenches: dims.wrenches,
        gravity: if plan.model.gravity == Gravity::Input { 3 } else { 0 },
        acts: if matches!(plan.acts, RowsThatAct::Input) { dims.rows } else { 0 },
    }
}
