//! The window's questions before something is replaced or lost.

use std::{
    fs,
    path::{Path, PathBuf},
};

use crate::{
    drawing::{Table, across, draw_across},
    panel::{Person, Window, button, panels},
};
use egui::{Key, Modifiers, Rect, Vec2, accesskit::Role};
use egui_kittest::{Harness, kittest::Queryable};
use osp::glam;
use osp_app::{
    Answer, Autosaves, Button, Command, OpenError, Opening, Question, Session, Studio, Then, ToolChoice,
};
use osp_rivals::IndexKind;
use osp_session::recording::{Flush, Header, RonWriter, StrokeId, Tool};
use osp_testkit::events;

pub(crate) fn opened(path: &Path, folder: &Path, how: Opening) -> Studio {
    let autosaves = Autosaves::new(Some(folder.join("autosaves")));
    let (document, opened) = Session::open_as(path, &autosaves, how).expect("a session");
    let mut studio = Studio::new(document, autosaves, IndexKind::Osp);
    opened.remarks.into_iter().for_each(|remark| studio.show_message(remark));
    studio
}

/// Number of events in a whole session.
fn events_in(path: &Path) -> usize {
    events::events_in(path).len()
}

pub(crate) fn files_in(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = fs::read_dir(folder) else { return Vec::new() };
    entries.map(|entry| entry.expect("an entry").path()).collect()
}

fn said(studio: &Studio) -> String {
    studio.messages().join("\n")
}

/// Draws a session, closes it, and returns its path.
fn drawn(folder: &Path, name: &str) -> PathBuf {
    let path = folder.join(name);
    let mut studio = opened(&path, folder, Opening::default());
    draw_across(&mut studio, 0.0);
    studio.close().expect("written");
    path
}

#[test]
fn a_session_that_another_window_has_is_looked_at_or_copied() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = drawn(folder.path(), "a.ron");
    let mut first = opened(&path, folder.path(), Opening::default());
    let mut second = opened(&folder.path().join("b.ron"), folder.path(), Opening::default());
    let before = fs::read(&path).expect("a file");

    second.command(Command::Open(path.clone()));
    assert!(matches!(second.question(), Some(Question::Held(_))), "{:?}", second.question());
    assert!(second.question().expect("one").text().contains(&format!("process {}", std::process::id())));
    assert_eq!(second.session().path(), folder.path().join("b.ron"), "nothing happens yet");
    second.command(Command::Answer(Answer::Cancel));
    assert_eq!(second.session().path(), folder.path().join("b.ron"));

    second.command(Command::Open(path.clone()));
    second.command(Command::Answer(Answer::Look));
    assert!(second.session().is_read_only() && !second.can_draw());
    let polygons = second.scene().counts().visible;
    draw_across(&mut second, 0.3);
    second.command(Command::Undo);
    assert_eq!(second.scene().counts().visible, polygons, "nothing is drawn");
    assert!(said(&second).contains("read-only"), "and that is said: {}", said(&second));

    second.command(Command::OpenAs(path.clone(), Opening::default()));
    second.command(Command::Answer(Answer::Copy));
    assert!(second.can_draw() && second.question().is_none());
    assert_eq!(files_in(&folder.path().join("autosaves")).len(), 1, "a mark, and no copy yet");
    draw_across(&mut second, 0.3);
    let copy = second.session().path().to_owned();
    assert!(events_in(&copy) > events_in(&path));
    assert_eq!(fs::read(&path).expect("a file"), before, "the first one's file is its own");

    // The file is still locked; then it is not any more.
    second.command(Command::Open(path.clone()));
    second.command(Command::Answer(Answer::TryAgain));
    assert!(matches!(second.question(), Some(Question::Held(_))));
    draw_across(&mut first, -0.3);
    let drawn = first.scene().counts().visible;
    first.close().expect("written");
    second.command(Command::Answer(Answer::TryAgain));
    assert!(second.question().is_none() && second.can_draw());
    assert_eq!((second.session().path(), second.scene().counts().visible), (&*path, drawn));
    second.close().expect("written");
}

#[test]
fn what_was_not_drawn_here_is_copied() {
    let folder = tempfile::tempdir().expect("a folder");
    let place = |name: &str| folder.path().join(name);
    let shipped = Path::new(osp_testkit::ROOT).join("recordings/scribble.ron");
    fs::copy(&shipped, place("imported.ron")).expect("a copy");
    let protected = drawn(folder.path(), "protected.ron");
    let mut permissions = fs::metadata(&protected).expect("a file").permissions();
    permissions.set_readonly(true);
    fs::set_permissions(&protected, permissions).expect("set");
    let compressed = place("compressed.ron.zst");
    let header = Header::new("a", "osp sketch 0.1.0");
    let mut writer = RonWriter::create(&compressed, &header, Flush::AtEnd).expect("a file");
    writer.write(&events::SOLE.undo()).expect("an event");
    writer.finish().expect("written");
    fs::write(place("model.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").expect("written");

    for (name, why) in [
        ("imported.ron", "was not drawn with `osp sketch`"),
        ("protected.ron", "may not be written to"),
        ("compressed.ron.zst", "of another format"),
        ("model.obj", "of another format"),
    ] {
        let before = fs::read(place(name)).expect("a file");
        let autosaves = place("autosaves");
        let mut studio = opened(&place(name), folder.path(), Opening::default());
        assert!(said(&studio).contains(why), "{name}: {}", said(&studio));
        assert!(studio.session().path().starts_with(&autosaves), "{name}");
        assert!(!studio.session().path().exists());
        let events = studio.session().event_count();
        studio.frame(glam::Vec2::new(800.0, 600.0), 0.016);
        studio.close().expect("nothing to write");
        assert!(files_in(&autosaves).is_empty(), "{name}: no copy of what was only opened");

        let mut studio = opened(&place(name), folder.path(), Opening::default());
        draw_across(&mut studio, 0.1);
        let copy = studio.session().path().to_owned();
        assert!(events_in(&copy) as u64 > events, "{name}: the copy is whole");
        // After saving under a name, the session counts as drawn here.
        studio.command(Command::SaveAs(place("saved.ron")));
        studio.close().expect("written");
        assert_eq!(fs::read(place(name)).expect("a file"), before, "{name}");
        let again = opened(&place("saved.ron"), folder.path(), Opening::default());
        assert_eq!(again.session().path(), place("saved.ron"));
        again.close().expect("unchanged");
        fs::remove_file(place("saved.ron")).expect("removed");
        assert!(files_in(&autosaves).is_empty(), "{name}");
    }
}

#[test]
fn no_file_is_replaced_without_a_word() {
    let mut table = Table::new();
    table.drag(Button::Primary, &across(0.0));
    for (name, work, command) in [
        ("taken.ron", "somebody's work", Command::SaveAs as fn(PathBuf) -> Command),
        ("taken.glb", "glTF: somebody's work", Command::Export as fn(PathBuf) -> Command),
        ("taken.tilt", "somebody's work", Command::Export as fn(PathBuf) -> Command),
    ] {
        let path = table.folder.path().join(name);
        fs::write(&path, work).expect("written");
        for answer in [None, Some(Answer::Cancel)] {
            table.studio.command(command(path.clone()));
            let question = table.studio.question().expect("a question");
            assert!(question.text().contains(name), "{}", question.text());
            assert_eq!(question.first_answer(), Answer::Cancel);
            if let Some(answer) = answer {
                table.studio.command(Command::Answer(answer));
            }
            assert_eq!(fs::read(&path).expect("a file"), work.as_bytes());
        }
        assert!(table.studio.question().is_none());
        table.studio.command(command(path.clone()));
        table.studio.command(Command::Answer(Answer::Replace));
        assert!(fs::read(&path).expect("a file") != work.as_bytes());
        // A folder cannot be replaced.
        let folder = table.folder.path().join("folder").with_extension(path.extension().expect("one"));
        fs::create_dir(&folder).expect("a folder");
        table.studio.command(command(folder.clone()));
        assert!(table.studio.question().is_none() && folder.is_dir());
        assert!(said(&table.studio).contains(&folder.display().to_string()), "{}", said(&table.studio));
    }
    // Saving a session in its own place asks no question.
    table.studio.command(Command::SaveAs(table.folder.path().join("taken.ron")));
    assert!(table.studio.question().is_none());
    // A model is no session.
    for name in ["model.obj", "taken.ron"] {
        let path = table.folder.path().join(name);
        let before = fs::read(&path).ok();
        table.studio.command(Command::Export(path.clone()));
        assert!(table.studio.question().is_none() && fs::read(&path).ok() == before, "{name}");
        assert!(said(&table.studio).contains("expected a name that ends in .glb"), "{}", said(&table.studio));
    }
    assert!(files_in(table.folder.path()).iter().all(|path| !path.to_string_lossy().contains("unfinished")));
}

#[test]
fn a_session_that_is_not_where_it_should_be_is_not_left_without_a_question() {
    type Way = (&'static str, fn(&mut Studio));
    let leave: [Way; 3] = [
        ("close", Studio::ask_to_close),
        ("new", |studio| studio.command(Command::New)),
        ("open", |studio| {
            studio.command(Command::Open(studio.session().path().with_file_name("other.ron")));
        }),
    ];
    for (what, leave) in leave {
        let folder = tempfile::tempdir().expect("a folder");
        let path = drawn(folder.path(), "a.ron");
        let mut studio = opened(&path, folder.path(), Opening::default());
        draw_across(&mut studio, 0.2);
        fs::remove_file(&path).expect("removed");
        let events = studio.session().event_count();
        leave(&mut studio);
        let Some(Question::Unwritten { is_kept: true, reason, .. }) = studio.question() else {
            panic!("{what}: {:?}", studio.question())
        };
        assert!(reason.contains("a.ron") && reason.contains("removed"), "{reason}");
        assert!(!studio.is_closing() && studio.session().event_count() == events);
        studio.command(Command::Answer(Answer::Cancel));
        assert!(!studio.is_closing() && studio.session().path() == path);
        leave(&mut studio);
        studio.command(Command::Answer(Answer::GoOn));
        assert_eq!(studio.is_closing(), what == "close");
        if what != "close" {
            assert_ne!(studio.session().path(), path);
        }
        // The user on the terminal gets the message, too.
        let unwritten = studio.close().expect_err("not in its file");
        assert_eq!(events_in(unwritten.kept_in.as_ref().expect("a shelter")) as u64, events, "{what}");
    }
}

#[test]
fn a_session_that_uses_the_last_number_is_drawn_on() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.ron");
    let stroke = |number: u32| {
        format!(
            "Begin(t:0.0,stroke:{number},tool:Tube,width:0.1,color:(1.0,1.0,1.0,1.0))\n\
             Point(t:0.0,stroke:{number},p:(0.0,0.0,0.0))\nPoint(t:1.0,stroke:{number},p:(1.0,0.0,0.0))\n\
             End(t:1.0,stroke:{number})\n"
        )
    };
    let header = "Header(format:1,name:\"a\",source:\"osp sketch 0.1.0\")\n";
    fs::write(&path, format!("{header}{}{}{}", stroke(u32::MAX), stroke(0), stroke(1))).expect("written");
    let mut studio = opened(&path, folder.path(), Opening::default());
    for height in [0.2, 0.4, 0.6] {
        draw_across(&mut studio, height);
    }
    let counts = studio.scene().counts();
    assert_eq!((counts.strokes, counts.ignored_events), (6, 0));
    for number in [2, 3, 4] {
        assert!(studio.scene().stroke(StrokeId(number)).is_some_and(|stroke| stroke.is_visible()));
    }
    studio.close().expect("written");
    let scene = events::scene_of(&events::events_in(&path));
    assert_eq!(scene.counts(), counts, "the file says the same");
}

#[test]
fn of_a_damaged_session_the_rest_is_offered() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = drawn(folder.path(), "a.ron");
    let text = fs::read_to_string(&path).expect("text").replacen("Point(", "Pont(", 2);
    fs::write(&path, &text).expect("written");
    let mut studio = opened(&folder.path().join("b.ron"), folder.path(), Opening::default());
    studio.command(Command::Open(path.clone()));
    let Some(Question::Damaged { damage, .. }) = studio.question() else { panic!("{:?}", studio.question()) };
    assert!(damage.contains("line 3"), "{damage}");
    studio.command(Command::Answer(Answer::Lenient));
    assert!(said(&studio).contains("damaged parts skipped: 2"), "{}", said(&studio));
    draw_across(&mut studio, 0.2);
    let copy = studio.session().path().to_owned();
    assert!(events_in(&copy) > 5);
    studio.close().expect("written");
    assert_eq!(fs::read_to_string(&path).expect("text"), text);
}

fn draw_with_pointer(harness: &mut Harness<'_, Window>, from: egui::Pos2) {
    for (pressed, at) in [(true, from), (false, from - Vec2::new(90.0, 0.0))] {
        for event in [egui::Event::PointerMoved(at), button(at, pressed)] {
            harness.event(event);
            harness.run_steps(1);
        }
    }
}

const SIZES: [Vec2; 2] = [Vec2::new(1280.0, 800.0), Vec2::new(640.0, 420.0)];

fn every_question(folder: &Path) -> Vec<Question> {
    let path = drawn(folder, "held.ron");
    let autosaves = Autosaves::new(Some(folder.join("autosaves")));
    let (holder, _) = Session::open(&path, &autosaves).expect("free");
    let Err(OpenError::Held(held)) = Session::open(&path, &autosaves) else { panic!("held") };
    holder.close().expect("unchanged");
    let edits = "A sketch with a name of some length-20261124-172500.ron";
    let header = "Header(format:1,name:\"a\",source:\"osp sketch 0.1.0\")\n";
    fs::create_dir_all(autosaves.folder()).expect("a folder");
    fs::write(autosaves.folder().join(edits), header).expect("written");
    let edits = autosaves.last(1).remove(0);
    assert_eq!(edits.of(), "A sketch with a name of some length");
    let long = PathBuf::from("/a/very/long/way/to/a/folder/of/many/sessions/with/a/long/name.ron");
    let damage = format!("{}, line 3: expected a whole value", long.display());
    let reason = format!("{}: it was removed, or its folder was", long.display());
    vec![
        Question::Held(held),
        Question::Edits(edits),
        Question::Damaged { path: long.clone(), damage },
        Question::Replace(long.clone(), Box::new(Command::SaveAs(long))),
        Question::Unwritten { reason, is_kept: true, then: Then::Close },
        Question::Unwritten { reason: "a disk is full".to_owned(), is_kept: false, then: Then::New },
    ]
}

#[test]
fn every_question_is_asked_with_its_answers_in_reach() {
    let folder = tempfile::tempdir().expect("a folder");
    for size in SIZES {
        for question in every_question(folder.path()) {
            let studio = opened(&folder.path().join("new.ron"), folder.path(), Opening::default());
            let mut harness = panels(studio, osp_testkit::temp(), size);
            harness.state_mut().studio.ask(question.clone());
            harness.run_steps(3);
            let screen = Rect::from_min_size(egui::Pos2::ZERO, size);
            assert!(screen.contains_rect(harness.get_by_label(question.title()).rect()));
            assert!(screen.contains_rect(harness.get_by_label(&question.text()).rect()), "{question:?}");
            for (_, words) in question.answers() {
                let button = harness.get_by_role_and_label(Role::Button, words).rect();
                assert!(screen.contains_rect(button), "{words} at {button} of {size}");
            }
            // No key or pointer event passes the question.
            harness.key_press(Key::X);
            let middle = harness.state().model.center() + Vec2::new(60.0, 130.0);
            draw_with_pointer(&mut harness, middle);
            assert_eq!(harness.state().studio.tool(), ToolChoice::Draw(Tool::Ribbon));
            assert_eq!(harness.state().studio.scene().strokes().len(), 0, "{question:?}");
            assert_eq!(harness.state().studio.question(), Some(&question), "it waits");
            // Cancelling changes nothing.
            harness.press(Key::Escape);
            assert!(harness.state().studio.question().is_none() && !harness.state().studio.is_closing());
            assert!(harness.query_by_label(question.title()).is_none());
            let new = folder.path().join("new.ron");
            assert!(!new.exists());
            // The same drag that did nothing before now draws.
            if size == SIZES[0] {
                draw_with_pointer(&mut harness, middle);
                assert_eq!(harness.state().studio.scene().strokes().len(), 1);
                fs::remove_file(new).expect("a session");
            }
        }
    }
}

#[test]
fn answers_are_given_by_their_buttons_and_by_keys() {
    let folder = tempfile::tempdir().expect("a folder");
    let taken = folder.path().join("taken.ron");
    fs::write(&taken, "somebody's work").expect("written");
    let mut studio = opened(&folder.path().join("a.ron"), folder.path(), Opening::default());
    draw_across(&mut studio, 0.0);
    let mut harness = panels(studio, osp_testkit::temp(), SIZES[0]);
    harness.press_with(Modifiers::COMMAND | Modifiers::SHIFT, Key::S);
    harness.get_by_role(Role::TextInput).type_text(taken.to_str().expect("a path"));
    harness.run_steps(2);
    harness.press(Key::Enter);
    assert_eq!(fs::read(&taken).expect("a file"), b"somebody's work");
    // The safe answer has the focus, so a user who only presses Enter replaces nothing.
    harness.press(Key::Enter);
    assert!(harness.state().studio.question().is_none());
    assert_eq!(fs::read(&taken).expect("a file"), b"somebody's work");
    harness.command(Command::SaveAs(taken.clone()));
    harness.click_button("Replace");
    assert!(events_in(&taken) > 2);
    let events = events_in(&taken);

    // A change of the file is reported at once, with the possible answers.
    fs::remove_file(&taken).expect("removed");
    harness.run_steps(4);
    let shown = harness.get_all_by_label_contains("taken.ron is not saved: it was removed").count();
    assert_eq!(shown, 1);
    harness.click_button("Write the file again");
    assert_eq!(events_in(&taken), events);
    assert!(harness.query_by_label_contains("is not saved").is_none());
    fs::rename(&taken, folder.path().join("away.ron")).expect("renamed");
    harness.run_steps(4);
    harness.click_button("Save elsewhere…");
    assert!(harness.query_by_role(Role::TextInput).is_some());
    harness.click_button("Cancel");
    fs::rename(folder.path().join("away.ron"), &taken).expect("renamed");
    harness.click_button("Try again");
    assert!(harness.query_by_label_contains("is not saved").is_none());
    assert!(harness.state().studio.messages().join("\n").contains("the file is complete again"));
}
