//! The layers of the library: a module knows only what its layer may know.

mod circles;

use std::{fs, path::Path};

/// A module and the modules that it may name.
type Layer = (&'static str, &'static [&'static str]);

/// Each module of a crate and the modules of the same crate that it may name, besides itself. Cargo keeps the crates apart.
const LAYERS: [(&str, &[Layer]); 3] = [
    (
        "src",
        &[
            ("math", &[]),
            ("polygon", &["math"]),
            ("index", &["math", "polygon"]),
            ("view", &["math"]),
            ("occlusion", &["math", "polygon", "index", "view"]),
            ("frame", &["math", "polygon", "index", "view", "occlusion"]),
            ("culler", &["math", "polygon", "index", "view", "occlusion"]),
        ],
    ),
    (
        "crates/osp-session/src",
        &[
            ("platform", &[]),
            ("brush", &[]),
            ("rig", &["small_file"]),
            ("recording", &["platform", "brush", "atomic_file", "small_file"]),
            ("stroke", &["brush", "recording"]),
            ("scene", &["brush", "recording", "stroke"]),
            ("replay", &["platform", "recording", "rig", "stroke", "scene"]),
            ("export", &["atomic_file", "brush", "recording", "scene", "stroke"]),
        ],
    ),
    ("crates/osp-net/src", &[("live", &[])]),
];

fn first_word(text: &str) -> String {
    text.chars().take_while(|letter| letter.is_ascii_alphanumeric() || *letter == '_').collect()
}

/// The code of a file without its tests, which may know everything, and without comments.
fn code_of(path: &Path) -> String {
    let text = fs::read_to_string(path).expect("a source");
    let is_of_tests =
        |at: &(usize, &str)| text[..at.0].trim_end().lines().last().is_some_and(|line| line.contains("test"));
    let end = text.match_indices("\nmod tests {").find(is_of_tests).map_or(text.len(), |(at, _)| at);
    let code = &text[..end];
    let lines = code.lines().filter(|line| !line.trim_start().starts_with("//"));
    lines.flat_map(|line| [line, "\n"]).collect()
}

#[test]
fn no_module_knows_one_of_a_higher_layer() {
    for (sources, modules) in LAYERS {
        let named = circles::modules_named_in(sources);
        for (module, allowed) in modules {
            assert!(named.iter().any(|(of, _)| of.first().is_some_and(|name| name == module)), "{module}");
            for (of, name) in named.iter().filter(|(of, _)| of.first().is_some_and(|name| name == module)) {
                assert!(
                    name == module || allowed.contains(&&**name),
                    "{sources}: {} knows {name}",
                    of.join("/")
                );
            }
        }
    }
}
