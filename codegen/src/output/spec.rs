//! The specification of an output: arguments and results of its function, the models that have it, the search that it
//! uses.

/// The dimensions and the numbers behind them, from one list.
macro_rules! dimensions {
    ($(#[doc = $doc:literal] $dim:ident, $size:ident, $text:literal;)+) => {
        /// A dimension of an array. A model gives it a number: [`Sizes`].
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[non_exhaustive]
        pub enum Dim {
            $(#[doc = $doc] $dim,)+
            /// The same for every model.
            Const(usize),
        }

        impl Dim {
            /// As documentation writes it: `NV`, `6`.
            pub fn text(self) -> String {
                match self {
                    $(Dim::$dim => $text.to_string(),)+
                    Dim::Const(n) => n.to_string(),
                }
            }

            /// What it is, as a sentence; nothing for numbers that are the same for every model.
            pub(crate) fn meaning(self) -> &'static str {
                match self {
                    $(Dim::$dim => $doc.trim_ascii(),)+
                    Dim::Const(_) => "",
                }
            }
        }

        /// The numbers behind [`Dim`] for one model and the frames that were chosen.
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
        pub struct Sizes {
            $(#[doc = $doc] pub $size: usize,)+
        }

        impl Sizes {
            /// The same number everywhere.
            pub fn uniform(n: usize) -> Sizes {
                Sizes { $($size: n,)+ }
            }

            /// The number of a dimension.
            pub fn of(&self, dim: Dim) -> usize {
                match dim {
                    $(Dim::$dim => self.$size,)+
                    Dim::Const(n) => n,
                }
            }
        }
    };
}

dimensions! {
    /// Number of coordinates.
    Nq, nq, "NQ";
    /// Number of velocities, momenta, joint forces.
    Nv, nv, "NV";
    /// Number of joints with reactions.
    Joints, joints, "JOINTS";
    /// Number of chosen frames.
    Frames, frames, "FRAMES";
    /// Number of rows of the constraints.
    Rows, rows, "ROWS";
    /// Number of entries of the constraints' Jacobian that can be other than zero.
    Entries, entries, "ENTRIES";
    /// Number of run-time parameters.
    Params, params, "PARAMS";
    /// Number of dynamic parameters, the columns of the regressor.
    Parameters, parameters, "PARAMETERS";
    /// Number of joint forces that are inputs.
    Efforts, efforts, "EFFORTS";
    /// Number of prescribed positions.
    DriveQ, drive_q, "DRIVE_Q";
    /// Number of prescribed rates.
    DriveV, drive_v, "DRIVE_V";
    /// Number of external wrenches.
    Wrenches, wrenches, "WRENCHES";
    /// Three where gravity is an input.
    Gravity, gravity, "GRAVITY";
    /// Number of rows of the constraints where inputs say which of them act.
    Acts, acts, "ACTS";
}

/// An argument of a generated function, an array: its name and its lengths, the outermost first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Array {
    /// Its name in the generated code.
    pub name: &'static str,
    /// Its lengths.
    pub dims: &'static [Dim],
}

impl Array {
    pub(super) const fn new(name: &'static str, dims: &'static [Dim]) -> Array {
        Array { name, dims }
    }

    /// Lengths for one model.
    pub fn lengths(&self, sizes: &Sizes) -> Vec<usize> {
        self.dims.iter().map(|dim| sizes.of(*dim)).collect()
    }

    /// Number of its entries for one model.
    pub fn len(&self, sizes: &Sizes) -> usize {
        self.lengths(sizes).iter().product()
    }
}

/// An input of every function besides its arguments: a field of the generated type, which exists if it has entries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Field {
    /// The array.
    pub array: Array,
    /// What it is.
    pub doc: &'static str,
}

impl Field {
    pub(super) const fn new(name: &'static str, dims: &'static [Dim], doc: &'static str) -> Field {
        Field { array: Array::new(name, dims), doc }
    }
}

/// The models that have an output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Availability {
    /// Every model.
    Every,
    /// Models with constraints: loops or couplings.
    WithConstraints,
    /// Models without constraints.
    WithoutConstraints,
    /// Models with contacts, in code for their modes.
    WithContacts,
}

/// The search for eliminations that an output uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Search {
    /// That of every model, which makes the rates cheap.
    Rates,
    /// The one for accelerations.
    Accelerations,
    /// The one for the mass matrix.
    MassMatrix,
}

/// The specification of an output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Spec {
    /// Name of the generated function, and of the output in options.
    pub name: &'static str,
    /// Description of the function: one self-contained line, then details.
    pub(super) doc: &'static str,
    /// Arguments of the function: the coordinates, then momenta or velocities, then accelerations.
    pub inputs: &'static [Array],
    /// Results of the function, in order.
    pub results: &'static [Array],
    /// Whether the last result is returned; the others are written to arguments.
    pub returned: bool,
    /// A type of the runtime whose fields the results are in Rust, so that no two arrays can be exchanged: the one
    /// argument that is written. Its parameters are the shapes of the results, each once, in the order of the results.
    pub structure: Option<&'static str>,
    /// The models that have it.
    pub availability: Availability,
    /// The search that it uses.
    pub search: Search,
}

impl Spec {
    /// An output of every model that writes its results.
    pub(super) const fn new(name: &'static str, inputs: &'static [Array], results: &'static [Array]) -> Spec {
        let (availability, search) = (Availability::Every, Search::Rates);
        Spec { name, doc: "", inputs, results, returned: false, structure: None, availability, search }
    }

    pub(super) const fn returned(self) -> Spec {
        Spec { returned: true, ..self }
    }

    pub(super) const fn fields_of(self, structure: &'static str) -> Spec {
        Spec { structure: Some(structure), ..self }
    }

    pub(super) const fn only(self, availability: Availability) -> Spec {
        Spec { availability, ..self }
    }

    pub(super) const fn searched(self, search: Search) -> Spec {
        Spec { search, ..self }
    }

    /// Lines of the documentation; its first sentence stands for itself.
    pub fn doc(&self) -> impl Iterator<Item = &'static str> {
        self.doc.trim_end().lines().map(str::trim)
    }

    /// The shapes of the results, each once, in the order of the results.
    pub fn shapes(&self) -> Vec<&'static [Dim]> {
        let mut shapes = Vec::new();
        for array in self.results {
            if !shapes.contains(&array.dims) {
                shapes.push(array.dims);
            }
        }
        shapes
    }

    /// Whether it has one result for each chosen frame.
    pub fn of_frames(&self) -> bool {
        self.results.iter().any(|array| array.dims.contains(&Dim::Frames))
    }

    /// Whether a model with (or without) constraints has it, its contacts left aside.
    pub fn available(&self, constrained: bool) -> bool {
        match self.availability {
            Availability::Every => true,
            Availability::WithConstraints => constrained,
            Availability::WithoutConstraints => !constrained,
            Availability::WithContacts => false,
        }
    }
}
