//! Options for the linker.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    if std::env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("linux") {
        // The loader unloads a layer with the last instance. A program that then creates another instance
        // would start a second capture with the same files.
        println!("cargo::rustc-cdylib-link-arg=-Wl,-z,nodelete");
    }
}
