//! `bindings/conformance.txt`: cases that every binding runs, too. Here every index that is compiled in and brute force
//! run them. `OSP_WRITE=1 cargo test --test culler conformance_cases` writes the file anew.

mod cases;
mod file;
mod plain;
mod run;

use std::{fs, path::PathBuf};

use osp::{
    glam::Vec3,
    index::{Backend, BruteForce, IndexConfig, Osp, SpatialIndex},
    math::Aabb,
};

/// What the file begins with.
const HEAD: &str = "\
# Cases that every binding of osp must pass. Each line is a step. A test executes the steps from the first to the last.
#
#   case NAME                                    begins with an empty culler
#   box ID minx miny minz maxx maxy maxz         inserts a box, or moves the box with this id
#   remove ID                                    removes the box with this id, and its occluder
#   view m0 .. m15                               the matrix from world to clip space, column-major; depth from 0 to 1, or 1 to 0
#   visible ID ID ...                            the expected ids in the last view, ascending
#   boxquery minx miny minz maxx maxy maxz       queries the boxes that share a point with this box
#   sphere x y z radius                          queries the boxes that share a point with this ball
#   found ID ID ...                              the expected ids of the last boxquery or sphere, ascending
#   ray ox oy oz dx dy dz tmax                   an origin, a direction and the largest t, in units of the direction's length
#   hit ID t | hit none                          the first box that the ray enters, and t there (0 from inside); relative error 10^-4
#   quad ID x y z x y z x y z x y z              sets the occluder of the box to a quad with these corners; the next move of the box
#                                                removes it
#   unhidden ID ID ...                           the expected ids in the last view with occlusion culling, ascending
#
# A view contains each box that is not wholly behind one of its six planes; touching is not behind. Numbers are f32.
# tests/culler/conformance_cases.rs makes this file: OSP_WRITE=1 cargo test --test culler conformance_cases
";

/// Largest size of the file: it is read by every binding's tests.
const MOST_BYTES: usize = 200_000;

fn path() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("bindings/conformance.txt")
}

fn shipped() -> Vec<(usize, file::Step)> {
    let text = fs::read_to_string(path()).expect("bindings/conformance.txt is shipped");
    file::read(&text).expect("a good file")
}

type Make = Box<dyn Fn() -> Box<dyn SpatialIndex>>;

fn indexes() -> Vec<(String, Make)> {
    let mut all: Vec<(String, Make)> = vec![("brute-force".into(), Box::new(|| Box::new(BruteForce::new())))];
    let small = IndexConfig { root: Aabb::cube(Vec3::new(0.5, 0.0, 0.0), 0.25), capacity: 1 };
    let large = IndexConfig { root: Aabb::cube(Vec3::ZERO, 64.0), capacity: 1000 };
    for backend in Backend::ALL.iter().copied().filter(|backend| backend.is_available()) {
        for (size, config, blocks) in [("small", small, 16), ("large", large, 224)] {
            let name = format!("osp with {} and a {size} root", backend.name());
            let osp = move || Osp::with_backend(&config, backend).with_linear_blocks(blocks);
            all.push((name, Box::new(move || Box::new(osp()))));
        }
    }
    all.extend(osp_rivals::IndexKind::ALL.iter().map(|kind| {
        let make: Make = Box::new(move || kind.create(&large));
        (kind.name().to_owned(), make)
    }));
    all
}

#[test]
fn the_file_is_what_its_seed_makes() {
    let steps = cases::all();
    let mut text = HEAD.to_owned();
    for step in &steps {
        if matches!(step, file::Step::Case(_)) {
            text.push('\n');
        }
        text.push_str(&format!("{step}\n"));
    }
    assert!(text.len() < MOST_BYTES, "{} bytes", text.len());
    let read: Vec<file::Step> =
        file::read(&text).expect("a good file").into_iter().map(|(_, step)| step).collect();
    assert_eq!(read, steps, "what was written is what is read");
    if std::env::var("OSP_WRITE").as_deref() == Ok("1") {
        fs::create_dir_all(path().parent().expect("it lies in a folder")).expect("a folder");
        fs::write(path(), &text).expect("the file is written");
    }
    let shipped = fs::read_to_string(path()).expect("bindings/conformance.txt is shipped");
    assert!(text == shipped, "expected the shipped file; OSP_WRITE=1 writes it anew");
}

#[test]
fn every_index_answers_as_the_file_says() {
    let steps = shipped();
    for (name, make) in indexes() {
        let checked = run::run(&steps, &*make).unwrap_or_else(|wrong| panic!("{name}: {wrong}"));
        assert!(checked > 100, "{name}: {checked} answers");
    }
}

#[test]
fn a_culler_answers_as_the_file_says() {
    let checked = run::run_culler(&shipped()).unwrap_or_else(|wrong| panic!("{wrong}"));
    assert!(checked > 100, "{checked} answers");
}

#[test]
fn the_answers_are_those_of_the_plainest_loop() {
    let checked = run::check_answers(&shipped()).unwrap_or_else(|wrong| panic!("{wrong}"));
    assert!(checked > 100, "{checked} answers");
}

#[test]
fn a_wrong_answer_is_found() {
    let steps = shipped();
    let make = || -> Box<dyn SpatialIndex> { Box::new(BruteForce::new()) };
    let mut found = 0;
    for (at, (_, step)) in steps.iter().enumerate() {
        let wrong = match step {
            file::Step::Visible(ids) if ids.len() == 3 => file::Step::Visible(ids[..2].to_vec()),
            file::Step::Found(ids) if ids.is_empty() => file::Step::Found(vec![0]),
            file::Step::Hit(Some((id, t))) => file::Step::Hit(Some((*id, t * 1.01 + 1.0))),
            _ => continue,
        };
        let mut changed = steps.clone();
        changed[at].1 = wrong;
        assert!(run::run(&changed, &make).is_err(), "line {}", steps[at].0);
        found += 1;
    }
    assert!(found > 5, "{found} answers were changed");
}

#[test]
fn a_damaged_line_is_named() {
    for line in [
        "box 1 2 3",
        "view 1 2",
        "visible 2 1",
        "hit 1",
        "boxes 1",
        "remove -1",
        "sphere 0 0 0 x",
        "quad 1 0 0 0",
    ] {
        let error = file::read(&format!("case a\n{line}\n")).expect_err("a bad line");
        assert!(error.starts_with("line 2: "), "{error}");
    }
}
