//! The settings for node tests and occluder scores of the window's occlusion culling.

use std::path::Path;

use glam::Vec2;
use osp::occlusion::{NodeTest, Occlusion, Score};
use osp_app::{Autosaves, Command, Session, Studio};
use osp_rivals::IndexKind;
use osp_session::{recording::Pace, replay::CameraChoice};

#[test]
fn nodes_are_tested_and_occluders_scored_as_asked() {
    let path = Path::new(osp_testkit::ROOT).join("recordings/room.ron");
    let folder = tempfile::tempdir().expect("a folder");
    let counts = |node_test: NodeTest, score: Score| {
        let player = Session::to_play(&path, Pace::Samples(16), CameraChoice::Auto).expect("a session");
        let autosaves = Autosaves::new(Some(folder.path().to_owned()));
        let mut studio = Studio::new(player, autosaves, IndexKind::OctreeRebuild);
        studio.set_tests(node_test, score);
        let mut sums = [0; 3];
        for frame in [301, 450, 600, 740] {
            studio.command(Command::Seek(frame));
            studio.frame(Vec2::new(800.0, 600.0), 0.016);
            studio.command(Command::Occlusion(Occlusion::Msvbsp.into()));
            studio.command(Command::Occluders(Some(8)));
            let found = studio.frame(Vec2::new(800.0, 600.0), 0.016).record.occlusion;
            for (sum, count) in sums.iter_mut().zip([found.occluded, found.tests, found.nodes]) {
                *sum += count;
            }
        }
        assert_eq!(studio.culling().tests(), (node_test, score));
        sums
    };
    let usual = counts(NodeTest::Box, Score::SolidAngle);
    assert!(usual[0] > 0, "{usual:?}");
    assert_ne!(counts(NodeTest::Sphere, Score::SolidAngle), usual);
    assert_ne!(counts(NodeTest::Corners, Score::SolidAngle), usual);
    assert_ne!(counts(NodeTest::Box, Score::Paper), usual);
}
