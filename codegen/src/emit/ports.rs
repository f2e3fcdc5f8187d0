//! What kernels read and write, for one state and for lanes.

use std::collections::BTreeSet;

use super::layout::Function;
use crate::symbolic::Op;
use crate::trace::OutputProgram;

/// One array.
#[derive(Clone, Debug, PartialEq)]
pub struct Port {
    /// Its name in the kernel.
    pub name: String,
    /// Lengths, the outermost first.
    pub dims: Vec<usize>,
    /// Whether it is written.
    pub mutable: bool,
    /// Whether it is what the function returns.
    pub returned: bool,
    /// How the function hands it to the kernel, as a flat list.
    pub argument: String,
}

impl Port {
    /// As a parameter of the kernel.
    pub fn parameter(&self, runtime: &str, number: &str) -> String {
        let (word, access) = if self.mutable { ("mut ", "Write") } else { ("", "Read") };
        format!("{}: &{word}(impl {runtime}::kernel::{access}<{number}> + ?Sized)", self.name)
    }

    /// As an argument of a function for lanes.
    pub fn lanes_declaration(&self, number: &str) -> String {
        let word = if self.mutable { "mut " } else { "" };
        format!("{}: &{word}{}", self.name, nested(&self.dims, &format!("[{number}; LANES]")))
    }
}

/// Name of an input array in a kernel.
pub fn local(name: &str) -> &str {
    name.trim_start_matches("self.")
}

/// An array type, `[[f64; 6]; 2]` for `[2, 6]`; of a value, an array that holds it everywhere.
pub fn nested(dims: &[usize], element: &str) -> String {
    dims.iter().rev().fold(element.to_string(), |inner, n| format!("[{inner}; {n}]"))
}

/// Lengths of an array type as signatures write it, `[[f64; 6]; 2]`.
pub fn dims(ty: &str) -> Vec<usize> {
    let lengths = ty.split(';').skip(1).filter_map(|n| n.trim().trim_end_matches(']').parse().ok());
    let mut dims: Vec<usize> = lengths.collect();
    dims.reverse();
    dims
}

/// An expression for a nested array as a flat list.
fn flat(place: &str, depth: usize, mutable: bool) -> String {
    let word = if mutable { "_mut" } else { "" };
    format!("{place}{}", format!(".as_flattened{word}()").repeat(depth.saturating_sub(1)))
}

/// Arguments of a function, as its signature declares them: `qd: &mut [f64; 6], m: &mut [[f64; 6]; 6]`.
pub fn declared(function: &Function) -> Vec<Port> {
    let declarations = function.arguments.split(", ").filter_map(|d| d.split_once(": &"));
    let port = |(name, ty): (&str, &str)| {
        let mutable = ty.starts_with("mut ");
        let dims = dims(ty);
        let argument = flat(name, dims.len(), mutable);
        Port { name: name.to_string(), dims, mutable, returned: false, argument }
    };
    declarations.map(port).collect()
}

/// Numbers of the inputs that are used.
fn used(group: &OutputProgram) -> BTreeSet<usize> {
    match &group.loops {
        Some(program) => program.used_inputs(),
        None => {
            let steps = group.program.steps.iter();
            steps.filter_map(|(_, op, _)| if let Op::Input(k) = op { Some(*k as usize) } else { None }).collect()
        }
    }
}

/// Inputs that are used, then outputs, in the order of the function's results.
pub fn ports(group: &OutputProgram, function: &Function) -> Vec<Port> {
    let used = used(group);
    let mut ports = Vec::new();
    let mut at = 0;
    for array in &group.inputs {
        let range = at..at + array.len;
        at = range.end;
        if used.range(range).next().is_none() {
            continue;
        }
        let dims = if array.sixes { vec![array.len / 6, 6] } else { vec![array.len] };
        let argument = match array.name.starts_with("self.") && !array.sixes {
            true => format!("&{}", array.name),
            false => flat(&array.name, dims.len(), false),
        };
        let name = local(&array.name).to_string();
        ports.push(Port { name, dims, mutable: false, returned: false, argument });
    }
    ports.extend(declared(function).into_iter().filter(|p| p.mutable));
    if let Some(ty) = function.returns.strip_prefix(" -> ") {
        let (name, argument) = ("result".to_string(), "&mut result".to_string());
        ports.push(Port { name, dims: dims(ty), mutable: true, returned: true, argument });
    }
    ports
}
