//! A recorded session on the screens of a rig.

use std::path::Path;

use glam::Vec2;
use osp::{glam, view::View};
use osp_app::{Autosaves, Command, Room, Session, Studio};
use osp_lab::Method;
use osp_rivals::IndexKind;
use osp_session::{
    recording::Pace,
    replay::{CameraChoice, RigPath, RigView, RoomMotion},
    rig::{Eye, Rig, Stereo},
};

fn player() -> Session {
    let path = Path::new(osp_testkit::ROOT).join("recordings/room.ron");
    Session::to_play(&path, Pace::Samples(64), CameraChoice::Auto).expect("a session")
}

fn dual_wall() -> Rig {
    Rig::open("dual-wall").expect("a shipped rig")
}

/// Returns a window that shows a replay of the shipped room on a rig, for both eyes.
fn on(rig: Rig) -> (Studio, tempfile::TempDir) {
    let folder = tempfile::tempdir().expect("a folder");
    let autosaves = Autosaves::new(Some(folder.path().to_owned()));
    let mut studio = Studio::new(player(), autosaves, IndexKind::Osp);
    studio.set_room(Room::new(rig));
    (studio, folder)
}

/// Returns the views of which a table of the same frame is made.
fn of_table(studio: &Studio, rig: &mut RigPath) -> Vec<RigView> {
    let player = studio.session().replay().expect("a replay");
    let mut views = Vec::new();
    rig.views_into(&player.view(), &mut views);
    views
}

fn assert_like(a: &View, b: &View, frame: u64) {
    let turn = a.world_from_view.dot(b.world_from_view).abs();
    assert!(
        a.eye_in_world.distance(b.eye_in_world) < 1.0e-4 && turn > 1.0 - 1.0e-5,
        "frame {frame}: {a:?} {b:?}"
    );
    let (a, b) = (a.projection, b.projection);
    for (a, b) in [(a.left, b.left), (a.right, b.right), (a.bottom, b.bottom), (a.top, b.top)] {
        assert!((a - b).abs() < 1.0e-4, "frame {frame}");
    }
}

#[test]
fn a_recorded_session_is_replayed_on_the_dual_wall_as_the_table_says() {
    let (mut studio, _folder) = on(dual_wall());
    let mut rig = RigPath::new(dual_wall(), Stereo::SideBySide, RoomMotion::Follows);
    studio.command(Command::Occlusion(Method::NONE));
    studio.command(Command::Play(true));
    // A recorded frame for each shown frame; the factor outweighs rounding.
    let replay = studio.session().replay().expect("a replay");
    let frames = replay.frame_count();
    let speed = replay.secs_at(frames) / (frames as f64 * 0.016) * 1.0001;
    studio.command(Command::Speed(speed));
    let (mut most, mut tilted) = (0, false);
    for frame in 0..150 {
        let report = studio.frame(Vec2::new(1600.0, 600.0), 0.016);
        let table = of_table(&studio, &mut rig);
        assert_eq!((studio.views().len(), table.len(), report.record.views), (4, 4, 4));
        let eyes: Vec<(usize, Eye)> = studio.views().iter().map(|view| (view.screen, view.eye)).collect();
        assert_eq!(eyes, rig.slots().collect::<Vec<_>>());
        for (shown, listed) in studio.views().iter().zip(&table) {
            assert_like(&shown.view, &listed.view.expect("a view"), frame);
        }
        let [left, right] = [0, 1].map(|i| studio.views()[i].view.eye_in_world);
        assert!((left.distance(right) - 0.064).abs() < 1.0e-4);
        tilted |= (left.y - right.y).abs() > 1.0e-4;
        let drawn: u64 = (0..4).map(|i| studio.culling().drawn(i).len() as u64).sum();
        assert_eq!((drawn, drawn), (report.drawn, report.record.visible));
        most = most.max(drawn);
    }
    assert!(most > 4_000, "at most {most} polygons on all screens");
    // The shipped artist's head is upright.
    assert!(!tilted);

    // Hidden polygons are culled on each of the four.
    let player = studio.session().replay().expect("a replay");
    assert!(player.position() == 150 && player.is_playing());
    let before: Vec<usize> = (0..4).map(|i| studio.culling().drawn(i).len()).collect();
    studio.command(Command::Play(false));
    studio.command(Command::Occlusion(Method::from_name("msvbsp").expect("a method")));
    let record = studio.frame(Vec2::new(1600.0, 600.0), 0.016).record;
    let after: Vec<usize> = (0..4).map(|i| studio.culling().drawn(i).len()).collect();
    assert_eq!(record.visible, before.iter().sum::<usize>() as u64);
    assert!(before.iter().zip(&after).all(|(before, after)| after <= before), "{before:?} {after:?}");
    assert!(record.occlusion.occluded > 200, "{record:?}");
}

#[test]
fn a_person_who_moves_the_camera_takes_the_room_along() {
    let (mut studio, _folder) = on(dual_wall());
    studio.command(Command::Seek(100));
    studio.frame(Vec2::new(1600.0, 600.0), 0.016);
    let middle = |studio: &Studio| {
        let [left, right] = [0, 1].map(|i| studio.views()[i].view.eye_in_world);
        (left + right) * 0.5
    };
    let player = studio.session().replay().expect("a replay");
    assert!(middle(&studio).distance(player.view().eye_in_world) < 1.0e-4);
    studio.follow_replay_camera(false);
    studio.command(Command::ShowAll);
    studio.frame(Vec2::new(1600.0, 600.0), 0.016);
    assert!(middle(&studio).distance(studio.navigator().eye()) < 1.0e-3);
    let player = studio.session().replay().expect("a replay");
    assert!(middle(&studio).distance(player.view().eye_in_world) > 1.0);
}
