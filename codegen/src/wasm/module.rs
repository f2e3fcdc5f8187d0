//! The binary module: functions, memory, data.

use wasm_encoder::{
    CodeSection, ConstExpr, DataSection, EntityType, ExportKind, ExportSection, Function, FunctionSection,
    ImportSection, MemorySection, MemoryType, Module, TypeSection,
};

use super::body::Body;
use super::instructions::{Addresses, SineFunctions, Writer};
use super::layout::{Layout, PAGE};
use super::number::Number;
use super::sines;
use crate::code::Code;
use crate::lower::lower;
use crate::output::OutputProgram;

/// Name of the exported memory.
pub const MEMORY: &str = "memory";

/// Name of the module from which a memory is imported.
pub const HOST: &str = "host";

/// A module that exports one function for each program, and its memory, or imports that of its host.
pub fn module(layout: &Layout, programs: &[&OutputProgram<Code>], imported: bool) -> Vec<u8> {
    let precision = layout.number.precision();
    let count = programs.len() as u32;
    let functions = SineFunctions { one: count, vector: count + 1 };
    let numbers = [Number::scalar(precision), Number::vector(precision)];
    let mut code = CodeSection::new();
    let mut has_sines = false;
    for (k, program) in programs.iter().enumerate() {
        let (function, calls_sines) = body(layout, k, program, functions);
        code.function(&function);
        has_sines |= calls_sines;
    }
    let (mut types, mut indices) = (TypeSection::new(), FunctionSection::new());
    types.ty().function([], []);
    for _ in programs {
        indices.function(0);
    }
    if has_sines {
        for (index, number) in (1..).zip(numbers) {
            types.ty().function([number.ty()], [number.ty(); 2]);
            indices.function(index);
            code.function(&sines::function(number, functions, layout.two_over_pi));
        }
    }
    let pages = layout.len.div_ceil(PAGE) as u64;
    let mut memories = MemorySection::new();
    // As it cannot grow, views of it remain valid.
    memories.memory(MemoryType {
        minimum: pages,
        maximum: Some(pages),
        memory64: false,
        shared: false,
        page_size_log2: None,
    });
    let mut imports = ImportSection::new();
    let host = MemoryType { minimum: pages, maximum: None, memory64: false, shared: false, page_size_log2: None };
    imports.import(HOST, MEMORY, EntityType::Memory(host));
    let mut exports = ExportSection::new();
    if !imported {
        exports.export(MEMORY, ExportKind::Memory, 0);
    }
    for (k, program) in (0..).zip(programs) {
        exports.export(program.spec.name, ExportKind::Func, k);
    }
    let mut data = DataSection::new();
    for (offset, bytes) in &layout.data {
        data.active(0, &ConstExpr::i32_const(*offset as i32), bytes.iter().copied());
    }
    let mut module = Module::new();
    module.section(&types);
    match imported {
        true => module.section(&imports).section(&indices),
        false => module.section(&indices).section(&memories),
    };
    module.section(&exports).section(&code).section(&data);
    module.finish()
}

/// The function of program `k`, and whether it calls a function for sines.
fn body(layout: &Layout, k: usize, program: &OutputProgram<Code>, functions: SineFunctions) -> (Function, bool) {
    let areas = &layout.functions[k];
    let addresses = Addresses {
        inputs: program.inputs.iter().map(|array| layout.input(array.name)).collect(),
        results: areas.results.iter().map(|area| area.offset).collect(),
        tables: areas.tables.clone(),
        work: layout.work,
        memory: areas.memory.clone(),
    };
    let (body, _) = Body::new(&[]);
    let mut writer = Writer::new(body, layout.number, &addresses, functions);
    let lengths: Vec<usize> = areas.results.iter().map(|area| area.len() / layout.number.lanes()).collect();
    lower(&mut writer, program, &lengths, &[]);
    (writer.body.finish(&[]), writer.calls_sines)
}
