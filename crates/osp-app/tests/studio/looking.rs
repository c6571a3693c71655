//! The sketch of another program is seen first. Tools, grid and strokes come with the wish to draw.

use std::{
    fs,
    path::{Path, PathBuf},
};

use egui::Key;
use egui_kittest::kittest::Queryable;
use osp::glam::{Vec2, Vec3};
use osp_app::{Access, Button, Command, Opening, Session, ToolChoice};
use osp_session::recording::Tool;

use crate::{
    drawing::{Table, across},
    panel::{self, Person, drag, window},
};

const RIBBON: ToolChoice = ToolChoice::Draw(Tool::Ribbon);

/// A wall of another program, with this field in the header.
fn painting(folder: &Path, camera: &str) -> PathBuf {
    let path = folder.join("painting.ron");
    let wall = "Polygon(vertices:[(-9,-9,-3),(9,-9,-3),(9,9,-3),(-9,9,-3)],color:(1,0,0,1))\n";
    fs::write(&path, format!("Header(format:1,name:\"p\",source:\"their program\"{camera})\n{wall}"))
        .expect("written");
    path
}

/// A window with this painting, after a frame.
fn opened(camera: &str) -> Table {
    let mut table = Table::new();
    let path = painting(table.folder.path(), camera);
    table.act([Command::Open(path)]);
    table
}

#[test]
fn what_was_painted_elsewhere_is_looked_at_until_somebody_draws() {
    for camera in ["", ",camera:(p:(0,0,1),q:(0,0,0,1),fov_degrees:40)"] {
        let mut table = Table::new();
        assert!(
            table.studio.tool() == RIBBON && table.studio.layers().grid,
            "an empty session is to be drawn"
        );
        let path = painting(table.folder.path(), camera);
        table.act([Command::Open(path.clone())]);
        assert!(table.studio.tool() == ToolChoice::Look && !table.studio.layers().grid, "{camera}");
        let (events, before) = (table.studio.session().event_count(), table.studio.views()[0].view);
        table.drag(Button::Primary, &across(0.0));
        let turned = table.studio.views()[0].view;
        assert_eq!(table.studio.session().event_count(), events, "nothing is drawn");
        assert!(turned.eye_in_world.distance(before.eye_in_world) > 0.1, "the left button orbits");
        table.studio.command(Command::Tool(RIBBON));
        assert!(table.studio.layers().grid, "who draws sees the floor");
        table.drag(Button::Primary, &across(0.0));
        assert!(table.studio.session().event_count() > events);
        assert_eq!(table.studio.views()[0].view, turned);
        // The grid is as somebody left it.
        let layers = osp_app::LayerChoice { grid: false, ..table.studio.layers() };
        table.act([Command::Layers(layers), Command::Tool(ToolChoice::Look)]);
        table.studio.command(Command::Tool(ToolChoice::Erase));
        assert!(!table.studio.layers().grid);
        // A new session, and a copy that somebody asks for, are to be drawn.
        table.act([Command::Open(path.clone()), Command::Answer(osp_app::Answer::Cancel)]);
        assert_eq!(table.studio.tool(), ToolChoice::Look);
        table.studio.command(Command::New);
        assert!(table.studio.tool() == RIBBON && table.studio.layers().grid);
        table.studio.command(Command::OpenAs(path, Opening::with(Access::Copy)));
        assert_eq!(table.studio.tool(), RIBBON);
    }
}

#[test]
fn the_tools_come_with_a_button_and_go_with_another() {
    let mut harness = window(|autosaves| {
        let folder = tempfile::tempdir().expect("a folder");
        Session::open(&painting(folder.path(), ""), autosaves).expect("a session").0
    });
    let is_shown = |harness: &egui_kittest::Harness<'_, panel::Window>, label: &str| {
        harness.query_by_label(label).is_some()
    };
    assert!(!is_shown(&harness, "Ribbon (1)") && !is_shown(&harness, "Look"));
    // Settings of an earlier visit leave the tools hidden.
    let ctx = harness.ctx.clone();
    let kept = harness.state().folder.path().join("window.settings");
    harness.keep_settings(kept, &ctx);
    harness.run_steps(2);
    assert!(!is_shown(&harness, "Ribbon (1)"));
    let whole = harness.state().model;
    let events = harness.state().studio.session().event_count();
    drag(&mut harness, &panel::across());
    assert_eq!(harness.state().studio.session().event_count(), events);
    harness.click_on("Draw");
    assert!(is_shown(&harness, "Ribbon (1)") && !is_shown(&harness, "Draw"));
    assert!(harness.state().model.width() + 100.0 < whole.width(), "the panel takes its place");
    drag(&mut harness, &panel::across());
    assert!(harness.state().studio.session().event_count() > events);
    harness.click_on("Look");
    assert!(!is_shown(&harness, "Ribbon (1)"));
    assert_eq!(harness.state().model, whole);
    harness.press(Key::V);
    assert!(is_shown(&harness, "Ribbon (1)"), "a key of a tool brings them, too");
    harness.press(Key::Num0);
    assert_eq!(harness.state().studio.tool(), ToolChoice::Look);
    // A replay has no tools. Its session can be opened to draw.
    let replay = panel::replay();
    assert!(!is_shown(&replay, "Look") && is_shown(&replay, "Draw") && !is_shown(&replay, "Ribbon (1)"));
}

#[test]
fn a_sketch_is_played_and_drawn_on_with_a_click() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = painting(folder.path(), "");
    let mut harness = window(|autosaves| Session::open(&path, autosaves).expect("a session").0);
    harness.click_button("Play");
    {
        let session = harness.state().studio.session();
        assert!(session.is_replay() && session.path() == path);
        assert_eq!(session.replay().expect("a replay").position(), 1, "it plays");
    }
    harness.click_button("Draw");
    assert!(!harness.state().studio.session().is_replay());
    assert_eq!(harness.state().studio.tool(), RIBBON, "one click leads to the tools");
    // With an edit, the copy is played.
    drag(&mut harness, &panel::across());
    let copy = harness.state().studio.session().path().to_owned();
    harness.click_button("Play");
    assert_eq!(harness.state().studio.session().path(), copy);
    let mut empty = panel::sketch();
    assert!(!is_there(&empty, "Play"), "there is nothing to play");
    drag(&mut empty, &panel::across());
    empty.run_steps(2);
    assert!(is_there(&empty, "Play"));
}

fn is_there(harness: &egui_kittest::Harness<'_, panel::Window>, label: &str) -> bool {
    harness.query_by_label(label).is_some()
}

#[test]
fn undo_of_a_copy_begins_with_its_own_edits() {
    let mut table = opened("");
    assert!(!table.studio.can(&Command::Undo), "the last stroke of the original stays");
    table.studio.command(Command::Tool(RIBBON));
    table.drag(Button::Primary, &across(0.0));
    assert!(table.studio.can(&Command::Undo));
}

#[test]
fn a_sketch_is_seen_with_the_field_of_view_of_its_artist() {
    let mut table = Table::new();
    let half_height = |table: &mut Table| {
        table.frame();
        table.studio.views()[0].view.projection.top
    };
    for (camera, fov_degrees) in [
        (",camera:(p:(0,0,1),q:(0,0,0,1),fov_degrees:30)", 30.0),
        ("", 55.0),
        // Nobody finds the way in a narrower one.
        (",camera:(p:(0,0,1),q:(0,0,0,1),fov_degrees:0.5)", 10.0),
    ] {
        let path = painting(table.folder.path(), camera);
        table.studio.command(Command::Open(path));
        let found = half_height(&mut table);
        let expected = (fov_degrees * 0.5_f32).to_radians().tan();
        assert!((found - expected).abs() < 1.0e-4, "{fov_degrees}: {found} {expected}");
        // The whole model is in view with it, too.
        table.studio.command(Command::ShowAll);
        assert_eq!(half_height(&mut table), found);
        let clip = table.studio.views()[0].view.clip_from_world();
        for corner in [Vec2::new(-9.0, -9.0), Vec2::new(9.0, -9.0), Vec2::new(-9.0, 9.0), Vec2::new(9.0, 9.0)]
        {
            let p = clip * Vec3::new(corner.x, corner.y, -3.0).extend(1.0);
            assert!(p.w > 0.0 && p.x.abs() <= p.w && p.y.abs() <= p.w, "{fov_degrees}: {p}");
        }
    }
    table.studio.command(Command::New);
    assert!((half_height(&mut table) - 27.5_f32.to_radians().tan()).abs() < 1.0e-4);
}

#[test]
fn the_wheel_never_makes_the_model_a_speck() {
    let mut table = opened("");
    for _ in 0..400 {
        table.input(osp_app::Input::Wheel(-1.0));
    }
    table.frame();
    let view = table.studio.views()[0].view;
    let far_m = view.eye_in_world.distance(Vec3::new(0.0, 0.0, -3.0));
    // The wall has a diagonal of 25.5 m.
    assert!((25.5..600.0).contains(&far_m), "{far_m}");
    table.input(osp_app::Input::Wheel(3.0));
    table.frame();
    assert!(table.studio.views()[0].view.eye_in_world.distance(Vec3::new(0.0, 0.0, -3.0)) < far_m);
}

/// A session of two walls: a small one before the camera and many behind it.
fn room(folder: &Path, behind: u32) -> PathBuf {
    let path = folder.join("room.ron");
    let header = "Header(format:1,name:\"p\",source:\"their program\",camera:(p:(0,0,1),q:(0,0,0,1),fov_degrees:40))\n";
    let wall =
        |z: f32| format!("Polygon(vertices:[(-1,-1,{z}),(1,-1,{z}),(1,1,{z}),(-1,1,{z})],color:(1,0,0,1))\n");
    let walls: String = (0..behind).map(|i| wall(20.0 + i as f32)).collect();
    fs::write(&path, format!("{header}{}{walls}", wall(-3.0))).expect("written");
    path
}

#[test]
fn a_replay_shows_the_model_although_its_camera_looks_elsewhere() {
    for (behind, is_useful) in [(0, true), (9, false)] {
        let mut table = Table::new();
        let path = room(table.folder.path(), behind);
        table.act([Command::PlayFile(path)]);
        assert_eq!(table.studio.has_useful_camera(), is_useful);
        assert_eq!(table.studio.follows_replay_camera(), is_useful);
        // The finished model is seen as its artist saw it; played from there, all of it.
        table.act([Command::ShowFinished]);
        let eye = table.studio.views()[0].view.eye_in_world;
        assert!(eye.distance(Vec3::new(0.0, 0.0, 1.0)) < 1.0e-3, "{eye}");
        table.act([Command::Play(true)]);
        let eye = table.studio.views()[0].view.eye_in_world;
        assert_eq!(eye.distance(Vec3::new(0.0, 0.0, 1.0)) < 1.0e-3, is_useful, "{eye}");
    }
}

#[test]
fn who_turns_the_camera_leaves_the_recorded_one() {
    let turn = |table: &mut Table| table.drag(Button::Secondary, &across(0.0));
    let all = |table: &mut Table| table.studio.command(Command::ShowAll);
    let wheel = |table: &mut Table| table.input(osp_app::Input::Wheel(1.0));
    let fingers = |table: &mut Table| {
        table.studio.take_fingers(Some(osp_app::Fingers {
            count: 2,
            moved: Vec2::new(0.1, 0.0),
            spread: 1.0,
        }));
    };
    let look = |table: &mut Table| table.studio.look(Vec2::new(0.1, 0.0));
    for act in [&turn as &dyn Fn(&mut Table), &all, &wheel, &fingers, &look] {
        let mut table = Table::new();
        let path = room(table.folder.path(), 0);
        table.act([Command::PlayFile(path)]);
        assert!(table.studio.follows_replay_camera());
        act(&mut table);
        assert!(!table.studio.follows_replay_camera());
    }
}
