use osp_testkit::events::events_in;
use std::{
    fs,
    path::{Path, PathBuf},
};

use osp_app::{Answer, Autosaves, Button, Command, Session, Studio, ToolChoice};
use osp_rivals::IndexKind;
use osp_session::{
    export::{KeptStrokes, write_tilt},
    recording::{self, Event, OpenOptions, Pace, Tool},
    replay::CameraChoice,
};

use crate::drawing::{Table, across};

/// The sketch that `osp convert` makes of a session.
fn converted(session: &Path) -> Vec<u8> {
    let mut session = recording::open(session, &OpenOptions::default()).expect("a session");
    let header = session.header.clone();
    let (mut kept, mut bytes) = (KeptStrokes::default(), Vec::new());
    session.by_ref().for_each(|event| kept.note(&event.expect("an event")));
    write_tilt(&mut kept, &header, None, &mut bytes).expect("memory");
    bytes
}

fn last_said(studio: &Studio) -> String {
    studio.messages().last().cloned().expect("a message")
}

/// Numbers of strokes and control points in a file.
fn drawn_in(path: &Path) -> (usize, usize) {
    let events = events_in(path);
    let count = |is: fn(&Event) -> bool| events.iter().filter(|event| is(event)).count();
    (count(|event| matches!(event, Event::Begin { .. })), count(|event| matches!(event, Event::Point { .. })))
}

#[test]
fn a_sketch_is_exported_with_its_edits_as_convert_writes_it() {
    let mut table = Table::new();
    let place = |name: &str| -> PathBuf { table.folder.path().join(name) };
    let [first, second, first_saved, second_saved] =
        ["first.tilt", "second.TILT", "first.ron", "second.ron"].map(place);
    table.drag(Button::Primary, &across(0.0));
    table.studio.command(Command::Tool(ToolChoice::Draw(Tool::Wall)));
    table.drag(Button::Primary, &across(0.3));
    table.studio.command(Command::Export(first.clone()));
    assert_eq!(drawn_in(&first).0, 2);
    let said = last_said(&table.studio);
    assert!(said.contains("2 strokes, ") && said.contains("exported to"), "{said}");
    // One message names all that the format lacks.
    assert!(said.contains("; not all is kept: ") && said.contains("MatteHull"), "{said}");
    table.studio.command(Command::SaveAs(first_saved.clone()));
    assert!(fs::read(&first).expect("there") == converted(&first_saved));
    osp_testkit::add_to_sketch(&first, "notes.txt");
    // The window draws on a copy of the sketch, and writes it again with what was added and erased.
    table.studio.command(Command::Open(first));
    let said = table.studio.messages().join(" ");
    assert!(said.contains("no part of a sketch that osp knows, and not read: `notes.txt`"), "{said}");
    table.act([Command::SelectAll, Command::EraseSelected, Command::Undo]);
    table.studio.command(Command::Tool(ToolChoice::Draw(Tool::Ribbon)));
    table.drag(Button::Primary, &across(-0.3));
    table.studio.command(Command::Export(second.clone()));
    assert_eq!(drawn_in(&second).0, 3);
    table.studio.command(Command::SaveAs(second_saved.clone()));
    assert!(fs::read(&second).expect("there") == converted(&second_saved));
    table.act([Command::SelectAll, Command::EraseSelected]);
    // A file that exists, and that this window has not read.
    let third = table.folder.path().join("third.tilt");
    fs::copy(&second, &third).expect("copied");
    table.studio.command(Command::Export(third.clone()));
    assert!(table.studio.question().expect("a question").text().contains("third.tilt"));
    assert!(fs::read(&third).expect("there") == fs::read(&second).expect("there"), "not before the answer");
    table.studio.command(Command::Answer(Answer::Replace));
    assert_eq!(drawn_in(&third).0, 0);
}

#[test]
fn a_replay_is_exported_as_far_as_it_has_played_and_never_over_itself() {
    let mut table = Table::new();
    let [whole, part] = ["whole.tilt", "part.tilt"].map(|name| table.folder.path().join(name));
    (0..4).for_each(|line| table.drag(Button::Primary, &across(0.1 * line as f32)));
    table.studio.command(Command::Export(whole.clone()));
    let bytes = fs::read(&whole).expect("there");
    let player = Session::to_play(&whole, Pace::Samples(1), CameraChoice::Auto).expect("a session");
    let mut studio = Studio::new(player, Autosaves::new(None), IndexKind::Osp);
    let starts = studio.session().replay().expect("a replay").stroke_starts.to_vec();
    studio.command(Command::Seek(starts[2]));
    studio.command(Command::Export(part.clone()));
    assert_eq!((drawn_in(&whole).0, drawn_in(&part).0), (4, 2));
    for over in [Command::Export(whole.clone()), Command::Over(Box::new(Command::Export(whole.clone())))] {
        studio.command(over);
        assert!(studio.question().is_none());
        let said = last_said(&studio);
        assert!(said.contains("whole.tilt: expected another file; the window shows this session"), "{said}");
    }
    assert!(fs::read(&whole).expect("there") == bytes);
}
