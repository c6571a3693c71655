//! Files that import each other in a circle. Whoever reads one of them has to read all.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::Path,
};

use super::first_word;

/// The sources of each crate.
const SOURCES: [&str; 9] = [
    "src",
    "crates/osp-session/src",
    "crates/osp-rivals/src",
    "crates/osp-render/src",
    "crates/osp-lab/src",
    "crates/osp-net/src",
    "crates/osp-app/src",
    "crates/osp-cli/src",
    "crates/osp-testkit/src",
];

/// A module of a crate, from its root: none is the root itself.
type Module = Vec<String>;

/// A path in the code of a module.
struct Named<'a> {
    path: Vec<&'a str>,
    is_handed_on: bool,
}

/// Reads a path or the paths of a `use` with braces. Returns the text behind them.
fn read_paths<'a>(mut text: &'a str, before: &[&'a str], out: &mut Vec<Vec<&'a str>>) -> &'a str {
    let mut path = before.to_vec();
    loop {
        text = text.trim_start();
        if let Some(mut list) = text.strip_prefix('{') {
            loop {
                list = list.trim_start_matches(|letter: char| letter.is_whitespace() || letter == ',');
                let rest = read_paths(list, &path, out);
                if rest.len() == list.len() {
                    return list.strip_prefix('}').unwrap_or(list);
                }
                list = rest;
            }
        }
        let word = if text.starts_with('*') { "*" } else { word_of(text) };
        path.push(word);
        text = &text[word.len()..];
        match text.strip_prefix("::") {
            Some(rest) if !word.is_empty() => text = rest,
            _ => break,
        }
    }
    path.retain(|word| !word.is_empty());
    if path.len() > before.len() {
        out.push(path);
    }
    match text.trim_start().strip_prefix("as ") {
        Some(alias) => &alias[word_of(alias).len()..],
        None => text,
    }
}

fn word_of(text: &str) -> &str {
    &text[..first_word(text).len()]
}

/// All paths in code. `pub use` hands on what it names; `pub(in path)` names no import.
fn paths_in(code: &str) -> Vec<Named<'_>> {
    let (mut named, mut rest) = (Vec::new(), code);
    while let Some(start) = rest.find(|letter: char| letter.is_ascii_alphabetic() || letter == '_') {
        rest = &rest[start..];
        let word = word_of(rest);
        let before = &code[..code.len() - rest.len()];
        let is_visibility = before.ends_with("(in ");
        if !rest[word.len()..].starts_with("::") || before.ends_with(':') || is_visibility {
            rest = &rest[word.len().max(1)..];
            continue;
        }
        let line = before.rsplit('\n').next().unwrap_or_default().trim_start();
        let is_handed_on = line.starts_with("pub") && line.ends_with("use ");
        let mut paths = Vec::new();
        rest = read_paths(rest, &[], &mut paths);
        named.extend(paths.into_iter().map(|path| Named { path, is_handed_on }));
    }
    named
}

/// The module in which a path begins, and the rest of the path; none if it leads out of the crate.
fn begin<'a>(
    of: &Module,
    path: &'a [&'a str],
    all: &BTreeMap<Module, String>,
) -> Option<(Module, &'a [&'a str])> {
    let ups = path.iter().take_while(|word| **word == "super").count();
    match *path.first()? {
        "crate" => Some((Module::new(), &path[1..])),
        "self" => Some((of.clone(), &path[1..])),
        "super" => Some((of[..of.len().checked_sub(ups)?].to_vec(), &path[ups..])),
        child => all.contains_key(&below(of, child)).then(|| (of.clone(), path)),
    }
}

fn below(module: &Module, child: &str) -> Module {
    let mut module = module.clone();
    module.push(child.to_owned());
    module
}

/// What each module hands on: a name, the module in which its path begins, and the rest of that path.
type HandedOn = BTreeMap<Module, BTreeMap<String, (Module, Vec<String>)>>;

/// The module that has what a path names, wherever it is handed on.
fn owner(
    mut module: Module,
    path: &[&str],
    all: &BTreeMap<Module, String>,
    handed_on: &HandedOn,
    depth: usize,
) -> Module {
    let mut path = path;
    while let Some((child, rest)) = path.split_first()
        && all.contains_key(&below(&module, child))
    {
        (module, path) = (below(&module, child), rest);
    }
    let Some(name) = path.first() else { return module };
    match handed_on.get(&module).and_then(|names| names.get(*name)) {
        Some((from, rest)) if depth < 8 => {
            let rest: Vec<&str> = rest.iter().map(String::as_str).collect();
            owner(from.clone(), &rest, all, handed_on, depth + 1)
        }
        _ => module,
    }
}

/// The modules that each module imports something from. Handing something on is no import unless it is also used there.
fn imports(all: &BTreeMap<Module, String>) -> BTreeMap<Module, BTreeSet<Module>> {
    let named: BTreeMap<&Module, Vec<Named<'_>>> =
        all.iter().map(|(module, code)| (module, paths_in(code))).collect();
    let mut handed_on = HandedOn::new();
    for (module, paths) in &named {
        for Named { path, .. } in paths.iter().filter(|named| named.is_handed_on) {
            if let (Some((from, rest)), Some(name)) = (begin(module, path, all), path.last()) {
                let rest = rest.iter().map(|&word| word.to_owned()).collect();
                handed_on.entry((*module).clone()).or_default().insert((*name).to_owned(), (from, rest));
            }
        }
    }
    let mut imports = BTreeMap::new();
    for (module, paths) in named {
        let is_used = |named: &Named<'_>| {
            let name = named.path.last().copied().unwrap_or_default();
            let words = all[module].split(|letter: char| !letter.is_ascii_alphanumeric() && letter != '_');
            !named.is_handed_on || words.filter(|word| *word == name).count() > 1
        };
        let from = paths.iter().filter(|named| is_used(named)).filter_map(|named| {
            let (from, rest) = begin(module, &named.path, all)?;
            (!rest.is_empty()).then(|| owner(from, rest, all, &handed_on, 0))
        });
        let from: BTreeSet<Module> = from.filter(|from| from != module).collect();
        imports.insert(module.clone(), from);
    }
    imports
}

/// Each module of a crate that names something, with the uppermost module in which that is.
pub(super) fn modules_named_in(sources: &str) -> Vec<(Module, String)> {
    uppermost_named(&files_of(sources))
}

fn uppermost_named(all: &BTreeMap<Module, String>) -> Vec<(Module, String)> {
    let mut found = Vec::new();
    for (module, code) in all {
        for Named { path, .. } in paths_in(code) {
            let Some((from, rest)) = begin(module, &path, all) else { continue };
            let first = from.first().map(String::as_str).or_else(|| rest.first().copied());
            // In a module within a file, `super` is the file.
            let is_of_crate =
                |first: &&str| path[0] == "crate" || all.contains_key(&vec![(*first).to_owned()]);
            found.extend(first.filter(is_of_crate).map(|first| (module.clone(), first.to_owned())));
        }
    }
    found
}

/// Whether imports lead from one module to another.
fn leads(imports: &BTreeMap<Module, BTreeSet<Module>>, from: &Module, to: &Module) -> bool {
    let (mut seen, mut open) = (BTreeSet::new(), vec![from]);
    while let Some(module) = open.pop() {
        for next in imports.get(module).into_iter().flatten() {
            if next == to {
                return true;
            }
            if seen.insert(next) {
                open.push(next);
            }
        }
    }
    false
}

/// The code of each file below a folder without its tests, by its module.
fn read(folder: &Path, of: &Module, all: &mut BTreeMap<Module, String>) {
    for entry in fs::read_dir(folder).expect("a folder of sources") {
        let path = entry.expect("an entry").path();
        let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        if stem == "tests" || stem.ends_with("_tests") {
            continue;
        }
        if path.is_dir() {
            read(&path, &below(of, &stem), all);
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            let module = match stem.as_str() {
                "lib" | "mod" => of.clone(),
                _ => below(of, &stem),
            };
            all.insert(module, super::code_of(&path));
        }
    }
}

fn files_of(sources: &str) -> BTreeMap<Module, String> {
    let mut all = BTreeMap::new();
    read(&Path::new(env!("CARGO_MANIFEST_DIR")).join(sources), &Module::new(), &mut all);
    all
}

#[test]
fn no_files_import_each_other_in_a_circle() {
    for sources in SOURCES {
        let all = files_of(sources);
        assert!(all.len() > 5, "{sources}");
        let imports = imports(&all);
        let is_in_one = |module: &Module| leads(&imports, module, module);
        let found: Vec<&Module> = all.keys().filter(|module| is_in_one(module)).collect();
        let arrows = found.iter().flat_map(|&from| imports[from].iter().map(move |to| (from, to)));
        let round = arrows.filter(|(from, to)| leads(&imports, to, from));
        let round: Vec<String> =
            round.map(|(from, to)| format!("{} imports {}", from.join("/"), to.join("/"))).collect();
        assert!(found.is_empty(), "{sources}: {round:#?}");
    }
}

#[test]
fn a_circle_is_found_through_names_that_are_handed_on() {
    let files = [
        ("", "mod a;\nmod b;\npub use a::{Thing, inner::Deep};"),
        ("a", "mod inner;\npub use inner::Deep;\nuse crate::b::{self, Other as One};"),
        ("a/inner", "fn f() { super::super::b::g() }"),
        ("b", "use crate::Thing;"),
        ("c", "use std::{fs, path::Path};\npub use super::d::Name;"),
        ("d", "use super::c::Path;"),
        ("e", "pub(in crate::f) fn h() {}"),
        ("f", "use super::e::h;"),
    ];
    let module = |name: &str| name.split('/').filter(|part| !part.is_empty()).map(str::to_owned).collect();
    let all: BTreeMap<Module, String> =
        files.into_iter().map(|(name, code)| (module(name), code.to_owned())).collect();
    let of_f = uppermost_named(&all).into_iter().filter(|(of, _)| of[..] == ["f"]);
    assert_eq!(of_f.map(|(_, name)| name).collect::<Vec<_>>(), ["e"]);
    let imports = imports(&all);
    let found: Vec<String> =
        all.keys().filter(|one| leads(&imports, one, one)).map(|one| one.join("/")).collect();
    assert_eq!(found, ["a", "b"]);
    assert!(leads(&imports, &module("a/inner"), &module("a")) && leads(&imports, &module("d"), &module("c")));
}
