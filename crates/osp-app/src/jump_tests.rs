//! Tests of the changes that a window sends to its GPU when a replay jumps, between frames or within one.

use std::path::Path;

use glam::{Vec2, Vec3};
use rand_pcg::{Pcg64, rand_core::Rng};

use super::{Autosaves, Command, Session, Studio};
use osp::polygon::{Change, ConvexPolygon, PolygonId};
use osp_rivals::IndexKind;
use osp_session::{
    recording::{Event, Flush, Header, Pace, RonWriter, StrokeId},
    replay::CameraChoice,
    scene::Scene,
};
use osp_testkit::{
    Editor,
    events::{SOLE, polygon},
};

/// Strokes that are drawn, erased and moved all the time.
fn session(seed: u64) -> Vec<Event> {
    let mut editor = Editor::new(seed);
    let start = editor.start();
    start.into_iter().chain((0..260).flat_map(|_| editor.edit())).collect()
}

fn studio(folder: &Path, events: &[Event]) -> Studio {
    let path = folder.join("session.ron");
    let mut writer = RonWriter::create(&path, &Header::new("", ""), Flush::AtEnd).expect("a file");
    events.iter().for_each(|event| writer.write(event).expect("a line"));
    writer.finish().expect("a file");
    let player = Session::to_play(&path, Pace::Samples(1), CameraChoice::Orbit).expect("a session");
    let autosaves = Autosaves::new(Some(folder.to_owned()));
    Studio::new(player, autosaves, IndexKind::BruteForce)
}

/// Compares the model with that of a second replay, which has played from the beginning to the same frame.
fn check_played(studio: &Studio) {
    let session = studio.session();
    let mut fresh =
        Session::to_play(session.path(), Pace::Samples(1), CameraChoice::Orbit).expect("a session");
    let position = |session: &Session| session.replay().expect("a replay").position();
    while position(&fresh) < position(session) {
        assert!(fresh.step(&mut Vec::new()));
    }
    let (scene, fresh) = (session.scene(), fresh.scene());
    assert!(scene.visible_ids().eq(fresh.visible_ids()));
    assert!(scene.visible_ids().all(|id| scene.polygon(id) == fresh.polygon(id)));
}

/// The polygons as a painter has uploaded them.
#[derive(Default)]
struct Sent(Vec<ConvexPolygon>);

impl Sent {
    /// The same as `Painter::follow`.
    fn follow(&mut self, studio: &mut Studio) {
        let pending = studio.take_pending();
        if pending.is_other_scene {
            self.0.clear();
        }
        if let Some(keep) = pending.keep {
            self.0.truncate(keep);
        }
        let scene = studio.scene();
        scene.for_each_change(&pending.changes, |change| {
            if let Change::Update(id) = change
                && let Some(sent) = self.0.get_mut(id.index())
            {
                *sent = scene.polygon(id);
            }
        });
        self.0.extend((self.0.len()..scene.polygon_count()).map(|i| scene.polygon(PolygonId(i as u32))));
    }

    fn check(&self, scene: &Scene, when: &str) {
        assert_eq!(self.0.len(), scene.polygon_count(), "{when}");
        for id in scene.visible_ids() {
            assert_eq!(self.0[id.index()], scene.polygon(id), "{id:?} is drawn elsewhere, {when}");
        }
    }
}

#[test]
fn wherever_a_replay_is_entered_what_is_drawn_is_the_model() {
    let folder = tempfile::tempdir().expect("a folder");
    for seed in 0..12 {
        let mut random = Pcg64::new(u128::from(seed), 3);
        let mut studio = studio(folder.path(), &session(seed));
        let mut sent = Sent::default();
        let frames = studio.session().replay().expect("a replay").frame_count();
        for round in 0..80 {
            // Several jumps and steps may fall between two frames.
            for _ in 0..1 + random.next_u64() % 3 {
                match random.next_u64() % 5 {
                    0..=1 => studio.command(Command::Seek(random.next_u64() % (frames + 1))),
                    2 => studio.command(Command::Step(random.next_u64() as i64 % 4)),
                    3 => studio.command(Command::Play(true)),
                    _ => studio.command(Command::Play(false)),
                }
            }
            studio.frame(Vec2::new(64.0, 64.0), 0.016);
            if !random.next_u64().is_multiple_of(3) {
                sent.follow(&mut studio);
                sent.check(studio.scene(), &format!("seed {seed}, round {round}"));
                assert_eq!(
                    studio.culling().pipeline().polygon_count() as u64,
                    studio.scene().counts().visible
                );
            }
        }
        check_played(&studio);
    }
}

#[test]
fn a_jump_names_what_has_moved_and_nothing_else() {
    let triangle = |stroke| polygon(stroke, [Vec3::ZERO, Vec3::X, Vec3::Y], (1.0, 1.0, 1.0, 1.0));
    let mut events: Vec<Event> = (0..5).map(|number| triangle(Some(StrokeId(number)))).collect();
    // Moves of a visible and of an invisible stroke.
    events.push(SOLE.erase(StrokeId(2)));
    events.push(SOLE.moved([StrokeId(1), StrokeId(2)], Vec3::X));
    events.push(SOLE.erase(StrokeId(3)));
    events.push(triangle(None));
    let folder = tempfile::tempdir().expect("a folder");
    studio(folder.path(), &events);
    let mut player =
        Session::to_play(&folder.path().join("session.ron"), Pace::Samples(1), CameraChoice::Orbit)
            .expect("a session");
    let end = player.replay().expect("a replay").frame_count();
    let jump = player.seek(4).expect("a replay");
    assert_eq!((jump.polygon_count, jump.moved.len()), (4, 0));
    let [a, b, c, d] = [0, 1, 2, 3].map(PolygonId);
    assert_eq!(jump.changes, [a, b, c, d].map(Change::Insert));
    let jump = player.seek(end).expect("a replay");
    assert_eq!((jump.polygon_count, &jump.moved[..]), (6, &[b, c][..]));
    let [e, f] = [4, 5].map(PolygonId);
    let forth = [Change::Remove(c), Change::Remove(d), Change::Insert(e), Change::Insert(f)];
    assert_eq!((jump.changes[0], &jump.changes[1..]), (Change::Update(b), &forth[..]));
    let jump = player.seek(4).expect("a replay");
    assert_eq!((jump.polygon_count, &jump.moved[..]), (4, &[b, c][..]));
    let back = [Change::Insert(c), Change::Insert(d), Change::Remove(e), Change::Remove(f)];
    assert_eq!((jump.changes[0], &jump.changes[1..]), (Change::Update(b), &back[..]));
}
