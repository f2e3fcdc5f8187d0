//! Finds out whether the compiler knows AVX-512 as a stable target feature: 1.89 and later do.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rustc-check-cfg=cfg(avx512)");
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let version = std::process::Command::new(rustc).arg("--version").output();
    // rustc 1.95.0 (59807616e 2026-04-14)
    let minor = version.ok().and_then(|v| {
        let text = String::from_utf8_lossy(&v.stdout).into_owned();
        text.split('.').nth(1).and_then(|minor| minor.parse::<u32>().ok())
    });
    if minor.is_some_and(|minor| minor >= 89) {
        println!("cargo::rustc-cfg=avx512");
    }
}
