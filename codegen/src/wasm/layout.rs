//! The memory of a module: where every array is.

use super::number::Number;
use super::sines;
use crate::code::Code;
use crate::emit::fields::fields;
use crate::emit::Input;
use crate::lower::Memory;
use crate::output::OutputProgram;

/// Arrays start at multiples of this, bytes: a vector.
const ALIGNMENT: usize = 16;

/// Size of a page of memory, bytes.
pub const PAGE: usize = 1 << 16;

/// An array in the memory.
#[derive(Clone, Debug)]
pub struct Area {
    pub name: &'static str,
    /// What it is; empty where the function says so.
    pub doc: &'static str,
    /// Lengths, the outermost first; the last one is that of the lanes where there are several.
    pub dims: Vec<usize>,
    /// Address, bytes.
    pub offset: usize,
}

impl Area {
    /// Number of entries.
    pub fn len(&self) -> usize {
        self.dims.iter().product()
    }
}

/// Arrays of a function that only it uses.
#[derive(Clone, Debug)]
pub struct FunctionAreas {
    pub results: Vec<Area>,
    /// Addresses of the tables of rolled code.
    pub tables: Vec<usize>,
    pub memory: Memory,
}

/// Where every array is.
#[derive(Clone, Debug)]
pub struct Layout {
    /// What functions compute with: the number of one state, or a vector of those of several.
    pub number: Number,
    /// Inputs of all functions, arguments first. Those without entries are left out.
    pub inputs: Vec<Area>,
    /// In the order of the programs.
    pub functions: Vec<FunctionAreas>,
    /// Working memory, which all functions share.
    pub work: usize,
    /// The table of 2/π.
    pub two_over_pi: usize,
    /// Addresses and contents of what is not zero at the start.
    pub data: Vec<(usize, Vec<u8>)>,
    /// End of all, bytes.
    pub len: usize,
}

impl Layout {
    /// The memory for some functions, from the address `base` on.
    pub fn new(input: &Input, programs: &[&OutputProgram<Code>], number: Number, base: usize) -> Layout {
        let (inputs, functions, data) = Default::default();
        let mut layout = Layout { number, inputs, functions, work: 0, two_over_pi: 0, data, len: base };
        layout.inputs(input, programs);
        for program in programs {
            let results = program.spec.results.iter().map(|array| {
                let dims = array.lengths(&input.programs.sizes);
                let offset = layout.reserve(number.bytes() * dims.iter().product::<usize>());
                Area { name: array.name, doc: "", dims: layout.with_lanes(dims), offset }
            });
            let results = results.collect();
            // Angles fill vectors.
            let memory =
                Memory::new(&program.program, &[], Number::vector(number.precision()).lanes() / number.lanes(), 1);
            layout.functions.push(FunctionAreas { results, tables: Vec::new(), memory });
        }
        let work = layout.functions.iter().map(|function| function.memory.len()).max().unwrap_or(0);
        layout.work = layout.reserve(number.bytes() * work);
        for (k, program) in programs.iter().enumerate() {
            let Code::Rolled(rolled) = &program.program else { continue };
            for run in &rolled.loops {
                let table = layout.constants(&run.table.concat());
                layout.functions[k].tables.push(table);
            }
        }
        let table = sines::table();
        layout.two_over_pi = layout.reserve(table.len());
        layout.data.push((layout.two_over_pi, table));
        layout
    }

    /// Inputs of any of the functions, with the values that they have at the start.
    fn inputs(&mut self, input: &Input, programs: &[&OutputProgram<Code>]) {
        let (plan, sizes) = (input.plan, &input.programs.sizes);
        let arguments = [
            ("q", "Coordinates, at the start those of the model."),
            ("p", "Momenta."),
            ("v", "Velocities."),
            ("a", "Accelerations."),
        ];
        for (name, doc) in arguments {
            let mut taken = programs.iter().flat_map(|program| program.spec.inputs);
            let Some(array) = taken.find(|array| array.name == name && array.len(sizes) > 0) else { continue };
            let value = if name == "q" { plan.start() } else { vec![0.0; array.len(sizes)] };
            self.input_area(name, doc, array.lengths(sizes), &value);
        }
        for field in fields(plan, sizes) {
            let value = field.values();
            self.input_area(field.name, field.doc, field.dims, &value);
        }
    }

    /// An input, with the same value in all lanes.
    fn input_area(&mut self, name: &'static str, doc: &'static str, dims: Vec<usize>, value: &[f64]) {
        let lanes = self.number.lanes();
        let value: Vec<f64> = value.iter().flat_map(|x| std::iter::repeat_n(*x, lanes)).collect();
        let (offset, dims) = (self.constants(&value), self.with_lanes(dims));
        self.inputs.push(Area { name, doc, dims, offset });
    }

    /// Lengths of an array that has some lengths for one state.
    fn with_lanes(&self, mut dims: Vec<usize>) -> Vec<usize> {
        dims.extend((self.number.lanes() > 1).then_some(self.number.lanes()));
        dims
    }

    /// Reserves memory.
    fn reserve(&mut self, bytes: usize) -> usize {
        let offset = self.len;
        self.len += bytes.next_multiple_of(ALIGNMENT);
        offset
    }

    /// Reserves memory that holds some numbers at the start.
    fn constants(&mut self, numbers: &[f64]) -> usize {
        let number = Number::scalar(self.number.precision());
        let offset = self.reserve(number.bytes() * numbers.len());
        if numbers.iter().any(|x| *x != 0.0) {
            let bytes = numbers.iter().flat_map(|x| match number {
                Number::F32 => (*x as f32).to_le_bytes().to_vec(),
                _ => x.to_le_bytes().to_vec(),
            });
            self.data.push((offset, bytes.collect()));
        }
        offset
    }

    /// The address of an input array; 0 of one without entries.
    pub fn input(&self, name: &str) -> usize {
        self.inputs.iter().find(|area| area.name == name).map_or(0, |area| area.offset)
    }
}
