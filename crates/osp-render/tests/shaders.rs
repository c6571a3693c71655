//! The shaders: valid, portable, each in use.

use osp_render::SHADERS;

#[test]
fn every_shader_is_valid() {
    use wgpu::naga::{
        self,
        valid::{Capabilities, ValidationFlags, Validator},
    };
    for (name, source) in SHADERS {
        let module = match naga::front::wgsl::parse_str(source) {
            Ok(module) => module,
            Err(error) => panic!("{name}.wgsl: {}", error.emit_to_string(source)),
        };
        // No capability beyond the standard: the shaders run everywhere.
        if let Err(error) = Validator::new(ValidationFlags::all(), Capabilities::empty()).validate(&module) {
            panic!("{name}.wgsl: {}", error.emit_to_string(source));
        }
    }
}

#[test]
fn every_shader_file_is_part_of_a_shader() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src/shaders");
    let files: Vec<String> = std::fs::read_dir(&folder)
        .expect("the folder of shaders")
        .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned())
        .collect();
    for file in files {
        let code = std::fs::read_to_string(folder.join(&file)).expect("a shader");
        let is_used = SHADERS.iter().any(|(_, source)| source.contains(&code));
        assert!(is_used, "{file} is part of no shader");
    }
}
