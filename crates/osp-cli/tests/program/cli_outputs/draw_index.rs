//! `osp draw-index`: what its pictures show. SVG is text, so a test can read it.

use std::fs;

use crate::OSP;

#[test]
fn the_papers_tree_shows_empty_nodes_planes_flags_and_names() {
    let folder = tempfile::tempdir().expect("a folder");
    let session = osp_testkit::at("docs/figures/vanish.ron");
    let session = session.to_str().expect("a name in UTF-8");
    let options = "--index osp-paper --as tree --levels 4 --names".split(' ');
    let tree = ["draw-index", session, "tree.svg"].into_iter().chain(options);
    let said = OSP.done_in(folder.path(), tree);
    assert!(said.contains("osp-paper: 65,535 nodes, 16 levels, 68 polygons"), "{said}");
    let svg = fs::read_to_string(folder.path().join("tree.svg")).expect("a picture");
    let (circles, hollow) = (svg.matches("<circle").count(), svg.matches(r#"fill="none" stroke"#).count());
    assert_eq!(circles, 15, "a circle for each node of four levels");
    let said = format!("\n{hollow} of the 15 nodes shown are empty: hollow circles\n");
    assert!(hollow > 0 && svg.contains(&said), "{hollow}");
    // The square ends in the plane x = 0, and that plane cuts the triangle.
    assert!(svg.contains("\nx = 0.00, PS\n") && svg.contains("\n#0 1"), "the root");
    let refused = OSP.refused_in(folder.path(), ["draw-index", "room.ron", "n.svg", "--names"]);
    assert!(refused.contains("room.ron"));
    OSP.done_in(folder.path(), ["synth", "room", "room.ron", "--polygons", "900"]);
    let refused = OSP.refused_in(folder.path(), ["draw-index", "room.ron", "n.svg", "--names"]);
    assert!(refused.contains("at most 500 polygons; found "), "{refused}");
}

#[test]
fn a_film_of_insertions_counts_planes_and_inserted_polygons() {
    let folder = tempfile::tempdir().expect("a folder");
    let session = osp_testkit::at("docs/figures/fall.ron");
    let session = session.to_str().expect("a name in UTF-8");
    let said = OSP.done_in(folder.path(), ["draw-insertion", session, "fall.gif", "--polygons", "4"]);
    // Polygon 3 is cut by the first plane, polygon 4 by the fourth, two fall past all five.
    assert!(
        said.contains("4 polygons: osp-paper tests 15 planes and moves none; octree-paper tests "),
        "{said}"
    );
    assert!(said.contains(" and inserts 10 polygons -> fall.gif, "), "{said}");
    let film = fs::read(folder.path().join("fall.gif")).expect("a film");
    assert!(film.starts_with(b"GIF89a") && film.len() < 300_000, "{}", film.len());
}
