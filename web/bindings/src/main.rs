//! `osp-web-bindings FILE.wasm FOLDER` writes `osp_web_bg.wasm` and the JavaScript that loads it into a folder.

use std::path::PathBuf;

use anyhow::Context;
use wasm_bindgen_cli_support::Bindgen;

fn main() -> anyhow::Result<()> {
    let mut arguments = std::env::args_os().skip(1).map(PathBuf::from);
    let (wasm, folder) =
        arguments.next().zip(arguments.next()).context("expected a .wasm file and a folder")?;
    let mut bindings = Bindgen::new();
    bindings
        .input_path(wasm)
        .web(true)?
        .typescript(false)
        .remove_name_section(true)
        .remove_producers_section(true);
    bindings.generate(folder)
}
