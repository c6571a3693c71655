//! Reading and writing beside the window. The picture continues meanwhile, and the work can be cancelled.

use std::{fmt::Write, fs, path::PathBuf};

use glam::Vec2;
use osp::occlusion::Occlusion;
use osp_app::{Autosaves, Button, Command, Session, Studio};
use osp_rivals::IndexKind;
use osp_session::{recording::Pace, replay::CameraChoice};

use osp_testkit::wait_for;

use crate::{
    drawing::{Table, across},
    tracker::{hear, wait_until},
};

/// Writes a session of this many strokes with ten samples each.
fn long_session(table: &Table, strokes: u32) -> PathBuf {
    let mut text = String::from("Header(format:1,name:\"long\",source:\"osp sketch 0.1.0\")\n");
    for stroke in 0..strokes {
        let y = stroke % 100;
        let _ = writeln!(text, "Begin(t:0,stroke:{stroke},tool:Ribbon,width:0.01,color:(1,0,0,1))");
        for x in 0..10 {
            let _ = writeln!(text, "Point(t:0,stroke:{stroke},p:({x},{y},{}))", stroke / 100);
        }
        let _ = writeln!(text, "End(t:0,stroke:{stroke})");
    }
    let path = table.folder.path().join("long.ron");
    fs::write(&path, text).expect("written");
    path
}

fn shown(table: &Table) -> PathBuf {
    let document = table.studio.session();
    document.path().to_owned()
}

fn wait(table: &mut Table) {
    wait_until("the end of the work", || {
        table.frame();
        !table.studio.is_working()
    });
}

#[test]
fn while_a_session_is_read_frames_go_on_and_everything_else_waits() {
    let mut table = Table::new();
    let path = long_session(&table, 20_000);
    table.drag(Button::Primary, &across(0.0));
    // A tracker's hand is in the middle of a stroke.
    let socket = hear(&mut table.studio, "hand 0 0 0 0 0 0 1 1\nhand 0.1 0 0 0 0 0 1 1\n", 2);
    table.frame();
    let (drawn, visible) = (shown(&table), table.visible());
    table.studio.work_in_background();
    table.studio.command(Command::Open(path.clone()));
    assert!(table.studio.is_reading() && table.studio.next_frame_in().is_some());
    let events = fs::read_to_string(&drawn).expect("the drawing");
    assert!(events.trim_end().ends_with(')') && events.lines().last().is_some_and(|l| l.starts_with("End(")));
    // The session that is being left accepts no more strokes, and is not saved elsewhere, either.
    table.drag(Button::Primary, &across(0.3));
    socket.send(b"hand 0.2 0 0 0 0 0 1 1\n").expect("sent");
    table.studio.command(Command::SaveAs(table.folder.path().join("other.ron")));
    table.studio.command(Command::New);
    if table.studio.is_reading() {
        assert_eq!((shown(&table), table.visible()), (drawn.clone(), visible));
        assert_eq!(fs::read_to_string(&drawn).expect("the drawing"), events);
    }
    // The progress is shown after some time.
    let work = wait_for("the progress", || table.studio.work_shown());
    assert!(work.text.starts_with("reading ") && work.text.ends_with(" events"), "{work:?}");
    wait(&mut table);
    assert_eq!(shown(&table), path);
    assert!(table.visible() >= 20_000 * 9);
    assert_eq!(fs::read_to_string(drawn).expect("the drawing"), events);
    // The hand's next sample starts a new stroke, in the session that is shown now.
    table.frame();
    let strokes = table.studio.scene().strokes().len();
    assert_eq!(strokes, 20_001);
}

#[test]
fn reading_is_ended_by_a_command_and_nothing_is_held_after_it() {
    let mut table = Table::new();
    let path = long_session(&table, 20_000);
    table.drag(Button::Primary, &across(0.0));
    let (drawn, visible) = (shown(&table), table.visible());
    table.studio.work_in_background();
    table.studio.command(Command::Open(path.clone()));
    table.studio.command(Command::CancelWork);
    wait(&mut table);
    assert_eq!((shown(&table), table.visible()), (drawn, visible));
    let said = table.studio.messages().last().expect("a message");
    assert!(said.contains("long.ron: opening it was cancelled"), "{said}");
    // It can be opened at once, because the lock was released.
    table.studio.command(Command::Open(path.clone()));
    wait(&mut table);
    assert_eq!(shown(&table), path, "{:?}", table.studio.messages());
    assert!(table.studio.question().is_none());
}

#[test]
fn a_session_is_inserted_beside_the_window_by_the_windows_plan() {
    let mut table = Table::new();
    let path = long_session(&table, 20_000);
    table.studio.command(Command::Occlusion(Occlusion::Auto.into()));
    table.studio.work_in_background();
    table.studio.command(Command::Open(path));
    wait(&mut table);
    let culling = table.studio.culling();
    let inserted = culling.reindexed().expect("inserted");
    assert_eq!((inserted.kind, culling.plan.occlusion), (IndexKind::Osp, Occlusion::Auto.into()));
    assert_eq!(inserted.polygons, table.studio.scene().counts().visible);
    assert!(inserted.in_background && table.visible() > 0);
}

#[test]
fn the_model_of_a_replay_is_written_beside_the_window_with_its_times() {
    let table = Table::new();
    let path = long_session(&table, 500);
    let replay = || {
        let autosaves = Autosaves::new(Some(table.folder.path().join("autosaves")));
        let player = Session::to_play(&path, Pace::Samples(16), CameraChoice::Auto).expect("a session");
        let mut studio = Studio::new(player, autosaves, IndexKind::Osp);
        studio.command(Command::Seek(200));
        studio.frame(Vec2::new(640.0, 480.0), 0.0);
        studio
    };
    let [here, beside] = ["here", "beside"].map(|folder| {
        fs::create_dir(table.folder.path().join(folder)).expect("a folder");
        table.folder.path().join(folder).join("model.glb")
    });
    replay().command(Command::Export(here.clone()));
    let mut studio = replay();
    studio.work_in_background();
    studio.command(Command::Export(beside.clone()));
    wait_until("the model", || {
        studio.tend();
        !studio.is_working()
    });
    let bytes = fs::read(&here).expect("a model");
    assert!(String::from_utf8_lossy(&bytes).contains("_TIMESTAMP"));
    assert!(bytes == fs::read(&beside).expect("a model"), "the same times in both");
}

#[test]
fn a_model_is_written_beside_the_window_whole_or_not_at_all() {
    let mut table = Table::new();
    let path = long_session(&table, 5_000);
    table.studio.command(Command::Open(path));
    let (whole, here, cancelled) =
        ["one.glb", "two.glb", "cancelled.glb"].map(|name| table.folder.path().join(name)).into();
    table.studio.command(Command::Export(here.clone()));
    table.studio.work_in_background();
    table.studio.command(Command::Export(whole.clone()));
    // A second export must wait. Strokes that are drawn from now on are not in it.
    table.studio.command(Command::Export(cancelled.clone()));
    let is_refused = |said: &String| said.contains("wait until this is done");
    assert!(!table.studio.is_working() || table.studio.messages().iter().any(is_refused));
    table.drag(Button::Primary, &across(0.0));
    wait(&mut table);
    assert!(table.studio.messages().iter().any(|said| said.starts_with("45000 polygons exported to")));
    // The name of the model is the only difference.
    let bytes = |path: &PathBuf| fs::metadata(path).expect("a model").len();
    assert_eq!(bytes(&whole).abs_diff(bytes(&here)), 0);
    table.studio.command(Command::Export(cancelled.clone()));
    table.studio.command(Command::CancelWork);
    wait(&mut table);
    assert!(
        !cancelled.exists() || table.studio.messages().iter().filter(|s| s.contains("exported")).count() >= 3
    );
    let left = fs::read_dir(table.folder.path()).expect("a folder");
    let unfinished = left.filter(|entry| {
        entry.as_ref().is_ok_and(|entry| entry.file_name().to_string_lossy().starts_with(".unfinished"))
    });
    assert_eq!(unfinished.count(), 0);
}

#[test]
fn a_window_that_is_closed_waits_for_its_model_and_gives_back_what_it_reads() {
    let table = Table::new();
    let path = long_session(&table, 20_000);
    let mut studio = table.studio;
    studio.work_in_background();
    studio.command(Command::Open(path.clone()));
    studio.close().expect("nothing was unwritten");
    let folder = table.folder;
    let autosaves = Autosaves::new(Some(folder.path().join("auto")));
    let (document, _) = Session::open(&path, &autosaves).expect("nobody holds it");
    let subject = document;
    let mut studio = Studio::new(subject, autosaves, IndexKind::Osp);
    studio.work_in_background();
    let model = folder.path().join("a.glb");
    studio.command(Command::Export(model.clone()));
    studio.close().expect("nothing was unwritten");
    assert!(fs::metadata(&model).expect("a model").len() > 1_000_000);
}
