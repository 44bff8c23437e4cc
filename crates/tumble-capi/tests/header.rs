//! The committed header is that of the sources. `TUMBLE_WRITE_HEADER=1` writes it.

use std::path::Path;

#[test]
fn the_header_is_that_of_the_sources() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut written = Vec::new();
    cbindgen::generate(folder).expect("a header").write(&mut written);
    let header = String::from_utf8(written)
        .expect("text")
        .replace("@version@", env!("CARGO_PKG_VERSION"));
    let path = folder.join("include/tumble.h");
    if std::env::var_os("TUMBLE_WRITE_HEADER").is_some() {
        std::fs::write(&path, &header).expect("a file");
    }
    let committed = std::fs::read(&path).expect("a file");
    assert!(
        committed == header.as_bytes(),
        "include/tumble.h is out of date; run: TUMBLE_WRITE_HEADER=1 cargo test --package tumble-capi --test header"
    );
}
