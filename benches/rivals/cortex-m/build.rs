//! Links the object files of CasADi's code, which `run.sh` names in `RIVALS_OBJECTS`, with the memory map of the
//! firmware example.

fn main() {
    let here = std::env::var("CARGO_MANIFEST_DIR").expect("cargo sets it");
    println!("cargo:rustc-link-arg-bins=-T{here}/../../../examples/cortex-m/firmware/link.x");
    println!("cargo:rerun-if-env-changed=RIVALS_OBJECTS");
    for object in std::env::var("RIVALS_OBJECTS").expect("RIVALS_OBJECTS names object files").split(' ') {
        println!("cargo:rerun-if-changed={object}");
        println!("cargo:rustc-link-arg-bins={object}");
    }
}
