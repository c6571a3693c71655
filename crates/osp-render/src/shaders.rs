/// Every shader of the crate in WGSL, with its name. A shader may be the concatenation of several files.
pub const SHADERS: &[(&str, &str)] = &[
    ("finish", FINISH),
    ("hzb_compact", HZB_COMPACT),
    ("hzb_pyramid", HZB_PYRAMID),
    ("hzb_recall", HZB_RECALL),
    ("hzb_test", HZB_TEST),
    ("line", LINE),
    ("overdraw", OVERDRAW),
    ("painted", PAINTED),
    ("painter", PAINTER),
    ("polygon", POLYGON),
    ("pyramid", PYRAMID),
    ("query_apply", QUERY_APPLY),
    ("query_box", QUERY_BOX),
    ("sample_places", SAMPLE_PLACES),
    ("show", SHOW),
];

pub(super) const FINISH: &str = include_str!("shaders/finish.wgsl");
pub(super) const HZB_COMPACT: &str = concat!(
    include_str!("shaders/hzb_span.wgsl"),
    include_str!("shaders/hzb_list.wgsl"),
    include_str!("shaders/hzb_compact.wgsl"),
);
pub(super) const HZB_PYRAMID: &str =
    concat!(include_str!("shaders/hzb_span.wgsl"), include_str!("shaders/hzb_pyramid.wgsl"));
pub(super) const HZB_RECALL: &str = concat!(
    include_str!("shaders/hzb_span.wgsl"),
    include_str!("shaders/hzb_list.wgsl"),
    include_str!("shaders/hzb_recall.wgsl"),
);
pub(super) const HZB_TEST: &str =
    concat!(include_str!("shaders/hzb_span.wgsl"), include_str!("shaders/hzb_test.wgsl"));
pub(super) const LINE: &str = include_str!("shaders/line.wgsl");
pub(super) const OVERDRAW: &str = include_str!("shaders/overdraw.wgsl");
pub(super) const PAINTED: &str = concat!(
    include_str!("shaders/polygon.wgsl"),
    include_str!("shaders/painted.wgsl"),
    include_str!("shaders/effects.wgsl"),
    include_str!("shaders/shadow.wgsl"),
    include_str!("shaders/sky.wgsl"),
);
pub(super) const PAINTER: &str =
    concat!(include_str!("shaders/polygon.wgsl"), include_str!("shaders/painter.wgsl"));
pub(super) const POLYGON: &str = include_str!("shaders/polygon.wgsl");
pub(super) const PYRAMID: &str =
    concat!(include_str!("shaders/whole_picture.wgsl"), include_str!("shaders/pyramid.wgsl"));
pub(super) const QUERY_APPLY: &str =
    concat!(include_str!("shaders/hzb_span.wgsl"), include_str!("shaders/query_apply.wgsl"));
pub(super) const QUERY_BOX: &str = include_str!("shaders/query_box.wgsl");
pub(super) const SAMPLE_PLACES: &str = include_str!("shaders/sample_places.wgsl");
pub(super) const SHOW: &str =
    concat!(include_str!("shaders/whole_picture.wgsl"), include_str!("shaders/show.wgsl"));

#[cfg(test)]
mod tests {
    use super::SHADERS;

    #[test]
    fn every_shader_is_valid() {
        use wgpu::naga::{
            self,
            valid::{Capabilities, ValidationFlags, Validator},
        };
        for (name, source) in SHADERS {
            let module = naga::front::wgsl::parse_str(source)
                .unwrap_or_else(|error| panic!("{name}.wgsl: {}", error.emit_to_string(source)));
            // The shaders need no optional capability, so that they run on every adapter.
            Validator::new(ValidationFlags::all(), Capabilities::empty())
                .validate(&module)
                .unwrap_or_else(|error| panic!("{name}.wgsl: {}", error.emit_to_string(source)));
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
}
