//! Arguments and results of a generated function, and the arrays that its kernel reads and writes. Signatures are
//! printed from these types only.

use std::collections::BTreeSet;

use crate::output::{Array, Dim, InputArray, Sizes, Spec, STRUCTURE};

/// Role of an array in a function.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Place {
    /// An argument that is read.
    Read,
    /// An argument that is written.
    Written,
    /// A field of the type.
    Field,
    /// The returned value.
    Returned,
}

/// One array.
#[derive(Clone, Debug, PartialEq)]
pub struct Port {
    /// Its name.
    pub name: &'static str,
    /// Lengths, the outermost first.
    pub dims: Vec<usize>,
    place: Place,
}

impl Port {
    fn new(array: &Array, sizes: &Sizes, place: Place) -> Port {
        Port { name: array.name, dims: array.lengths(sizes), place }
    }

    /// Whether the kernel writes it.
    pub fn written(&self) -> bool {
        matches!(self.place, Place::Written | Place::Returned)
    }

    fn mutable(&self) -> &'static str {
        if self.written() {
            "mut "
        } else {
            ""
        }
    }

    /// Trait by which a kernel has access to it.
    pub fn access(&self) -> &'static str {
        if self.written() {
            "Write"
        } else {
            "Read"
        }
    }

    /// Type of the reference through which a kernel has access to it.
    pub fn reference(&self, ty: &str) -> String {
        format!("&{}{ty}", self.mutable())
    }

    /// As an argument of a function, its entries being of a type.
    pub fn declaration(&self, entry: &str) -> String {
        format!("{}: {}", self.name, self.reference(&nested(&self.dims, entry)))
    }

    /// As a parameter of the kernel.
    pub fn parameter(&self, runtime: &str, number: &str) -> String {
        let ty = format!("(impl {runtime}::kernel::{}<{number}> + ?Sized)", self.access());
        format!("{}: {}", self.name, self.reference(&ty))
    }

    /// Expression by which the function passes it to the kernel, as a flat slice.
    pub fn argument(&self) -> String {
        let flat = |place: &str, word: &str| {
            format!("{place}{}", format!(".as_flattened{word}()").repeat(self.dims.len().saturating_sub(1)))
        };
        match self.place {
            Place::Read => flat(self.name, ""),
            Place::Written => flat(self.name, "_mut"),
            Place::Field if self.dims.len() == 1 => format!("&self.{}", self.name),
            Place::Field => flat(&format!("self.{}", self.name), ""),
            Place::Returned => format!("&mut {}", self.name),
        }
    }
}

/// The argument whose fields the results are.
#[derive(Clone)]
pub struct Structure {
    /// Its type in the runtime.
    name: &'static str,
    /// Shapes of its fields, the parameters of the type.
    shapes: Vec<Vec<usize>>,
    /// Its fields.
    fields: Vec<Port>,
}

/// A generated function, printed as `fn NAME(&self, ARGUMENTS) -> RETURNED`.
pub struct Signature {
    /// Name of the function.
    pub name: String,
    /// Whether it is part of the type's interface; otherwise another function calls it.
    pub public: bool,
    /// Lines of its documentation.
    pub doc: Vec<&'static str>,
    /// Arguments after `&self` that are arrays, in order.
    arguments: Vec<Port>,
    /// The last argument, where results are its fields.
    structure: Option<Structure>,
    /// Returned arrays.
    pub returned: Option<Port>,
}

impl Signature {
    /// The signature of an output for one model.
    pub fn new(spec: &Spec, sizes: &Sizes) -> Signature {
        let ports =
            |arrays: &[Array], place| arrays.iter().map(move |a| Port::new(a, sizes, place)).collect::<Vec<_>>();
        let mut arguments = ports(spec.inputs, Place::Read);
        let (mut structure, mut returned) = (None, None);
        match spec.structure {
            _ if spec.returned => {
                let (last, others) = spec.results.split_last().map_or((None, &[][..]), |(x, rest)| (Some(x), rest));
                arguments.extend(ports(others, Place::Written));
                returned = last.map(|array| Port::new(array, sizes, Place::Returned));
            }
            None => arguments.extend(ports(spec.results, Place::Written)),
            Some(name) => {
                let lengths = |shape: &[Dim]| shape.iter().map(|dim| sizes.of(*dim)).collect();
                let shapes = spec.shapes().into_iter().map(lengths).collect();
                structure = Some(Structure { name, shapes, fields: ports(spec.results, Place::Written) });
            }
        }
        let (name, doc) = (spec.name.to_string(), spec.doc().collect());
        Signature { name, public: true, doc, arguments, structure, returned }
    }

    /// The same under another name, called by the function of the output.
    pub fn part(self, name: String) -> Signature {
        Signature { name, public: false, ..self }
    }

    /// Documentation, line by line.
    pub fn documentation(&self) -> String {
        self.doc.iter().map(|line| format!("    /// {line}\n")).collect()
    }

    /// `NAME(&self, ARGUMENTS) -> RETURNED`, the entries of arrays being of a type.
    pub fn declaration(&self, runtime: &str, entry: &str) -> String {
        let mut arguments: Vec<String> = self.arguments.iter().map(|p| p.declaration(entry)).collect();
        arguments.extend(self.structure.iter().map(|Structure { name, shapes, .. }| {
            let types: Vec<String> = shapes.iter().map(|dims| nested(dims, entry)).collect();
            format!("{STRUCTURE}: &mut {runtime}::{name}<{}>", types.join(", "))
        }));
        let returned = self.returned.as_ref().map_or(String::new(), |p| format!(" -> {}", nested(&p.dims, entry)));
        format!("{}(&self, {}){returned}", self.name, arguments.join(", "))
    }

    /// The arguments in a call with variables of the same names.
    pub fn names(&self) -> String {
        let names = self.arguments.iter().map(|port| port.name).chain(self.structure.iter().map(|_| STRUCTURE));
        names.collect::<Vec<_>>().join(", ")
    }

    /// The body around a call that writes the results: it makes the variables that the call takes, and returns what is
    /// returned. Entries of arrays are `zero` before.
    pub fn body(&self, runtime: &str, zero: &str, call: &str) -> String {
        let line = |text: &str| format!("        {text}\n");
        let structure = self.structure.as_ref().map_or(String::new(), |Structure { name, fields, .. }| {
            let fields: Vec<&str> = fields.iter().map(|port| port.name).collect();
            line(&format!("let {runtime}::{name} {{ {} }} = {STRUCTURE};", fields.join(", ")))
        });
        let [made, returned] = self.returned.as_ref().map_or_else(Default::default, |Port { name, dims, .. }| {
            [line(&format!("let mut {name} = {};", nested(dims, zero))), line(name)]
        });
        format!("{structure}{made}{}{returned}", line(&format!("{call};")))
    }

    /// What the kernel reads, the arrays of which an input is used, and what it writes, in the order of the results.
    pub fn ports(&self, inputs: &[InputArray], used: &BTreeSet<usize>) -> Vec<Port> {
        let mut ports = Vec::new();
        let mut first = 0;
        for array in inputs {
            let next = first + array.len();
            if used.range(first..next).next().is_some() {
                let place = if array.field { Place::Field } else { Place::Read };
                ports.push(Port { name: array.name, dims: array.dims.clone(), place });
            }
            first = next;
        }
        let fields = self.structure.iter().flat_map(|structure| &structure.fields);
        let written = self.arguments.iter().filter(|port| port.written());
        ports.extend(written.chain(fields).chain(&self.returned).cloned());
        ports
    }
}

/// An array type, `[[f64; 6]; 2]` for `[2, 6]`; of a value, an array that holds it everywhere.
pub fn nested(dims: &[usize], entry: &str) -> String {
    dims.iter().rev().fold(entry.to_string(), |inner, n| format!("[{inner}; {n}]"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::Output;

    fn of(output: Output) -> Signature {
        Signature::new(output.spec(), &Sizes::uniform(2))
    }

    #[test]
    fn derivatives_are_fields_of_one_argument() {
        assert_eq!(
            of(Output::Derivatives).declaration("rt", "f64"),
            "derivatives(&self, q: &[f64; 2], p: &[f64; 2], out: &mut rt::StateDerivatives<[f64; 2], [[f64; 2]; 2]>)"
        );
        assert_eq!(
            of(Output::MomentumDerivatives).declaration("rt", "[f32; LANES]"),
            "momentum_derivatives(&self, q: &[[f32; LANES]; 2], v: &[[f32; LANES]; 2], out: \
             &mut rt::MomentumDerivatives<[[f32; LANES]; 2], [[[f32; LANES]; 2]; 2]>)"
        );
        assert_eq!(of(Output::Derivatives).names(), "q, p, out");
        assert_eq!(
            of(Output::MomentumDerivatives).body("rt", "0.0", "call(p, pd)"),
            "        let rt::MomentumDerivatives { p, pd, dp_dq, dp_dv, dpd_dq, dpd_dv } = out;\n        call(p, pd);\n"
        );
    }

    #[test]
    fn shapes_are_parameters_of_the_type_even_where_their_lengths_are_one() {
        let one = Signature::new(Output::Derivatives.spec(), &Sizes::uniform(1));
        assert!(one.declaration("rt", "f64").ends_with("out: &mut rt::StateDerivatives<[f64; 1], [[f64; 1]; 1]>)"));
    }

    #[test]
    fn other_results_are_arguments_or_returned() {
        assert_eq!(
            of(Output::Rates).declaration("rt", "f64"),
            "rates(&self, q: &[f64; 2], p: &[f64; 2], qd: &mut [f64; 2], pd: &mut [f64; 2])"
        );
        let energy = of(Output::Energy);
        assert_eq!(energy.declaration("rt", "f64"), "energy(&self, q: &[f64; 2], p: &[f64; 2]) -> [f64; 2]");
        assert_eq!(
            energy.body("rt", "0.0", "call(&mut energy)"),
            "        let mut energy = [0.0; 2];\n        call(&mut energy);\n        energy\n"
        );
    }

    #[test]
    fn what_a_kernel_writes_does_not_depend_on_the_structure() {
        for output in [Output::Derivatives, Output::MomentumDerivatives] {
            let names: Vec<&str> = of(output).ports(&[], &BTreeSet::new()).iter().map(|port| port.name).collect();
            let results: Vec<&str> = output.spec().results.iter().map(|array| array.name).collect();
            assert_eq!(names, results);
        }
    }
}
