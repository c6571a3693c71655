//! Views that a session keeps, and frames for a video.

use std::{
    f32::consts::PI,
    path::{Path, PathBuf},
};

use egui::{Key, Modifiers};
use osp::glam::{Quat, Vec2, Vec3};
use osp_app::{Button, Command, Held, Input, ReplayStart};
use osp_session::{
    recording::{Camera, Flush, Header, OpenOptions, Pace, RonWriter, SynthKind, synthesize},
    replay::CameraChoice,
};

use crate::{
    drawing::{Table, across},
    panel::{Person, sketch},
};

const SIZE_PX: Vec2 = Vec2::new(800.0, 600.0);

fn eye(table: &Table) -> (Vec3, Quat) {
    let view = table.studio.views()[0].view;
    (view.eye_in_world, view.world_from_view)
}

#[test]
fn a_kept_view_is_gone_to_also_when_the_session_is_opened_again() {
    let mut table = Table::new();
    table.drag(Button::Primary, &across(0.0));
    assert!(!table.studio.can(&Command::GoToView(1)));
    table.studio.input(Input::Wheel(5.0), Held::default(), SIZE_PX);
    table.frame();
    let kept = eye(&table);
    table.studio.command(Command::KeepView(1));
    table.studio.look(Vec2::new(0.4, 0.2));
    table.studio.input(Input::Wheel(-9.0), Held::default(), SIZE_PX);
    table.frame();
    assert!(eye(&table).0.distance(kept.0) > 0.1);
    // Storing a view is no edit.
    table.studio.command(Command::Undo);
    assert_eq!(table.visible(), 0);
    table.studio.command(Command::Redo);
    let path = table.folder.path().join("mine.ron");
    table.act([Command::SaveAs(path.clone()), Command::New, Command::Open(path), Command::GoToView(1)]);
    let (p, q) = eye(&table);
    assert!(p.distance(kept.0) < 1.0e-4 && q.dot(kept.1).abs() > 0.99999, "{p} {q}");
}

/// A session whose header has the view of its artist, from behind.
fn session_with_camera(folder: &Path) -> (PathBuf, Camera) {
    let (path, camera) = (
        folder.join("artist.ron"),
        Camera {
            p: Vec3::new(0.3, 1.4, -3.0),
            q: Quat::from_rotation_y(PI),
            fov_degrees: 50.0,
            near_m: None,
        },
    );
    let header = Header { camera: Some(camera), ..Header::new("artist", "synthesized") };
    let mut writer = RonWriter::create(&path, &header, Flush::AtEnd).expect("a header");
    for event in synthesize(SynthKind::Portrait, 300, 1) {
        writer.write(&event.expect("an event")).expect("written");
    }
    writer.finish().expect("flushed");
    (path, camera)
}

#[test]
fn a_session_opens_as_its_artist_saw_it_and_a_drag_keeps_the_model_in_the_picture() {
    let mut table = Table::new();
    let (path, camera) = session_with_camera(table.folder.path());
    table.act([Command::Open(path)]);
    let (p, q) = eye(&table);
    assert!(p.distance(camera.p) < 1.0e-4 && q.dot(camera.q).abs() > 0.99999, "{p} {q}");
    // The pointer is over nothing, so the camera orbits around the middle of the model.
    table.drag(Button::Secondary, &[(0.95, 0.95), (0.2, 0.9), (-0.6, 0.95)]);
    let middle = table.studio.session().bounds().center();
    let view = table.studio.views()[0].view;
    let clip = view.clip_from_world() * middle.extend(1.0);
    assert!(view.eye_in_world.distance(camera.p) > 0.5, "it has turned");
    assert!(clip.w > 0.0 && clip.x.abs().max(clip.y.abs()) < 0.5 * clip.w, "{clip}");
}

#[test]
fn a_replay_may_begin_with_the_finished_model_and_plays_from_there_in_a_minute() {
    let mut table = Table::new();
    let (path, camera) = session_with_camera(table.folder.path());
    let options = OpenOptions::default();
    table.studio.replay_in_background(
        &path,
        Pace::Samples(1),
        CameraChoice::Auto,
        &options,
        ReplayStart::Finished,
    );
    table.frame();
    let replay = table.studio.session().replay().expect("a replay");
    let frames = replay.frame_count();
    assert!(frames > 0 && replay.position() == frames && !replay.is_playing());
    let secs = replay.secs_at(frames);
    assert!(secs > 0.0 && (replay.speed() - (secs / 60.0).max(1.0)).abs() < 1.0e-9, "{secs}");
    assert!(table.visible() > 100);
    assert!(eye(&table).0.distance(camera.p) < 1.0e-4);
    table.act([Command::Play(true), Command::Speed(secs * 2.0)]);
    // Half of a second with 60 frames a second: all of it, however many frames a second are drawn.
    for _ in 0..15 {
        table.studio.frame(SIZE_PX, 1.0 / 60.0);
    }
    let replay = table.studio.session().replay().expect("a replay");
    let middle = replay.position();
    assert!(middle > frames / 3 && middle < frames * 2 / 3, "{middle} of {frames}");
    table.studio.frame(SIZE_PX, 0.3);
    assert_eq!(table.studio.session().replay().expect("a replay").position(), frames);
    table.act([Command::ShowFinished]);
    let speed = table.studio.session().replay().expect("a replay").speed();
    assert!((speed - secs * 2.0).abs() < 1.0e-9, "the speed stays as chosen");
    assert!(eye(&table).0.distance(camera.p) < 1.0e-4);
}

#[test]
fn keys_keep_views_and_go_to_them() {
    let mut harness = sketch();
    let eye = |harness: &egui_kittest::Harness<'_, crate::panel::Window>| {
        harness.state().studio.views()[0].view.eye_in_world
    };
    let first = eye(&harness);
    harness.press_with(Modifiers::COMMAND, Key::F7);
    harness.state_mut().studio.look(Vec2::new(0.5, 0.0));
    harness.state_mut().studio.input(Input::Wheel(4.0), Held::default(), SIZE_PX);
    harness.run_steps(3);
    assert!(eye(&harness).distance(first) > 0.1);
    harness.press(Key::F6);
    assert!(eye(&harness).distance(first) > 0.1, "view 2 is not kept");
    harness.press(Key::F7);
    assert!(eye(&harness).distance(first) < 1.0e-4);
}
