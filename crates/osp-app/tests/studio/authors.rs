//! The list of authors, and the strokes of each author.

use egui_kittest::kittest::Queryable;
use osp_app::Session;
use osp_session::{recording::Pace, replay::CameraChoice};

use crate::panel::{Person, sketch, window};

#[test]
fn a_session_of_several_lists_its_authors_and_shows_who_drew_what() {
    let path = std::path::Path::new(osp_testkit::ROOT).join("recordings/class.ron");
    let player = Session::to_play(&path, Pace::Recorded, CameraChoice::Auto).expect("a session");
    let mut harness = window(|_| player);
    assert!(harness.query_by_label("Authors (3)").is_none(), "nobody has joined before the first frame");
    harness.command(osp_app::Command::Seek(u64::MAX));
    for label in ["Authors (3)", "Ada", "Ben", "Cho"] {
        assert!(harness.query_by_label(label).is_some(), "{label}");
    }
    assert!(!harness.state().studio.layers().authors);
    harness.click_on("colour by author");
    assert!(harness.state().studio.layers().authors);
    harness.click_on("colour by author");
    assert!(!harness.state().studio.layers().authors);
    // A single author needs no list.
    assert!(sketch().query_by_label_contains("Authors").is_none());
}
