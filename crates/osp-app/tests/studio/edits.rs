//! Edits of a sketch from another program go to an autosave file. Every way to open the sketch also offers them.

use std::{
    fs,
    path::{Path, PathBuf},
};

use egui::accesskit::Role;
use egui_kittest::kittest::Queryable;
use osp_app::{Access, Answer, Command, Opening, Session, Studio};
use osp_session::recording::{self, OpenOptions};

use crate::{
    drawing::draw_across,
    keeping::{self, files_in},
    panel::{Person, window},
};

const OFFER: &str = "Continue with the edits?";

fn opened(path: &Path, folder: &Path) -> Studio {
    keeping::opened(path, folder, Opening::default())
}

fn path_of(studio: &Studio) -> PathBuf {
    let document = studio.session();
    document.path().to_owned()
}

/// A model of one triangle.
fn model(folder: &Path, name: &str) -> PathBuf {
    let path = folder.join(name);
    fs::write(&path, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").expect("written");
    path
}

fn title(studio: &Studio) -> Option<&'static str> {
    studio.question().map(|question| question.title())
}

#[test]
fn a_sketch_that_is_opened_again_offers_its_edits() {
    let folder = tempfile::tempdir().expect("a folder");
    let (here, path) = (folder.path(), model(folder.path(), "their model.obj"));
    let mut studio = opened(&path, here);
    assert_eq!(title(&studio), None, "there are no edits yet");
    draw_across(&mut studio, 0.1);
    let edits = path_of(&studio);
    let visible = studio.scene().counts().visible;
    studio.close().expect("written");
    let before = fs::read(&edits).expect("the edits");

    // At the start of the program, the original is shown until somebody answers.
    let mut studio = opened(&path, here);
    assert_eq!((title(&studio), studio.scene().counts().visible), (Some(OFFER), 1));
    let text = studio.question().expect("one").text();
    assert!(text.contains("their model.obj") && text.contains(edits.to_str().expect("text")), "{text}");
    assert!(text.contains(" UTC"), "when they were made: {text}");
    studio.command(Command::Answer(Answer::GoOn));
    assert_eq!((path_of(&studio), studio.scene().counts().visible), (edits.clone(), visible));
    assert_eq!(title(&studio), None);
    studio.close().expect("nothing was drawn");
    assert_eq!(fs::read(&edits).expect("the edits"), before);
    assert_eq!(files_in(&here.join("autosaves")), std::slice::from_ref(&edits), "nothing else was left");

    // The same in a window that is already open.
    let mut studio = opened(&here.join("other.ron"), here);
    studio.command(Command::Open(path.clone()));
    assert_eq!(title(&studio), Some(OFFER));
    studio.command(Command::Answer(Answer::GoOn));
    draw_across(&mut studio, 0.3);
    assert_eq!(path_of(&studio), edits);
    studio.command(Command::Open(path.clone()));
    assert_eq!(title(&studio), Some(OFFER));
    // The edits of the original go into a separate file.
    studio.command(Command::Answer(Answer::Cancel));
    assert_eq!((title(&studio), studio.scene().counts().visible), (None, 1));
    draw_across(&mut studio, 0.4);
    let others = path_of(&studio);
    assert_ne!(others, edits);
    studio.close().expect("written");
    assert!(fs::read(&edits).expect("the edits").starts_with(&before), "they are as they were left");
    assert_eq!(files_in(&here.join("autosaves")).len(), 2);
}

#[test]
fn edits_are_offered_with_their_own_sketch_alone_and_not_where_the_answer_is_known() {
    let folder = tempfile::tempdir().expect("a folder");
    let (here, path) = (folder.path(), model(folder.path(), "a.obj"));
    fs::create_dir(here.join("elsewhere")).expect("a folder");
    let (same_name, longer) = (model(&here.join("elsewhere"), "a.obj"), model(here, "a.obj: b.obj"));
    let mut studio = opened(&path, here);
    draw_across(&mut studio, 0.1);
    let edits = path_of(&studio);
    studio.close().expect("written");
    for other in [same_name, longer] {
        assert_eq!(title(&opened(&other, here)), None, "{}", other.display());
    }
    for access in [Access::Copy, Access::ReadOnly] {
        assert_eq!(title(&keeping::opened(&path, here, Opening::with(access))), None);
    }
    // The same file by another path.
    let roundabout = here.join("elsewhere/../a.obj");
    assert_eq!(title(&opened(&roundabout, here)), Some(OFFER));
    // A damaged file, or one that is no session, is not offered, and stays unchanged.
    let text = fs::read_to_string(&edits).expect("text");
    for broken in ["", "nonsense", "Header(format:99,name:\"\",source:\"\")\n", "Header(format:1,nam"] {
        fs::write(&edits, broken).expect("written");
        assert_eq!(title(&opened(&path, here)), None, "{broken}");
        assert_eq!(fs::read_to_string(&edits).expect("text"), broken);
    }
    fs::write(&edits, text).expect("written");
    assert_eq!(title(&opened(&path, here)), Some(OFFER));
}

const HEADER: &str = "Header(format:1,name:\"their sketch\",source:\"osp sketch 0.1.0";

#[test]
fn recent_sessions_include_autosaves_the_last_one_first() {
    let stroke = "Begin(t:0,stroke:0,tool:Ribbon,width:0.01,color:(1,0,0,1))\n\
                  Point(t:0,stroke:0,p:(0,0,0))\nPoint(t:0,stroke:0,p:(1,0,0))\nEnd(t:0,stroke:0)\n";
    let mut harness = window(|autosaves| {
        let write = |name: &str, source: &str, text: &str, secs: u64| {
            let path = autosaves.folder().join(name);
            fs::write(&path, format!("{HEADER}{source}\")\n{text}")).expect("written");
            let at = std::time::SystemTime::UNIX_EPOCH + std::time::Duration::from_secs(secs);
            fs::File::options().write(true).open(path).expect("a file").set_modified(at).expect("a time");
        };
        write("sketch-20261124-172500.ron", "", stroke, 1_767_225_599);
        write("F-20261124-172500-2.ron", ", from /their/F.tilt: Tilt Brush", stroke, 1_767_225_600);
        write("mine.ron", "", stroke, 0);
        write("empty-20261124-172500.ron.open", "", "", 0);
        Session::new(autosaves)
    });
    harness.click_button("File");
    harness.get_by_label_contains("Open recent").click();
    harness.run_steps(3);
    let names = ["F.tilt, 2026-01-01 00:00:00 UTC", "sketch, 2025-12-31 23:59:59 UTC"];
    let tops = names.map(|name| harness.get_by_role_and_label(Role::Button, name).rect().top());
    assert!(tops[0] < tops[1], "{tops:?}");
    assert!(harness.query_by_label_contains("mine").is_none(), "that has a name of its own");
    harness.click_button(names[0]);
    let folder = harness.state().folder.path().to_owned();
    assert_eq!(path_of(&harness.state().studio), folder.join("F-20261124-172500-2.ron"));
    // The file is already among the autosaves, so it is not listed again among the files with names.
    assert!(harness.state().interface.settings().recent.is_empty());
    let events = recording::open(&folder.join("F-20261124-172500-2.ron"), &OpenOptions::default());
    assert_eq!(events.expect("a session").count(), 4, "nothing was written");
    // The open file is not offered.
    harness.click_button("File");
    harness.get_by_label_contains("Open recent").click();
    harness.run_steps(3);
    assert!(harness.query_by_role_and_label(Role::Button, names[0]).is_none());
    assert!(harness.query_by_role_and_label(Role::Button, names[1]).is_some());
}
