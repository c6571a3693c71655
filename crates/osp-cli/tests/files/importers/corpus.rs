//! Real files. What is pinned here was counted by other programs first (for `.tilt` and `.apa` a parser in Python).

use std::path::{Path, PathBuf};

use osp::math::rotate;
use osp_session::recording::{Event, Notes, OpenOptions, open};

use super::files::Counts;

/// The folder of real files, or one line that says there is none.
fn corpus() -> Option<PathBuf> {
    let folder = std::env::var_os("OSP_CORPUS").map(PathBuf::from);
    if folder.is_none() {
        eprintln!("skipped: OSP_CORPUS is not set");
    }
    folder
}

/// Reads a file to its end and insists that nothing is wrong with it.
fn read(path: &Path) -> (Counts, Notes) {
    let mut session = open(path, &OpenOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    let mut counts = Counts::default();
    for event in session.by_ref() {
        let event = event.unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(event.check(), Ok(()), "{}: {event:?}", path.display());
        counts.add(&event);
    }
    let notes = session.events.notes();
    assert_eq!(notes.skipped, 0, "{}: {notes:?}", path.display());
    (counts, notes)
}

#[test]
fn sketches_have_the_strokes_and_points_counted_elsewhere() {
    let Some(corpus) = corpus() else { return };
    let known = [
        ("tilt/tb_Promoted_TiltMech.tilt", 869, 21_393),
        ("tilt/tb_Intro_Intro_Sketch_Simple.tilt", 3_903, 79_792),
        ("tilt/Credits.tilt", 1_128, 26_803),
        ("tilt/ob_peacock-japan_by_Manami_Igarashi.tilt", 3_073, 87_245),
        ("tilt/tb_Empty.tilt", 0, 0),
        ("tilt/tb_Tests_OneStroke.tilt", 1, 4),
        ("apa/it_follows.apa", 288, 31_317),
        ("apa/demo_old.apa", 2, 85),
    ];
    for (name, strokes, points) in known {
        let (counts, _) = read(&corpus.join(name));
        assert_eq!((counts.begins, counts.points, counts.ends), (strokes, points, strokes), "{name}");
        assert_eq!((counts.heads, counts.erases, counts.polygons), (0, 0, 0), "{name}");
    }
}

#[test]
fn sketches_of_cassie_have_their_heads_and_erasures() {
    let Some(corpus) = corpus() else { return };
    // Strokes, samples, erasures, states with a tracked head (guitar and architecture begin untracked).
    let known = [
        ("01-2-1", 59, 691, 25, 574),
        ("chair", 336, 2_489, 137, 1_374),
        ("guitar", 313, 1_739, 165, 1_574),
        ("architecture", 130, 907, 67, 1_185),
        ("teapot", 196, 1_547, 119, 1_374),
    ];
    for (name, strokes, points, erases, heads) in known {
        let history = corpus.join(format!("cassie/sketch_history/{name}.json"));
        let raw = corpus.join(format!("cassie/raw_data/{name}.json"));
        let (counts, _) = read(&history);
        assert_eq!((counts.begins, counts.points, counts.ends), (strokes, points, strokes), "{name}");
        assert_eq!((counts.erases, counts.heads), (erases, heads), "{name}");
        assert_eq!(read(&raw).0, counts, "{name}: the other file of the pair gives the same session");
    }
}

/// The head as converted must be within an arm's length of the hand that draws, and look at it: this fails if canvas and
/// room are confused, or the axes, or the two ends of a stroke.
#[test]
fn the_head_of_cassie_watches_the_stroke_being_drawn() {
    let Some(corpus) = corpus() else { return };
    for name in ["01-2-1", "chair", "guitar", "architecture", "teapot"] {
        let path = corpus.join(format!("cassie/sketch_history/{name}.json"));
        let mut last_points = std::collections::BTreeMap::new();
        let mut head = None;
        let (mut distances, mut cosines) = (Vec::new(), Vec::new());
        for event in open(&path, &OpenOptions::default()).unwrap() {
            match event.unwrap() {
                Event::Head { t, p, q, .. } => head = Some((t, p, q)),
                Event::Point { stroke, p, .. } => _ = last_points.insert(stroke, p),
                // The action "add stroke" has the time of the stroke's end. Taken once: the mirror's twin comes second.
                Event::End { t, stroke } => {
                    if let Some((_, p, q)) = head.take_if(|head| head.0 == t) {
                        let sight = last_points[&stroke] - p;
                        distances.push(sight.length());
                        cosines.push(rotate(q, glam::Vec3::NEG_Z).dot(sight.normalize()));
                    }
                }
                _ => {}
            }
        }
        assert!(distances.len() > 50, "{name}: only {} strokes with a head at their end", distances.len());
        distances.sort_by(f32::total_cmp);
        cosines.sort_by(f32::total_cmp);
        let (tenth, last_tenth) = (distances.len() / 10, distances.len() - 1 - distances.len() / 10);
        // In metres of the canvas, which is 1 to 3 times its size: an arm's length of 0.24 to 0.61 m, or less.
        assert!(distances[tenth] > 0.08, "{name}: {}", distances[tenth]);
        assert!(distances[last_tenth] < 0.61, "{name}: {}", distances[last_tenth]);
        assert!(cosines[tenth] > 0.75, "{name}: {}", cosines[tenth]);
    }
}

#[test]
fn tracks_are_one_stroke_while_the_tracker_is_seen() {
    let Some(corpus) = corpus() else { return };
    for (name, points, height_m) in [
        ("haagh-tracking_replay_KN0_EXTERNAL_POSE", 3_518, 0.006),
        ("index-yank-up-down_T20_POSE", 6_462, 0.885),
    ] {
        let path = corpus.join(format!("poses/{name}.poses"));
        let (counts, _) = read(&path);
        assert_eq!((counts.begins, counts.points, counts.ends), (1, points, 1), "{name}");
        let spread = counts.highest - counts.lowest;
        // Pulled up and down: it is our y that varies.
        assert!((spread.y - height_m).abs() < 0.001, "{name}: {spread}");
    }
}

#[test]
fn scenes_have_every_face() {
    let Some(corpus) = corpus() else { return };
    for (name, polygons) in
        [("Castle.obj", 48_700), ("Sponza.obj.gz", 262_267), ("terrain_jacksboro.obj.gz", 137_886)]
    {
        let (counts, _) = read(&corpus.join("scenes").join(name));
        assert_eq!((counts.polygons, counts.begins), (polygons, 0), "{name}");
    }
}

/// The thumbnail's camera must see the sketch that it was taken of: all of it where the sketch is one figure.
#[test]
fn thumbnail_cameras_look_at_their_sketches() {
    let Some(corpus) = corpus() else { return };
    let figures = [
        "tb_Promoted_TiltMech",
        "tb_Promoted_Blue_Tit",
        "tb_Promoted_Fox_Rabbit_and_Eyeball",
        "tb_Promoted_Stay_Strong_Americans",
        "ob_peacock-japan_by_Manami_Igarashi",
        "tbtk_TiltBrushUnitySDK_Dungeon_Chest",
        "tbtk_sketch1",
        "n1ckfg_sketch",
    ];
    for name in figures {
        let session = open(&corpus.join(format!("tilt/{name}.tilt")), &OpenOptions::default()).unwrap();
        let camera = session.header.camera.expect("a camera");
        let camera_from_world = glam::Quat::from_xyzw(-camera.q.x, -camera.q.y, -camera.q.z, camera.q.w);
        let (mut seen, mut all) = (0_u32, 0_u32);
        for event in session {
            if let Event::Point { p, .. } = event.unwrap() {
                let view = rotate(camera_from_world, p - camera.p);
                let limit = (camera.fov_degrees / 2.0).to_radians().tan() * -view.z;
                seen += u32::from(view.z < 0.0 && view.x.abs() < limit && view.y.abs() < limit);
                all += 1;
            }
        }
        assert!(seen * 100 > all * 95, "{name}: {seen} of {all} points in view");
    }
}
