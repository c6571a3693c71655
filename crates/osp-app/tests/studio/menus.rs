//! Menus, keys and dialogs. Possible commands are offered and impossible ones are not, by button and by key.

use std::{fs, path::Path};

use crate::panel::{Person, Window, across, drag, sketch};
use egui::{Key, Modifiers, accesskit::Role};
use egui_kittest::{
    Harness,
    kittest::{NodeT, Queryable},
};
use osp_app::{Command, Settings, Theme, ToolChoice};
use osp_session::{brush, recording::Tool};

fn pick(harness: &mut Harness<'_, Window>, menu: &str, name: &str) {
    harness.click_button(menu);
    let entry =
        harness.query_all_by_label_contains(name).find(|node| node.accesskit_node().role() == Role::Button);
    entry.unwrap_or_else(|| panic!("no entry {name}")).click();
    harness.run_steps(3);
}

fn path_of(harness: &Harness<'_, Window>) -> std::path::PathBuf {
    harness.state().studio.session().path().to_owned()
}

fn type_path(harness: &mut Harness<'_, Window>, path: &Path) {
    harness.run_steps(2);
    harness.get_by_role(Role::TextInput).type_text(path.to_str().expect("text"));
    harness.run_steps(2);
    harness.press(Key::Enter);
}

#[test]
fn the_first_save_asks_for_a_name_and_the_next_ones_do_not() {
    let mut harness = sketch();
    drag(&mut harness, &across());
    let path = harness.state().folder.path().join("mine.ron");
    harness.press_with(Modifiers::COMMAND, Key::S);
    type_path(&mut harness, &path);
    assert!(harness.query_by_role(Role::TextInput).is_none(), "the dialog is closed");
    let tool = harness.state().studio.tool();
    assert_eq!(tool, ToolChoice::Draw(Tool::Ribbon), "what is typed is text and no key");
    assert_eq!(path_of(&harness), path);
    harness.press_with(Modifiers::COMMAND, Key::S);
    assert!(harness.query_by_role(Role::TextInput).is_none());
    let said = harness.state().studio.messages().last().cloned().expect("a message");
    assert!(said.contains("the whole session is in") && said.contains("mine.ron"), "{said}");
    // For another name, the own one is suggested.
    harness.press_with(Modifiers::COMMAND | Modifiers::SHIFT, Key::S);
    let suggested = harness.get_by_role(Role::TextInput).accesskit_node().value().expect("text");
    assert_eq!(Path::new(&suggested), path);
    let other = harness.state().folder.path().join("other.ron");
    type_path(&mut harness, &other);
    assert_eq!(path_of(&harness), other);
}

#[test]
fn a_dialog_that_fails_stays_open_and_says_why() {
    let mut harness = sketch();
    drag(&mut harness, &across());
    let folder = harness.state().folder.path().to_owned();
    harness.key_press_modifiers(Modifiers::COMMAND, Key::S);
    type_path(&mut harness, &folder.join("no/such/folder/a.ron"));
    assert!(harness.query_by_role(Role::TextInput).is_some(), "still open");
    assert!(harness.query_all_by_label_contains("no/such/folder").next().is_some(), "with the reason");
    // The path is selected, so typing replaces it.
    type_path(&mut harness, &folder.join("a.ron"));
    assert!(harness.query_by_role(Role::TextInput).is_none());
    assert!(folder.join("a.ron").exists());

    harness.key_press_modifiers(Modifiers::COMMAND, Key::O);
    type_path(&mut harness, &folder.join("missing.tilt"));
    assert!(harness.query_all_by_label_contains("missing.tilt").next().is_some());
    // A question about the file comes first. Afterwards the dialog is still open.
    harness.press(Key::Escape);
    assert!(harness.query_by_role(Role::TextInput).is_none());
    fs::write(folder.join("there.ron"), "somebody's work").expect("written");
    harness.key_press_modifiers(Modifiers::COMMAND | Modifiers::SHIFT, Key::S);
    type_path(&mut harness, &folder.join("there.ron"));
    assert!(harness.state().studio.question().is_some());
    harness.press(Key::Escape);
    assert!(harness.state().studio.question().is_none());
    assert!(harness.query_by_role(Role::TextInput).is_some());
    assert_eq!(fs::read(folder.join("there.ron")).expect("a file"), b"somebody's work");
}

#[test]
fn the_menu_and_a_key_export_a_sketch_of_tilt_brush() {
    let mut harness = sketch();
    drag(&mut harness, &across());
    let folder = harness.state().folder.path().to_owned();
    pick(&mut harness, "File", "Export .tilt…");
    let suggested = harness.get_by_role(Role::TextInput).accesskit_node().value().expect("text");
    assert!(suggested.ends_with("sketch.tilt"), "{suggested}");
    // The ending is added.
    type_path(&mut harness, &folder.join("mine"));
    assert!(harness.query_by_role(Role::TextInput).is_none(), "the dialog is closed");
    assert!(fs::read(folder.join("mine.tilt")).expect("a sketch").starts_with(b"tilT"));
    harness.press_with(Modifiers::COMMAND | Modifiers::SHIFT, Key::E);
    type_path(&mut harness, &folder.join("no folder/a.tilt"));
    assert!(harness.query_all_by_label_contains("no folder").next().is_some(), "it says why");
    // A sketch from the dialog that saves the session.
    harness.press(Key::Escape);
    harness.press_with(Modifiers::COMMAND | Modifiers::SHIFT, Key::S);
    type_path(&mut harness, &folder.join("saved.tilt"));
    assert!(fs::read(folder.join("saved.tilt")).expect("a sketch").starts_with(b"tilT"));
    assert!(!harness.state().studio.session().journal().is_named(), "the session stays where it is");
    // A sketch from the dialog for models.
    harness.press_with(Modifiers::COMMAND, Key::E);
    type_path(&mut harness, &folder.join("other.tilt"));
    assert!(fs::read(folder.join("other.tilt")).expect("a sketch").starts_with(b"tilT"));
}

#[test]
fn menus_do_what_their_keys_do() {
    let mut harness = sketch();
    drag(&mut harness, &across());
    pick(&mut harness, "Edit", "Select all");
    assert!(!harness.state().studio.selection().is_empty());
    harness.press(Key::Escape);
    assert!(harness.state().studio.selection().is_empty());
    pick(&mut harness, "Edit", "Undo");
    assert_eq!(harness.state().studio.scene().counts().visible, 0);
    pick(&mut harness, "View", "Full screen");
    assert!(harness.state().interface.is_fullscreen());
    harness.press(Key::Escape);
    assert!(!harness.state().interface.is_fullscreen());
    harness.press(Key::F11);
    assert!(harness.state().interface.is_fullscreen());
    pick(&mut harness, "View", "Show culling panel");
    assert!(harness.query_by_label("frame times").is_some());
    pick(&mut harness, "File", "Quit");
    assert!(harness.state().studio.is_closing());
}

#[test]
fn settings_and_recent_sessions_are_there_the_next_time() {
    let path = {
        let mut harness = sketch();
        let folder = harness.state().folder.path().to_owned();
        // This folder is not the harness's own. Settings are on the disk at the latest when the window is closed.
        let other = tempfile::tempdir().expect("a folder");
        let kept = other.path().join("settings/window.settings");
        let ctx = harness.ctx.clone();
        harness.keep_settings(kept.clone(), &ctx);
        drag(&mut harness, &across());
        let (paint, color) = (Command::Paint(brush::find("Ink")), Command::Color([0.1, 0.2, 0.3, 1.0]));
        for command in [Command::SaveAs(folder.join("mine.ron")), paint, color, Command::Width(0.5)] {
            harness.command(command);
        }
        harness.click_button("View");
        harness.get_by_label_contains("Theme").click();
        harness.run_steps(3);
        harness.click_on("Light");
        drop(harness);
        let settings = Settings::read(&kept);
        assert_eq!((settings.theme, &settings.recent[..]), (Theme::Light, &[folder.join("mine.ron")][..]));
        (other, kept)
    };
    let mut next = sketch();
    let ctx = next.ctx.clone();
    next.keep_settings(path.1.clone(), &ctx);
    next.run_steps(3);
    let pen = next.state().studio.brush();
    assert_eq!((pen.paint, pen.color, pen.width_m), (brush::find("Ink"), [0.1, 0.2, 0.3, 1.0], 0.5));
    next.click_button("File");
    next.get_by_label_contains("Open recent").click();
    next.run_steps(3);
    let gone = next.get_by_label("mine.ron");
    assert!(gone.accesskit_node().is_disabled(), "an empty session in its place would look like a lost one");
}

#[test]
fn what_cannot_be_redone_undoes_nothing() {
    let mut harness = sketch();
    drag(&mut harness, &across());
    let drawn = harness.state().studio.scene().counts().visible;
    harness.press_with(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    assert_eq!(harness.state().studio.scene().counts().visible, drawn);
}

#[test]
fn a_picture_replaces_no_session() {
    let mut harness = sketch();
    drag(&mut harness, &across());
    let path = harness.state().folder.path().join("mine.ron");
    harness.state_mut().studio.command(Command::SaveAs(path.clone()));
    harness.state_mut().studio.command(Command::Over(Box::new(Command::Picture(path.clone()))));
    let outcome = harness.state_mut().studio.take_file_outcome();
    assert!(outcome.is_some_and(|outcome| outcome.is_err()));
    assert!(fs::read_to_string(path).expect("a session").starts_with("Header"));
}

#[test]
fn the_key_of_a_shortcut_does_not_fly_when_the_modifier_is_released_first() {
    let mut harness = sketch();
    drag(&mut harness, &across());
    let eye = |harness: &Harness<'_, Window>| harness.state().studio.views()[0].view.eye_in_world;
    let before = eye(&harness);
    let (key, physical_key, repeat) = (Key::D, None, false);
    let key = |pressed, modifiers| egui::Event::Key { key, physical_key, pressed, repeat, modifiers };
    harness.event(egui::Event::ModifiersChanged(Modifiers::COMMAND));
    harness.event(key(true, Modifiers::COMMAND));
    harness.step();
    harness.event(egui::Event::ModifiersChanged(Modifiers::NONE));
    harness.run_steps(5);
    assert_eq!(eye(&harness), before);
    harness.event(key(false, Modifiers::NONE));
    harness.step();
    harness.event(key(true, Modifiers::NONE));
    harness.run_steps(5);
    assert_ne!(eye(&harness), before, "the key alone flies");
}

#[test]
fn undo_goes_on_after_the_copy_of_a_sketch_is_saved() {
    let mut harness = sketch();
    let path = harness.state().folder.path().join("wall.obj");
    fs::write(&path, "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n").expect("written");
    harness.state_mut().studio.command(Command::Open(path));
    harness.run_steps(2);
    let studio = &mut harness.state_mut().studio;
    studio.command(Command::Tool(ToolChoice::Draw(Tool::Ribbon)));
    assert!(!studio.can(&Command::Undo) && studio.session().file_to_play() == studio.session().original());
    let original = studio.session().original().expect("an original").to_owned();
    drag(&mut harness, &across());
    let studio = &mut harness.state_mut().studio;
    assert!(studio.can(&Command::Undo));
    let saved = original.with_extension("ron");
    studio.command(Command::SaveAs(saved.clone()));
    assert!(studio.can(&Command::Undo), "saving forgets no step");
    assert_eq!(studio.session().file_to_play(), Some(&*saved), "what is played has the strokes");
    studio.command(Command::Undo);
    assert!(studio.can(&Command::Redo));
    harness.run_steps(2);
}
