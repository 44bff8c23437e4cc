//! Gives the linker the memory map.

fn main() {
    let said = |name| std::env::var(name).expect("cargo says it");
    // That of cortex-m-rt includes memory.x.
    let script = if said("CARGO_CFG_TARGET_ARCH") == "arm" {
        "link.x"
    } else {
        "riscv.x"
    };
    println!("cargo::rustc-link-search={}", said("CARGO_MANIFEST_DIR"));
    println!("cargo::rustc-link-arg-bins=-T{script}");
    // Segments need not begin at pages of a kind that these processors do not have.
    println!("cargo::rustc-link-arg-bins=--nmagic");
    println!("cargo::rerun-if-changed=memory.x");
    println!("cargo::rerun-if-changed=riscv.x");
}
