//! `mbd view --gltf`: a motion as glTF 2.0, for other viewers.
//!
//! The document is written by hand, because it is a page of JSON: `gltf-json` has types for all of the standard, and of these
//! a dozen would be used.

use std::collections::{BTreeMap, HashMap};
use std::io::Write;
use std::path::Path;

use multibody::codegen::model::{ShapeKind, Value};
use multibody::codegen::options::PlanOptions;
use multibody::codegen::plan::Plan;
use multibody::codegen::read::ImportOptions;
use multibody::runtime::constrained::Stabilisation;
use multibody::runtime::contact::{ImpactOrder, RegimeChoice, RegimeRules};
use multibody::runtime::integrate::Step;
use multibody::runtime::sweep::FrameState;
use multibody::runtime::transfer::quaternion;
use serde_json::{json, Value as Json};

use super::base64;
use crate::args::ViewArgs;
use crate::ink::{channels, LIGHT};
use crate::motion::{self, Record, Settings};
use crate::output::{writable, write_files};
use crate::picture::{flesh, limbs, plate, shapes, towards, Directions, Mesh, Shapes};
use crate::start::{default_start, default_velocity};
use crate::{contacts, loops, source, Failure, Outcome};

/// Pictures of the motion in a second.
const RATE: f64 = 30.0;

/// Writes the motion of a model.
pub fn run(args: &ViewArgs, model: &Path, file: &Path, out: &mut dyn Write) -> Outcome {
    let binary = match file.extension().and_then(|e| e.to_str()) {
        Some("glb") => true,
        Some("gltf") => false,
        _ => {
            let what = format!("--gltf {}: the name ends with neither `.gltf` nor `.glb`", file.display());
            return Err(Failure::new(what, "`.glb` is the binary form, which is smaller"));
        }
    };
    let options = args.touch(args.import.import());
    let plan = source::planned(&source::model(model, &options, None)?, PlanOptions::quick()).plan;
    writable(file)?;
    let record = moved(model, &plan, args.time)?;
    let document = Document::of(&plan, &record);
    let bytes = if binary { document.glb() } else { document.gltf().into_bytes() };
    write_files(&[(file, &bytes)])?;
    let (shown, size, count) = (file.display(), bytes.len() / 1000, record.t.len());
    Ok(writeln!(out, "{shown}: {size} kB, {count} instants in {} s", args.time)?)
}

impl ViewArgs {
    /// The options of the readers, with the floor.
    fn touch(&self, import: ImportOptions) -> ImportOptions {
        ImportOptions { floor: super::floor(self.floor), ..import }
    }
}

/// The motion from the default start.
fn moved(path: &Path, plan: &Plan, time: f64) -> Outcome<Record> {
    let settings = Settings {
        method: "rk4",
        step: Step::Fixed(1e-3),
        time,
        every: 1.0 / RATE,
        project: false,
        hold: Stabilisation::default(),
        interpreted: false,
        regimes: RegimeRules::new(RegimeChoice::Automatic, 1e-3),
        impacts: ImpactOrder::default(),
        control: None,
    };
    let (mut q, mut v) = (default_start(plan), default_velocity(plan));
    if !plan.model.constraints.is_empty() {
        let mut interpreter = plan.default_interpreter();
        q = loops::assemble(path, plan, &mut interpreter, &q)?.q;
        v = loops::velocities(plan, &mut interpreter, &q, &v, false)?;
    }
    match plan.model.contacts.is_empty() {
        true => motion::simulate(plan, (q, v), &settings),
        false => Ok(contacts::simulate(plan, (q, v), &settings, false)?.record),
    }
}

/// A document and its buffer.
#[derive(Default)]
struct Document {
    buffer: Vec<u8>,
    views: Vec<Json>,
    accessors: Vec<Json>,
    meshes: Vec<Json>,
    nodes: Vec<Json>,
    samplers: Vec<Json>,
    channels: Vec<Json>,
    /// Node of each frame that carries something.
    frames: BTreeMap<Option<usize>, usize>,
    name: String,
}

impl Document {
    /// The motion of a plan's mechanism.
    fn of(plan: &Plan, record: &Record) -> Document {
        let mut document = Document { name: plan.model.name.clone(), ..Document::default() };
        let upright = json!([-std::f64::consts::FRAC_1_SQRT_2, 0.0, 0.0, std::f64::consts::FRAC_1_SQRT_2]);
        document.nodes.push(json!({ "name": plan.model.name, "rotation": upright, "children": [] }));
        let (all, drawn) = (Directions::default(), Shapes::new(plan));
        let bodies: Vec<_> = drawn.bodies().into_iter().filter(|(_, line)| !line.points.is_empty()).collect();
        let size = bodies.iter().flat_map(|(_, l)| l.points.iter().flatten()).fold(1e-3, |m: f64, x| m.max(x.abs()));
        for (frame, line) in &bodies {
            let wire = if line.radius > 0.0 { line.radius } else { 0.004 * size };
            let mesh = if line.closed { plate(&line.points) } else { all.hull(&line.points, wire) };
            document.carried(plan, *frame, &mesh, line.colour, None);
        }
        let params = plan.default_params();
        let number = |v: Value| match v {
            Value::Const(x) => x,
            Value::Param(k) => params[k],
        };
        let colours = limbs::colours(&plan.model, &number);
        for shape in &plan.model.shapes {
            let frame =
                shape.mount.body.and_then(|b| plan.frames.iter().position(|f| f.name == plan.model.bodies[b].name));
            let turn = flesh::rotation(&shape.mount.placement.rotation, &number);
            let pose = (quaternion(&turn), shape.mount.placement.xyz.map(number));
            let colour = shape.mount.body.map(|b| colours[b]);
            document.carried(plan, frame, &all.shape(&shape.kind), colour, Some(pose));
        }
        document.animate(plan, record, &drawn, &all);
        document
    }

    /// A mesh that a frame carries, at a pose in it.
    fn carried(
        &mut self,
        plan: &Plan,
        frame: Option<usize>,
        mesh: &Mesh,
        colour: Option<usize>,
        pose: Option<([f64; 4], [f64; 3])>,
    ) {
        if mesh.is_empty() {
            return;
        }
        let holder = self.holder(plan, frame);
        let mesh = self.mesh(mesh, colour);
        let mut node = json!({ "mesh": mesh });
        if let Some((rotation, translation)) = pose {
            node["rotation"] = json!(rotation);
            node["translation"] = json!(translation);
        }
        self.child(holder, node);
    }

    /// Adds a node below another; returns its index.
    fn child(&mut self, parent: usize, node: Json) -> usize {
        let index = self.nodes.len();
        self.nodes.push(node);
        if let Some(children) = self.nodes[parent]["children"].as_array_mut() {
            children.push(json!(index));
        }
        index
    }

    /// The node of a frame.
    fn holder(&mut self, plan: &Plan, frame: Option<usize>) -> usize {
        if let Some(node) = self.frames.get(&frame) {
            return *node;
        }
        let name = frame.map_or("ground", |f| plan.frames[f].name.as_str());
        let node = self.child(0, json!({ "name": name, "children": [] }));
        self.frames.insert(frame, node);
        node
    }

    /// Adds numbers to the buffer; returns the index of their accessor. `kind` has so many numbers for each entry.
    fn numbers(&mut self, numbers: &[f32], kind: &str, width: usize, bounds: bool) -> usize {
        let offset = self.buffer.len();
        self.buffer.extend(numbers.iter().flat_map(|x| x.to_le_bytes()));
        self.views.push(json!({ "buffer": 0, "byteOffset": offset, "byteLength": 4 * numbers.len() }));
        let mut accessor = json!({ "bufferView": self.views.len() - 1, "componentType": 5126, "count": numbers.len() / width, "type": kind });
        if bounds {
            let of = |pick: fn(f32, f32) -> f32| {
                (0..width)
                    .map(|k| numbers[k..].iter().step_by(width).copied().fold(numbers[k], pick))
                    .collect::<Vec<f32>>()
            };
            accessor["min"] = json!(of(f32::min));
            accessor["max"] = json!(of(f32::max));
        }
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    /// Adds a mesh, with every corner once; returns its index.
    fn mesh(&mut self, mesh: &Mesh, colour: Option<usize>) -> usize {
        let (mut known, mut corners, mut indices) = (HashMap::new(), Vec::new(), Vec::new());
        for corner in mesh {
            let index = *known.entry(corner.map(f32::to_bits)).or_insert_with(|| {
                corners.push(*corner);
                corners.len() as u32 - 1
            });
            indices.push(index);
        }
        let places: Vec<f32> = corners.iter().flat_map(|c| [c[0], c[1], c[2]]).collect();
        let normals: Vec<f32> = corners.iter().flat_map(|c| [c[3], c[4], c[5]]).collect();
        let (position, normal) = (self.numbers(&places, "VEC3", 3, true), self.numbers(&normals, "VEC3", 3, false));
        let offset = self.buffer.len();
        self.buffer.extend(indices.iter().flat_map(|i| i.to_le_bytes()));
        self.views.push(json!({ "buffer": 0, "byteOffset": offset, "byteLength": 4 * indices.len() }));
        self.accessors.push(json!({ "bufferView": self.views.len() - 1, "componentType": 5125, "count": indices.len(), "type": "SCALAR" }));
        let attributes = json!({ "POSITION": position, "NORMAL": normal });
        let material = colour.map_or(0, |k| 1 + k % LIGHT.lines.len());
        self.meshes.push(json!({ "primitives": [{ "attributes": attributes, "indices": self.accessors.len() - 1, "material": material }] }));
        self.meshes.len() - 1
    }

    /// Places and rotations of the frames over the time, and rods between them.
    fn animate(&mut self, plan: &Plan, record: &Record, drawn: &Shapes, directions: &Directions) {
        let mut interpreter = plan.default_interpreter();
        let mut frames = vec![FrameState::ground(); plan.frames.len()];
        let mut all: Vec<Vec<FrameState<f64>>> = Vec::new();
        for (q, v) in record.q.iter().zip(&record.v) {
            interpreter.frames(q, v, &mut frames);
            all.push(frames.clone());
        }
        let times: Vec<f32> = record.t.iter().map(|t| *t as f32).collect();
        let input = self.numbers(&times, "SCALAR", 1, true);
        let moving: Vec<(usize, usize)> = self.frames.iter().filter_map(|(f, node)| Some(((*f)?, *node))).collect();
        for (frame, node) in moving {
            let poses = all.iter().map(|frames| (frames[frame].position, quaternion(&frames[frame].rotation)));
            self.moves(input, node, poses, None);
        }
        for (ends, colour) in drawn.rods() {
            let at = |frames: &[FrameState<f64>]| ends.map(|(frame, p)| shapes::placed(frames, frame, p));
            let length = |[a, b]: [[f64; 3]; 2]| (0..3).fold(0.0_f64, |n, k| n.hypot(b[k] - a[k]));
            let longest = all.iter().map(|frames| length(at(frames))).fold(1e-9, f64::max);
            let rod = ShapeKind::Cylinder { radius: 0.02 * longest, length: 1.0, sides: None, rounding: 0.0 };
            let mesh = self.mesh(&directions.shape(&rod), Some(colour));
            let node = self.child(0, json!({ "mesh": mesh }));
            let poses = all.iter().map(|frames| {
                let [a, b] = at(frames);
                let way: [f64; 3] = std::array::from_fn(|k| b[k] - a[k]);
                let turn = if length([a, b]) > 0.0 { towards(way) } else { towards([0.0, 0.0, 1.0]) };
                (std::array::from_fn(|k| 0.5 * (a[k] + b[k])), quaternion(&turn))
            });
            let lengths: Vec<f64> = all.iter().map(|frames| length(at(frames))).collect();
            self.moves(input, node, poses, Some(&lengths));
        }
    }

    /// The motion of a node: places and rotations at the instants, and its length along z where that changes.
    fn moves(
        &mut self,
        input: usize,
        node: usize,
        poses: impl Iterator<Item = ([f64; 3], [f64; 4])>,
        lengths: Option<&[f64]>,
    ) {
        let (mut places, mut turns, mut last) = (Vec::new(), Vec::new(), [0.0; 4]);
        for (place, mut turn) in poses {
            // Of the two quaternions of a rotation the nearer one, so that nothing turns around between two instants.
            if (0..4).map(|k| turn[k] * last[k]).sum::<f64>() < 0.0 {
                turn = turn.map(|x| -x);
            }
            last = turn;
            places.extend(place.map(|x| x as f32));
            turns.extend(turn.map(|x| x as f32));
        }
        let mut paths = vec![("translation", "VEC3", places), ("rotation", "VEC4", turns)];
        let scales = lengths.map(|lengths| lengths.iter().flat_map(|l| [1.0, 1.0, *l as f32]).collect());
        paths.extend(scales.map(|scales| ("scale", "VEC3", scales)));
        for (path, kind, numbers) in paths {
            let output = self.numbers(&numbers, kind, if kind == "VEC4" { 4 } else { 3 }, false);
            self.samplers.push(json!({ "input": input, "output": output, "interpolation": "LINEAR" }));
            self.channels.push(json!({ "sampler": self.samplers.len() - 1, "target": { "node": node, "path": path } }));
        }
    }

    /// The JSON, with an entry for the buffer.
    fn json(&self, buffer: Json) -> Json {
        // Materials have linear colours.
        let linear = |colour: &str| channels(colour).map(|x| (x / 255.0).powf(2.2));
        let material = |colour: &str| {
            let [r, g, b] = linear(colour);
            json!({ "pbrMetallicRoughness": { "baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0.1, "roughnessFactor": 0.6 }, "doubleSided": true })
        };
        let materials: Vec<Json> = std::iter::once(LIGHT.muted).chain(LIGHT.lines).map(material).collect();
        json!({
            "asset": { "version": "2.0", "generator": concat!("mbd ", env!("CARGO_PKG_VERSION")) },
            "scene": 0,
            "scenes": [{ "name": self.name, "nodes": [0] }],
            "nodes": self.nodes.iter().map(without_empty).collect::<Vec<_>>(),
            "meshes": self.meshes,
            "materials": materials,
            "accessors": self.accessors,
            "bufferViews": self.views,
            "buffers": [buffer],
            "animations": [{ "name": "motion", "samplers": self.samplers, "channels": self.channels }],
        })
    }

    /// The document with its buffer in it.
    fn gltf(&self) -> String {
        let uri = format!("data:application/octet-stream;base64,{}", base64(&self.buffer));
        self.json(json!({ "byteLength": self.buffer.len(), "uri": uri })).to_string()
    }

    /// The binary form.
    fn glb(&self) -> Vec<u8> {
        let mut text = self.json(json!({ "byteLength": self.buffer.len() })).to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let word = |x: usize| (x as u32).to_le_bytes();
        let total = 12 + 8 + text.len() + 8 + self.buffer.len();
        let mut out = [b"glTF".as_slice(), &word(2), &word(total), &word(text.len()), b"JSON", &text].concat();
        out.extend([&word(self.buffer.len())[..], b"BIN\0", &self.buffer].concat());
        out
    }
}

/// A node without an empty list of children, which the standard forbids.
fn without_empty(node: &Json) -> Json {
    let mut node = node.clone();
    if node["children"].as_array().is_some_and(Vec::is_empty) {
        node.as_object_mut().map(|node| node.remove("children"));
    }
    node
}
