//! The functions that JavaScript calls. Texts are UTF-8 at an address; what is given back lies in the memory until the
//! next call.

use std::cell::RefCell;

use multibody::codegen::{generate, Options};
use multibody::runtime::contact::RegimeChoice;

use crate::describe;
use crate::motion::Settings;
use crate::scene::{read, Files, Reading, Scene};

/// All that an instance holds.
#[derive(Default)]
struct State {
    scene: Option<Scene>,
    files: Files,
    text: String,
    room: Vec<u8>,
    meshes: Vec<f32>,
}

thread_local! {
    static STATE: RefCell<State> = RefCell::default();
}

fn with<T>(action: impl FnOnce(&mut State) -> T) -> T {
    STATE.with_borrow_mut(action)
}

/// Does something with the scene, if there is one.
fn on<T: Default>(action: impl FnOnce(&mut Scene) -> T) -> T {
    with(|state| state.scene.as_mut().map(action)).unwrap_or_default()
}

/// Keeps a message; whether there is none.
fn told(result: Result<(), String>) -> u32 {
    let done = result.is_ok();
    with(|state| state.text = result.err().unwrap_or_default());
    done.into()
}

/// Room for `n` bytes that JavaScript fills for the next call.
#[no_mangle]
pub extern "C" fn room(n: usize) -> *mut u8 {
    with(|state| {
        state.room = vec![0; n];
        state.room.as_mut_ptr()
    })
}

/// Takes the first `name` bytes of the room as the name of a file, and the others as its contents.
#[no_mangle]
pub extern "C" fn file(name: usize) {
    with(|state| {
        let bytes = std::mem::take(&mut state.room);
        let (name, contents) = bytes.split_at(name.min(bytes.len()));
        state.files.insert(String::from_utf8_lossy(name).into_owned(), contents.to_vec());
    });
}

/// Reads the file whose name is in the room. `floating` is the base of a URDF. Returns 1 where there is a scene; the text
/// then describes it, otherwise it has the findings.
#[no_mangle]
pub extern "C" fn open(floating: u32, with_floor: u32, floor: f64) -> u32 {
    with(|state| {
        let name = String::from_utf8_lossy(&std::mem::take(&mut state.room)).into_owned();
        let Some(bytes) = state.files.get(&name) else { return 0 };
        state.scene = None;
        let text = match String::from_utf8(bytes.clone()) {
            Ok(text) => text,
            Err(error) => {
                let line = bytes[..error.utf8_error().valid_up_to()].iter().filter(|b| **b == b'\n').count() + 1;
                state.text = format!("{name}:{line}: error: not UTF-8 text\n  help: save the file as UTF-8");
                return 0;
            }
        };
        let reading = Reading { floating: floating != 0, floor: (with_floor != 0).then_some(floor) };
        let made = read(&name, &text, reading, &state.files).map_err(|findings| findings.to_string()).and_then(
            |(model, findings)| Scene::new(&model, findings).map_err(|message| format!("{name}: error: {message}")),
        );
        let done = made.is_ok();
        match made {
            Ok(scene) => {
                state.text = describe::scene(&scene);
                state.scene = Some(scene);
            }
            Err(message) => state.text = message,
        }
        done.into()
    })
}

/// Describes the scene anew, after a change of parameters.
#[no_mangle]
pub extern "C" fn describe() {
    let text = on(|scene| describe::scene(scene));
    with(|state| state.text = text);
}

/// Makes the triangles of the scene, which [`describe::meshes`] orders; returns their address.
#[no_mangle]
pub extern "C" fn meshes() -> *const f32 {
    let meshes = on(|scene| describe::meshes(scene));
    with(|state| {
        state.meshes = meshes;
        state.meshes.as_ptr()
    })
}

/// Number of their numbers.
#[no_mangle]
pub extern "C" fn meshes_length() -> usize {
    with(|state| state.meshes.len())
}

/// Address of the text that the last call left.
#[no_mangle]
pub extern "C" fn text() -> *const u8 {
    with(|state| state.text.as_ptr())
}

/// Its length, bytes.
#[no_mangle]
pub extern "C" fn text_length() -> usize {
    with(|state| state.text.len())
}

/// Takes steps; returns how many succeeded. The text has the trouble, if there is any.
#[no_mangle]
pub extern "C" fn advance(steps: usize) -> usize {
    let (done, trouble) = on(|scene| (scene.advance(steps), scene.trouble().to_string()));
    with(|state| state.text = trouble);
    done
}

/// Looks at this instant; returns the address of its numbers. The layout is in `page/src/scene/look.rs`.
#[no_mangle]
pub extern "C" fn look(forces: u32) -> *const f64 {
    on(|scene| scene.look(forces != 0));
    with(|state| state.scene.as_ref().map_or(std::ptr::null(), |scene| scene.out.as_ptr()))
}

/// Their number.
#[no_mangle]
pub extern "C" fn look_length() -> usize {
    on(|scene| scene.out.len())
}

/// Back to the start.
#[no_mangle]
pub extern "C" fn restart() {
    on(Scene::restart);
}

/// Changes a coordinate (or velocity) of the start; 0 where that fails, with a text.
#[no_mangle]
pub extern "C" fn set_start(k: usize, x: f64, velocity: u32) -> u32 {
    told(on(|scene| Some(scene.set_start(k, x, velocity != 0))).unwrap_or(Ok(())))
}

/// Goes on from a state: time in `t`, coordinates and momenta as numbers in the room.
#[no_mangle]
pub extern "C" fn set_state(t: f64) {
    let room = with(|state| std::mem::take(&mut state.room));
    let numbers: Vec<f64> = room.as_chunks::<8>().0.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect();
    on(|scene| {
        let (nq, nv) = (scene.plan.dims.nq, scene.plan.dims.nv);
        if numbers.len() == nq + nv {
            scene.set_state(t, &numbers[..nq], &numbers[nq..]);
        }
    });
}

/// Changes a parameter; 0 where that fails, with a text.
#[no_mangle]
pub extern "C" fn set_parameter(k: usize, x: f64) -> u32 {
    told(on(|scene| Some(scene.set_parameter(k, x))).unwrap_or(Ok(())))
}

/// Changes a joint force.
#[no_mangle]
pub extern "C" fn set_effort(k: usize, x: f64) {
    on(|scene| scene.set_effort(k, x));
}

/// Takes hold of a body, by the index of its frame, at a point in its frame.
#[no_mangle]
pub extern "C" fn pull(frame: usize, x: f64, y: f64, z: f64, stiffness: f64, damping: f64) {
    on(|scene| scene.pull(Some((frame, [x, y, z])), stiffness, damping));
}

/// Moves the hand.
#[no_mangle]
pub extern "C" fn pull_to(x: f64, y: f64, z: f64) {
    on(|scene| scene.pull_to([x, y, z]));
}

/// Lets go.
#[no_mangle]
pub extern "C" fn let_go() {
    on(|scene| scene.pull(None, 0.0, 0.0));
}

/// Length of a step, s, how contacts are followed (0 events, 1 time steps, 2 automatic), and the method, whose name is in the
/// room.
#[no_mangle]
pub extern "C" fn settings(step: f64, contacts: u32) {
    let method = with(|state| String::from_utf8_lossy(&std::mem::take(&mut state.room)).into_owned());
    let contacts = match contacts {
        0 => RegimeChoice::Events,
        1 => RegimeChoice::TimeSteps,
        _ => RegimeChoice::Automatic,
    };
    on(|scene| scene.set_settings(Settings { method, step, contacts }));
}

/// Keeps crossings of a coordinate upwards through a value; none where there is no such coordinate.
#[no_mangle]
pub extern "C" fn section(k: usize, level: f64) {
    on(|scene| scene.set_section(Some((k, level))));
}

/// Number of outputs that run as assembled code.
#[no_mangle]
pub extern "C" fn assembled() -> usize {
    on(|scene| scene.assembled())
}

/// Generates the Rust code of the mechanism, as `mbd generate` does, as the text.
#[no_mangle]
pub extern "C" fn source() {
    let text = on(|scene| {
        let made = generate(&scene.plan.model, &Options::default());
        made.map_or_else(|error| error.to_string(), |generated| generated.source)
    });
    with(|state| state.text = text);
}
