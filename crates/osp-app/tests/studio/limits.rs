//! Sessions that exceed the limits, in the window: the part before the limit is played, and can be drawn on as a copy.

use std::path::PathBuf;

use crate::drawing::{Table, across};
use osp_app::{Answer, Button, Command, OpenError, Opening, Replay, Session};
use osp_session::{
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

fn replay(session: &Session) -> &Replay {
    session.replay().expect("a replay")
}

#[test]
fn a_replay_in_a_window_plays_what_comes_before_the_limit() {
    let table = Table::new();
    let path = twenty_faces(&table);
    let options = OpenOptions { limits: FEW, ..OpenOptions::default() };
    let mut player =
        Session::to_play_with(&path, Pace::Samples(1), CameraChoice::Auto, &options).expect("readable");
    assert_eq!(replay(&player).frame_count(), 12);
    let remarks = player.remarks().join(" ");
    player.seek(12);
    assert_eq!(player.scene().counts().polygons, 12);
    assert!(remarks.contains("line 14: expected at most 12 polygons (--max-polygons N"), "{remarks}");
    let player = Session::to_play(&path, Pace::Samples(1), CameraChoice::Auto).expect("readable");
    assert_eq!((replay(&player).frame_count(), player.remarks()), (20, &[][..]));
}

#[test]
fn a_session_beyond_the_limit_is_not_drawn_on_but_a_copy_of_what_was_read() {
    let mut table = Table::new();
    let path = twenty_faces(&table);
    let before = std::fs::read(&path).expect("there");
    let autosaves = osp_app::Autosaves::new(Some(table.folder.path().join("auto")));
    let refused = Session::open_as(&path, &autosaves, Opening { limits: FEW, ..Opening::default() });
    let Err(error @ OpenError::Recording(_)) = refused else { panic!("{refused:?}") };
    assert!(error.to_string().contains("--max-polygons N allows more") && error.is_damage(), "{error}");

    // In the window the limit causes a question, like damage.
    table.studio.set_limits(FEW);
    table.studio.command(Command::Open(path.clone()));
    assert_eq!(table.visible(), 0);
    table.act([Command::Answer(Answer::Lenient)]);
    assert_eq!(table.visible(), 12, "{:?}", table.studio.messages());
    assert_eq!(std::fs::read(&path).expect("there"), before, "the session itself is not touched");

    table.studio.set_limits(Limits::DEFAULT);
    table.act([Command::Open(path)]);
    assert_eq!(table.visible(), 20, "{:?}", table.studio.messages());
}

/// Whether a session that was drawn here within limits can be opened again.
fn is_opened_again(table: &Table, limits: Limits) -> bool {
    let document = table.studio.session();
    let options = OpenOptions { limits, ..OpenOptions::default() };
    let session = osp_session::recording::open(document.path(), &options).expect("a session");
    session.into_iter().all(|event| event.is_ok())
}

#[test]
fn copies_that_no_reader_would_take_are_not_made() {
    let mut table = Table::new();
    // The largest number of strokes is a quarter of the number of polygons.
    let limits = Limits { polygons: 400, ..Limits::DEFAULT };
    table.studio.set_limits(limits);
    for i in 0..30 {
        table.drag(Button::Primary, &[(-0.5, i as f32 * 0.02), (-0.4, i as f32 * 0.02)]);
    }
    table.act([Command::SelectAll, Command::Copy]);
    for _ in 0..8 {
        table.studio.command(Command::Paste);
    }
    let strokes = table.studio.scene().strokes().len();
    assert!((90..=100).contains(&strokes), "{strokes} strokes");
    assert!(is_opened_again(&table, limits));
    let said = table.studio.messages().last().expect("a message").clone();
    assert!(said.contains("100 strokes in all"), "{said}");
    // Strokes drawn by hand are kept nevertheless, and a message gives the option to open the session.
    for i in 0..30 {
        table.drag(Button::Primary, &across(-0.5 - i as f32 * 0.01));
    }
    assert!(table.studio.scene().strokes().len() >= 120);
    assert!(!is_opened_again(&table, limits));
    let told = table.studio.messages().iter().filter(|said| said.contains("--max-polygons 800 or more"));
    assert_eq!(told.count(), 1, "{:?}", table.studio.messages());
    // Erasing is always possible.
    table.act([Command::SelectAll, Command::EraseSelected]);
    assert_eq!(table.visible(), 0);
}
