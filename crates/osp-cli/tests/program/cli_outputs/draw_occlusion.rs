//! `osp draw-occlusion`: what its pictures show. SVG is text, so a test can read it.

use std::{fs, path::Path};

use osp_testkit::at;

use crate::OSP;

/// A square and a triangle before 66 tiles; the paper's rules lose a plane of the triangle.
fn drawn(folder: &Path, out: &str, options: &[&str]) -> (String, String) {
    let session = at("docs/figures/vanish.ron");
    let session = session.to_str().expect("a name in UTF-8");
    let said = OSP.done_in(folder, ["draw-occlusion", session, out, "--force"].iter().chain(options));
    let picture = if out.ends_with(".gif") {
        String::new()
    } else {
        fs::read_to_string(folder.join(out)).expect("a picture")
    };
    (said, picture)
}

fn shapes(svg: &str, mark: &str, of: &str) -> usize {
    svg.lines().filter(|line| line.starts_with(mark) && line.contains(of)).count()
}

/// Colours of occluders, of what is hidden, and of what is visible and culled.
const ORANGE: &str = "#E69F00";
const BLUE: &str = "#0072B2";
const RED: &str = "#E10014";

#[test]
fn a_picture_has_the_occluders_and_each_plane_twice() {
    let folder = tempfile::tempdir().expect("a folder");
    let (said, svg) = drawn(folder.path(), "sound.svg", &["--occluders", "2"]);
    assert!(said.contains("occluder A: 22.71 % of the window, 4 corners, 2.00 m away"), "{said}");
    assert!(
        said.contains("msvbsp: 9 planes, 6 levels, hides 15 of 15 hidden polygons and 0 visible ones"),
        "{said}"
    );
    assert!(svg.contains("msvbsp: 9 of 9 planes, 6 levels"));
    // An outline and a shadow each; a node of the tree and a number in the window for each plane.
    assert_eq!(shapes(&svg, "<polygon", ORANGE), 2);
    assert_eq!(shapes(&svg, "<circle", ORANGE), 9);
    for number in 1..=9 {
        assert_eq!(svg.lines().filter(|line| line.trim() == number.to_string()).count(), 2, "plane {number}");
    }
    assert_eq!(["A 22.7 %", "B 9.0 %", "C "].map(|name| svg.contains(name)), [true, true, false]);
    // Each in the window and among the shadows.
    assert_eq!((shapes(&svg, "<polygon", BLUE), shapes(&svg, "<polygon", RED)), (30, 0));
}

#[test]
fn visible_polygons_that_the_papers_form_hides_are_red() {
    let folder = tempfile::tempdir().expect("a folder");
    let (said, svg) = drawn(folder.path(), "both.svg", &["--occluders", "2", "--form", "both"]);
    assert!(
        said.contains("msvbsp-paper: 10 planes, 6 levels, hides 15 of 15 hidden polygons and 15 visible"),
        "{said}"
    );
    assert!(
        svg.contains(r#"width="1920""#)
            && svg.contains("msvbsp: 9 of")
            && svg.contains("msvbsp-paper: 10 of")
    );
    assert_eq!(shapes(&svg, "<circle", ORANGE), 9 + 10);
    assert_eq!((shapes(&svg, "<polygon", BLUE), shapes(&svg, "<polygon", RED)), (60, 30));
}
