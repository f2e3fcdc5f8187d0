//! Programs: the operations that were traced, those that are needed, and their order.

use std::collections::BTreeMap;
use std::io::Write;

use multibody::codegen::generate::quantity;
use multibody::codegen::generate::{InputArray, OutputProgram};
use multibody::codegen::plan::Plan;
use multibody::codegen::symbolic::{Op, Operand, Program, ProgramResult};

use crate::Outcome;

/// Operations the sweeps made and those that the output needs, by quantity. Sines and cosines count one each.
pub fn created(group: &OutputProgram<Program>, out: &mut dyn Write) -> Outcome {
    let program = &group.program;
    let mut live: BTreeMap<_, usize> = BTreeMap::new();
    for (_, op, (_, what)) in &program.steps {
        if !matches!(op, Op::Input(_)) {
            *live.entry(*what).or_default() += 1;
        }
    }
    writeln!(out, "{}", group.spec.name)?;
    writeln!(out, "  {:<48}{:>8}{:>8}", "operations", "made", "needed")?;
    let (mut made_all, mut live_all) = (0, 0);
    for (what, made) in &program.created {
        let live = live.get(what).copied().unwrap_or(0);
        made_all += made;
        live_all += live;
        let name = quantity(*what);
        let gap = " ".repeat(48_usize.saturating_sub(name.chars().count()));
        writeln!(out, "  {name}{gap}{made:>8}{live:>8}")?;
    }
    Ok(writeln!(out, "  {:<48}{made_all:>8}{live_all:>8}\n", "all")?)
}

/// The program, one operation a line.
pub fn statements(plan: &Plan, group: &OutputProgram<Program>, out: &mut dyn Write) -> Outcome {
    writeln!(out, "{}", group.spec.name)?;
    let mut inputs = BTreeMap::new();
    let places: Vec<String> = group.inputs.iter().flat_map(|a| (0..a.len()).map(move |k| place(a, k))).collect();
    for (id, op, _) in &group.program.steps {
        if let Op::Input(k) = op {
            inputs.insert(*id, places[*k as usize].clone());
        }
    }
    let name = |id: u32| inputs.get(&id).cloned().unwrap_or_else(|| format!("x{id}"));
    let operand = |o: &Operand| match o {
        Operand::Const(bits) => format!("{}", f64::from_bits(*bits)),
        Operand::Node(id) => name(*id),
    };
    let mut last = None;
    for (id, op, label) in &group.program.steps {
        let text = match op {
            Op::Input(_) => continue,
            Op::Add(a, b) => format!("{} + {}", operand(a), operand(b)),
            Op::Sub(a, b) => format!("{} - {}", operand(a), operand(b)),
            Op::Mul(a, b) => format!("{} * {}", operand(a), operand(b)),
            Op::Div(a, b) => format!("{} / {}", operand(a), operand(b)),
            Op::Fma(f) => {
                let (p, s) = (if f.minus_product { "-" } else { "" }, if f.minus_addend { '-' } else { '+' });
                format!("{p}{} * {} {s} {}", operand(&f.a), operand(&f.b), operand(&f.c))
            }
            Op::ReciprocalAbove(p) => {
                let minus = |minus: bool| if minus { "-" } else { "" };
                let (value, floor) = (operand(&p.value), operand(&p.floor));
                format!("1 / {}{value} above {}{floor}", minus(p.minus_value), minus(p.minus_floor))
            }
            Op::LookUp(look) => {
                let (sign, n) = (if look.minus { "-" } else { "" }, look.table.0.len());
                format!("entry {sign}{} + {} of {n} numbers", name(look.at), look.offset)
            }
            Op::Sqrt(a) => format!("sqrt({})", name(*a)),
            Op::Sin(a) => format!("sin({})", name(*a)),
            Op::Cos(a) => format!("cos({})", name(*a)),
        };
        if last != Some(*label) {
            let body = label.0.map_or("ground", |k| plan.nodes[k].name.as_str());
            writeln!(out, "  {body}: {}", quantity(label.1))?;
            last = Some(*label);
        }
        writeln!(out, "    x{id} = {text}")?;
    }
    writeln!(out, "  results, in order")?;
    for output in &group.program.outputs {
        match output {
            ProgramResult::Const(x) => writeln!(out, "    {x}")?,
            ProgramResult::Node(id, neg) => writeln!(out, "    {}{}", if *neg { "-" } else { "" }, name(*id))?,
        }
    }
    Ok(writeln!(out)?)
}

fn place(array: &InputArray, k: usize) -> String {
    match array.dims[..] {
        [_, n] => format!("{}[{}][{}]", array.name, k / n, k % n),
        _ => format!("{}[{k}]", array.name),
    }
}

/// The order: parts, values that are alive at the same time, longest chain.
pub fn schedule(group: &OutputProgram<Program>, chunk: usize, out: &mut dyn Write) -> Outcome {
    let steps = &group.program.steps;
    let statements = steps.iter().filter(|(_, op, _)| !matches!(op, Op::Input(_))).count();
    writeln!(out, "{}", group.spec.name)?;
    writeln!(out, "  order: that of the sweeps; every operation stands after its operands")?;
    let parts = statements.div_ceil(chunk).max(1);
    let parts = if parts == 1 { "one block".to_string() } else { format!("{parts} blocks of {chunk}") };
    writeln!(out, "  operations (sines and cosines one each): {statements}, in {parts}")?;
    let (most, at) = alive(group);
    let place = steps.get(at).map_or("", |(_, _, (_, what))| quantity(*what));
    writeln!(out, "  values alive at once, inputs left out: at most {most} (in: {place})")?;
    let depth = depth(group);
    let width = statements as f64 / depth.max(1) as f64;
    writeln!(
        out,
        "  longest chain of operations: {depth}; {width:.1} could run at once on average, each taking one step\n"
    )?;
    Ok(())
}

/// Largest number of values between their definition and their last use, and the step where it is reached.
fn alive(group: &OutputProgram<Program>) -> (usize, usize) {
    let steps = &group.program.steps;
    let mut last: BTreeMap<u32, usize> = BTreeMap::new();
    for (k, (_, op, _)) in steps.iter().enumerate() {
        for operand in op.operands() {
            if let Operand::Node(id) = operand {
                last.insert(id, k);
            }
        }
    }
    for output in &group.program.outputs {
        if let ProgramResult::Node(id, _) = output {
            last.insert(*id, steps.len());
        }
    }
    let mut ends = vec![0_usize; steps.len() + 1];
    let (mut now, mut most, mut at) = (0_usize, 0, 0);
    for (k, (id, op, _)) in steps.iter().enumerate() {
        // Operands that are read for the last time here free a register for the result.
        now -= ends[k];
        if matches!(op, Op::Input(_)) {
            continue;
        }
        now += 1;
        ends[last.get(id).copied().unwrap_or(k).max(k + 1).min(steps.len())] += 1;
        if now > most {
            (most, at) = (now, k);
        }
    }
    (most, at)
}

/// Length of the longest chain of operations.
fn depth(group: &OutputProgram<Program>) -> usize {
    let mut depth: BTreeMap<u32, usize> = BTreeMap::new();
    for (id, op, _) in &group.program.steps {
        let below = op.operands().map(|o| if let Operand::Node(k) = o { depth[&k] } else { 0 }).max().unwrap_or(0);
        depth.insert(*id, below + usize::from(!matches!(op, Op::Input(_))));
    }
    depth.into_values().max().unwrap_or(0)
}
