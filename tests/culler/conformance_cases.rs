//! `bindings/conformance.txt`: cases that every binding runs, too. `OSP_WRITE=1 cargo test --test culler conformance_cases` writes the file anew.

mod cases;
mod file;
mod plain;
mod run;

use std::{fs, path::PathBuf};

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
    if std::env::var("OSP_WRITE").as_deref() == Ok("1") {
        fs::create_dir_all(path().parent().expect("it lies in a folder")).expect("a folder");
        fs::write(path(), &text).expect("the file is written");
    }
    let shipped = fs::read_to_string(path()).expect("bindings/conformance.txt is shipped");
    assert!(text == shipped, "expected the shipped file; OSP_WRITE=1 writes it anew");
}

#[test]
fn a_culler_answers_as_the_file_says() {
    let checked = run::run(&cases::all());
    assert!(checked > 100, "{checked} answers");
}
