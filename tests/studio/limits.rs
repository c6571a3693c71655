//! Sessions that are larger than they may be, in the window: what comes before the limit is played, and drawn on as a copy.

use std::path::PathBuf;

use crate::drawing::Table;
use osp::{
    app::{Answer, Command, Document, OpenError, Opening, Player},
    recording::{Limits, OpenOptions, Pace},
    replay::CameraChoice,
};

const HEADER: &str = "Header(format:1,name:\"x\",source:\"osp sketch 0.1.0\")\n";
const FACE: &str = "Polygon(vertices:[(0,0,0),(1,0,0),(0,1,0)],color:(1,1,1,1))\n";
const FEW: Limits = Limits { polygons: 12, ..Limits::DEFAULT };

fn twenty_faces(table: &Table) -> PathBuf {
    let path = table.folder.path().join("large.ron");
    std::fs::write(&path, format!("{HEADER}{}", FACE.repeat(20))).expect("written");
    path
}

#[test]
fn a_replay_in_a_window_plays_what_comes_before_the_limit() {
    let table = Table::new();
    let path = twenty_faces(&table);
    let options = OpenOptions { limits: FEW, ..OpenOptions::default() };
    let player = Player::open_with(&path, Pace::Samples(1), CameraChoice::Auto, &options).expect("readable");
    assert_eq!((player.frame_count(), player.finished_model().counts().polygons), (12, 12));
    let remarks = player.remarks().join(" ");
    assert!(remarks.contains("line 14: expected at most 12 polygons (--max-polygons N"), "{remarks}");
    let player = Player::open(&path, Pace::Samples(1), CameraChoice::Auto).expect("readable");
    assert_eq!((player.frame_count(), player.remarks()), (20, &[][..]));
}

#[test]
fn a_session_beyond_the_limit_is_not_drawn_on_but_a_copy_of_what_was_read() {
    let mut table = Table::new();
    let path = twenty_faces(&table);
    let before = std::fs::read(&path).expect("there");
    let autosaves = osp::app::Autosaves::new(Some(table.folder.path().join("auto")));
    let refused = Document::open_as(&path, &autosaves, Opening { limits: FEW, ..Opening::default() });
    let Err(error @ OpenError::Recording(_)) = refused else { panic!("{refused:?}") };
    assert!(error.to_string().contains("--max-polygons N allows more") && error.is_damage(), "{error}");

    // In the window it is a question, as for damage.
    table.studio.set_limits(FEW);
    table.studio.command(Command::Open(path.clone()));
    assert_eq!(table.visible(), 0);
    table.studio.command(Command::Answer(Answer::Lenient));
    table.frame();
    assert_eq!(table.visible(), 12, "{:?}", table.studio.messages());
    assert_eq!(std::fs::read(&path).expect("there"), before, "the session itself is not touched");

    table.studio.set_limits(Limits::DEFAULT);
    table.studio.command(Command::Open(path));
    table.frame();
    assert_eq!(table.visible(), 20, "{:?}", table.studio.messages());
}
