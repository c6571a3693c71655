//! Checks that the header is equal to cbindgen's output for the sources. `OSP_WRITE=1 cargo test -p osp-c --test
//! header` writes it.

use std::{fs, path::Path};

#[test]
fn the_header_is_made_of_the_sources() {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let config = cbindgen::Config::from_file(package.join("cbindgen.toml")).expect("settings of cbindgen");
    let sources = ["types", "camera", "status", "culler_api"];
    let made = sources
        .iter()
        .fold(cbindgen::Builder::new().with_config(config), |builder, name| {
            builder.with_src(package.join(format!("src/{name}.rs")))
        })
        .generate()
        .expect("a header");
    let mut text = Vec::new();
    made.write(&mut text);
    let text = String::from_utf8(text).expect("plain text");
    let path = package.join("include/osp.h");
    if std::env::var("OSP_WRITE").as_deref() == Ok("1") {
        fs::write(&path, &text).expect("the header is written");
    }
    let shipped = fs::read_to_string(&path).expect("include/osp.h is shipped");
    assert!(text == shipped, "expected the shipped header; OSP_WRITE=1 writes it again:\n{text}");
}
