//! `osp race --film`, read by a decoder.

use std::fs;

use super::{Report, decoded_film::Film, session};
use crate::OSP;
use osp_testkit::stderr;

#[test]
fn a_film_shows_the_model_as_it_grows_in_a_pane_for_each_structure() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let session = session(folder.path());
    let path = folder.path().join("race.gif").to_str().expect("utf-8").to_owned();
    let output = OSP.run([
        "race",
        &session,
        "--index",
        "osp,octree-rebuild,brute-simd",
        "--pace",
        "samples:64",
        "--film",
        &path,
        "--json",
    ]);
    assert_eq!(stderr(&output), "");
    let report = Report::of(&output);
    let session_frames = report.rows().iter().find(|row| row["figure"] == "frames").expect("a row");
    let expected = session_frames["value"].as_f64().expect("a number").min(224.0) as usize;

    let film = Film::open(&path);
    assert_eq!(film.size, (960, 788), "two rows of two panes");
    assert_eq!(film.frames.len(), expected);
    let time: u32 = film.frames.iter().map(|(_, delay)| u32::from(*delay)).sum();
    assert!((1000..=2000).contains(&time), "{time} hundredths of a second");

    // The picture of the model in the first three panes, and where a fourth would be.
    let model = |picture: &[[u8; 3]], (left, top): (usize, usize)| -> Vec<[u8; 3]> {
        let rows = (top + 46..top + 222).flat_map(|y| (left + 16..left + 296).map(move |x| (x, y)));
        rows.map(|(x, y)| picture[y * film.size.0 + x]).collect()
    };
    let ground = film.frames[0].0[film.size.0 * 50 + 20];
    let drawn = |picture: &[[u8; 3]]| {
        let panes = [(0, 0), (480, 0), (0, 360)].map(|pane| model(picture, pane));
        let count = |model: &Vec<[u8; 3]>| model.iter().filter(|&&color| color != ground).count();
        assert!(panes.iter().all(|pane| count(pane) == count(&panes[0])), "all show the same");
        count(&panes[0])
    };
    let grown: Vec<usize> = film.frames.iter().map(|(picture, _)| drawn(picture)).collect();
    assert!(grown[0] < grown[expected / 2] && grown[expected / 2] < grown[expected - 1], "{grown:?}");
    assert!(grown[expected - 1] > 5_000, "{grown:?}");
    let (last, _) = &film.frames[expected - 1];
    let empty = model(last, (480, 360));
    assert!(empty.iter().all(|color| *color == empty[0]), "there is no fourth structure");
}

#[test]
fn a_film_of_nothing_is_an_error() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let [session, film] = ["empty.ron", "race.gif"].map(|name| folder.path().join(name));
    fs::write(&session, "Header(format: 1, name: \"a\")\n").expect("written");
    let said =
        OSP.refused(["race", session.to_str().expect("utf-8"), "--film", film.to_str().expect("utf-8")]);
    assert!(said.contains("race.gif: there is no frame to draw"), "{said}");
    assert!(!film.exists());
}
