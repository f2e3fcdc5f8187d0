//! Links the rival's object files, which `run.sh` names in `RIVALS_OBJECTS`, and the example's memory map.

fn main() {
    let here = std::env::var("CARGO_MANIFEST_DIR").expect("cargo sets it");
    println!("cargo:rustc-link-arg-bins=-T{here}/../../../examples/cortex-m/firmware/link.x");
    println!("cargo:rerun-if-env-changed=RIVALS_OBJECTS");
    for object in std::env::var("RIVALS_OBJECTS").expect("RIVALS_OBJECTS names object files").split(' ') {
        println!("cargo:rerun-if-changed={object}");
        println!("cargo:rustc-link-arg-bins={object}");
    }
}
