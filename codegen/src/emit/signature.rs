//! Arguments and results of a generated function, and the arrays that its kernel reads and writes. Signatures are
//! printed from these types only.

use std::collections::BTreeSet;

use crate::output::{Array, InputArray, Sizes, Spec};

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

/// A generated function, printed as `fn NAME(&self, ARGUMENTS) -> RETURNED`.
pub struct Signature {
    /// Name of the function.
    pub name: String,
    /// Whether it is part of the type's interface; otherwise another function calls it.
    pub public: bool,
    /// Lines of its documentation.
    pub doc: Vec<&'static str>,
    /// Arguments after `&self`, in order.
    pub arguments: Vec<Port>,
    /// Returned arrays.
    pub returned: Option<Port>,
}

impl Signature {
    /// The signature of an output for one model.
    pub fn new(spec: &Spec, sizes: &Sizes) -> Signature {
        let ports =
            |arrays: &[Array], place| arrays.iter().map(move |a| Port::new(a, sizes, place)).collect::<Vec<_>>();
        let mut arguments = ports(spec.inputs, Place::Read);
        let returned = match spec.returned {
            true => ports(spec.results, Place::Returned).pop(),
            false => {
                arguments.extend(ports(spec.results, Place::Written));
                None
            }
        };
        Signature { name: spec.name.to_string(), public: true, doc: spec.doc().collect(), arguments, returned }
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
    pub fn declaration(&self, entry: &str) -> String {
        let arguments: Vec<String> = self.arguments.iter().map(|p| p.declaration(entry)).collect();
        let returned = self.returned.as_ref().map_or(String::new(), |p| format!(" -> {}", nested(&p.dims, entry)));
        format!("{}(&self, {}){returned}", self.name, arguments.join(", "))
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
        ports.extend(self.arguments.iter().filter(|port| port.written()).chain(&self.returned).cloned());
        ports
    }
}

/// An array type, `[[f64; 6]; 2]` for `[2, 6]`; of a value, an array that holds it everywhere.
pub fn nested(dims: &[usize], entry: &str) -> String {
    dims.iter().rev().fold(entry.to_string(), |inner, n| format!("[{inner}; {n}]"))
}
