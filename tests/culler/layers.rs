//! The layers of the library: a module knows only what its layer may know.

mod circles;

use std::{collections::BTreeSet, fs, path::Path};

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
            ("replay", &["recording", "rig", "stroke", "scene"]),
            ("export", &["atomic_file", "brush", "recording", "scene", "stroke"]),
        ],
    ),
    ("crates/osp-net/src", &[("live", &[]), ("wall", &["live"]), ("world", &[])]),
];

/// The modules of the crate that some code names: `crate::name` and the first names in `crate::{...}`.
fn named(code: &str) -> BTreeSet<String> {
    let mut names = BTreeSet::new();
    for (at, word) in code.match_indices("crate::") {
        if code[..at].ends_with(|letter: char| letter.is_ascii_alphanumeric() || letter == '_') {
            continue;
        }
        let part = &code[at + word.len()..];
        let Some(list) = part.strip_prefix('{') else {
            names.insert(first_word(part));
            continue;
        };
        let (mut depth, mut is_start) = (0, true);
        for (at, letter) in list.char_indices() {
            match letter {
                '{' => depth += 1,
                '}' if depth == 0 => break,
                '}' => depth -= 1,
                ',' if depth == 0 => is_start = true,
                _ if is_start && letter.is_ascii_lowercase() => {
                    names.insert(first_word(&list[at..]));
                    is_start = false;
                }
                _ => {}
            }
        }
    }
    names
}

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

fn look(folder: &Path, module: &str, allowed: &[&str], upwards: &mut Vec<String>) -> usize {
    let mut looked_at = 0;
    for entry in fs::read_dir(folder).expect("a folder of sources") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            looked_at += look(&path, module, allowed, upwards);
            continue;
        }
        if path.extension().is_none_or(|extension| extension != "rs") {
            continue;
        }
        looked_at += 1;
        let is_upwards = |name: &String| *name != module && !allowed.contains(&name.as_str());
        let found = named(&code_of(&path)).into_iter().filter(is_upwards);
        upwards.extend(found.map(|name| format!("{} knows {name}", path.display())));
    }
    looked_at
}

#[test]
fn no_module_knows_one_of_a_higher_layer() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut upwards = Vec::new();
    for (sources, modules) in LAYERS {
        for (module, allowed) in modules {
            assert!(look(&root.join(sources).join(module), module, allowed, &mut upwards) > 0, "{module}");
        }
    }
    assert!(upwards.is_empty(), "{upwards:#?}");
}

#[test]
fn what_code_names_is_found() {
    let code = "use crate::{math::{Aabb, Ray}, scene, polygon::Change};\nlet x = crate::lab::verify();";
    assert!(named(code).iter().eq(["lab", "math", "polygon", "scene"]));
}
