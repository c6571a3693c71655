//! A session that is read in steps, like on a page, is the same as one that is read at once.

use std::{fs, path::PathBuf, time::Duration};

use glam::Vec2;
use osp::{
    frame::Pipeline,
    index::{IndexConfig, Osp},
    occlusion::Occlusion,
};
use osp_app::{
    Access, Autosaves, Button, Command, Opening, Replay, ReplayReader, ReplayStart, Session, Studio,
};
use osp_session::{
    recording::{OpenOptions, Pace},
    replay::{CameraChoice, SessionFingerprint, fingerprint_of_frame},
};

use osp_testkit::wait_for;

use crate::drawing::{Table, across};

/// The clock advances meanwhile, so a turn is one step.
const ONE_STEP: Duration = Duration::from_nanos(1);

/// Number of frames between two compared pictures.
const EVERY: u64 = 16;

/// Returns shipped sessions, and one of each format from the folder of real files, if one is named.
#[expect(clippy::print_stderr, reason = "a test that is skipped says why")]
fn sessions() -> Vec<PathBuf> {
    let recordings = concat!(env!("CARGO_MANIFEST_DIR"), "/../../recordings");
    let mut paths = ["room.ron", "grow.ron", "nested.ron", "class.ron"]
        .map(|name| PathBuf::from(recordings).join(name))
        .to_vec();
    match std::env::var_os("OSP_CORPUS").map(PathBuf::from) {
        Some(corpus) => {
            let first = |folder: &str| {
                let files = fs::read_dir(corpus.join(folder)).expect("a folder of sketches");
                files.map(|file| file.expect("an entry").path()).min().expect("a sketch")
            };
            paths.extend([corpus.join("tilt/tb_Promoted_Blue_Tit.tilt"), corpus.join("apa/dancer.apa")]);
            paths.push(first("cassie/raw_data"));
        }
        None => eprintln!("skipped: sketches of other programs, for OSP_CORPUS is not set"),
    }
    paths
}

fn replay_of(session: &Session) -> &Replay {
    session.replay().expect("a replay")
}

/// Returns the content of every n-th frame of a player, and its data before that.
fn told(mut player: Session) -> (String, u64) {
    let known = format!(
        "{:?} {:?} {:?} {:?} {:?} {:?}",
        player.header(),
        replay_of(&player).frame_count(),
        player.bounds(),
        player.background(),
        &replay_of(&player).stroke_starts,
        player.remarks()
    );
    let frames = replay_of(&player).frame_count();
    let mut pipeline = Pipeline::new(Box::new(Osp::new(&IndexConfig::default())), 0);
    let (mut whole, mut changes) = (SessionFingerprint::new(), Vec::new());
    while player.step(&mut changes) {
        if !replay_of(&player).position().is_multiple_of(EVERY) && replay_of(&player).position() < frames {
            continue;
        }
        pipeline.frame(player.scene(), &changes, &replay_of(&player).view());
        whole.add(replay_of(&player).position() - 1, fingerprint_of_frame(pipeline.draw_list().ids()));
        changes.clear();
    }
    // A jump uses the snapshots.
    player.seek(frames / 3);
    (format!("{known} {:?}", player.scene().counts()), whole.value())
}

#[test]
fn a_replay_that_is_read_in_steps_is_the_one_that_is_read_at_once() {
    let (pace, camera, options) = (Pace::Recorded, CameraChoice::Auto, OpenOptions::default());
    for path in sessions() {
        let at_once = Session::to_play_with(&path, pace, camera, &options).expect("a session");
        let mut reader = ReplayReader::new(&path, pace, camera, &options);
        let (mut steps, mut events) = (0, 0);
        let in_steps = loop {
            let player = reader.step().expect("a session");
            assert!(reader.events - events <= Pace::MOST_EVENTS as u64 * 4, "a step reads a frame");
            (steps, events) = (steps + 1, reader.events);
            if let Some(player) = player {
                break player;
            }
        };
        assert!(reader.step().expect("nothing more").is_none());
        // Each frame was read in one step, and played in another one.
        assert!(steps >= 2 * replay_of(&at_once).frame_count(), "{}: {steps} steps", path.display());
        assert_eq!(told(at_once), told(in_steps), "{}", path.display());
    }
}

/// Returns the content of the window for a document, and of its file.
fn shown(studio: &mut Studio) -> (String, u64) {
    studio.frame(Vec2::new(800.0, 600.0), 0.0);
    studio.frame(Vec2::new(800.0, 600.0), 0.0);
    let document = studio.session();
    let (counts, bounds) = (document.scene().counts(), document.bounds());
    let known = format!(
        "{counts:?} {bounds:?} {} {} {:?}",
        document.event_count(),
        document.last_secs(),
        document.polygon_times()
    );
    (known, fingerprint_of_frame(studio.culling().drawn(0).ids()))
}

#[test]
fn a_session_that_is_read_in_turns_is_the_one_that_is_read_at_once() {
    for path in sessions() {
        let how = Opening::with(Access::Copy);
        let mut at_once = Table::new();
        // The hidden polygons depend on the order in which occluders were offered.
        at_once.studio.command(Command::Occlusion(Occlusion::Msvbsp.into()));
        at_once.studio.command(Command::OpenAs(path.clone(), how));
        let mut in_turns = Table::new();
        in_turns.studio.command(Command::Occlusion(Occlusion::Msvbsp.into()));
        in_turns.studio.work_in_turns(ONE_STEP);
        in_turns.studio.command(Command::OpenAs(path.clone(), how));
        let (mut turns, mut frames) = (0, 0);
        while in_turns.studio.is_working() {
            // A frame shows the previous content, and does not take a turn.
            assert_eq!(in_turns.visible(), 0);
            in_turns.frame();
            frames += 1;
            assert_eq!(in_turns.studio.tend_within(), Duration::ZERO, "turns follow each other");
            in_turns.studio.tend();
            turns += 1;
        }
        let polygons = in_turns.visible();
        // The parts have 1,024 events or polygons.
        assert!(turns as u64 > polygons / 1024, "{}: {turns} turns, {frames} frames", path.display());
        assert_eq!(shown(&mut at_once.studio), shown(&mut in_turns.studio), "{}", path.display());
        // The saved files are the same, except for the name of the folder.
        let saved = [at_once, in_turns].map(|mut table| {
            let file = table.folder.path().join("saved.ron");
            table.studio.command(Command::SaveAs(file.clone()));
            let text = fs::read_to_string(file).expect("saved");
            text.split_once('\n').expect("lines").1.to_owned()
        });
        assert!(saved[0] == saved[1], "{}", path.display());
    }
}

/// A sketch of a person, and a session that takes a while to read.
fn before(table: &mut Table) -> (PathBuf, u64, PathBuf) {
    table.drag(Button::Primary, &across(0.0));
    table.studio.work_in_turns(ONE_STEP);
    let document = table.studio.session();
    let drawn = document.path().to_owned();
    (
        drawn,
        table.visible(),
        PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../recordings/portrait.ron")),
    )
}

#[test]
fn a_session_that_is_read_in_turns_is_given_up_at_any_time() {
    let own = Table::new();
    let path = own.folder.path().join("own.ron");
    let shipped = concat!(env!("CARGO_MANIFEST_DIR"), "/../../recordings/portrait.ron");
    let text = fs::read_to_string(shipped).expect("a recording");
    let (_, events) = text.split_once('\n').expect("lines");
    fs::write(&path, format!("Header(format:1,name:\"own\",source:\"osp sketch 0\")\n{events}"))
        .expect("written");
    for after in [0, 1, 5, 20, 100] {
        let mut table = Table::new();
        let (drawn, visible, _) = before(&mut table);
        table.studio.command(Command::Open(path.clone()));
        for _ in 0..after {
            table.studio.tend();
        }
        let was_reading = table.studio.is_reading();
        table.studio.command(Command::CancelWork);
        table.studio.tend();
        assert!(!table.studio.is_working(), "it ends in the next turn");
        let document = table.studio.session();
        if was_reading {
            assert_eq!((document.path(), table.visible()), (&*drawn, visible));
            let said = table.studio.messages().last().expect("a message");
            assert!(said.ends_with("opening it was cancelled"), "{said}");
        }
        drop(table.studio);
        // The lock of the file was released.
        let autosaves = Autosaves::new(Some(own.folder.path().join("autosaves")));
        let (document, _) = Session::open(&path, &autosaves).expect("nobody holds it");
        document.close().expect("nothing was drawn");
    }
}

#[test]
fn a_replay_takes_the_place_of_a_sketch_or_leaves_it_there() {
    let mut table = Table::new();
    let (drawn, visible, path) = before(&mut table);
    let replay = |studio: &mut Studio, path: &PathBuf| {
        let options = OpenOptions::default();
        studio.replay_in_background(path, Pace::Recorded, CameraChoice::Auto, &options, ReplayStart::Playing);
    };
    let is_left = |table: &Table| {
        let document = table.studio.session();
        assert_eq!((document.path(), table.visible()), (&*drawn, visible));
    };
    // One replay is cancelled, and one cannot be read.
    replay(&mut table.studio, &path);
    table.studio.tend();
    let shown = wait_for("the progress", || table.studio.work_shown());
    assert!(shown.text.starts_with("reading ") && shown.text.ends_with(" events"), "{shown:?}");
    table.studio.command(Command::CancelWork);
    table.studio.tend();
    is_left(&table);
    assert!(table.studio.take_unread().is_none() && !table.studio.is_closing());
    let said = table.studio.messages().last().expect("a message");
    assert!(said.ends_with("portrait.ron: opening it was cancelled"), "{said}");
    let nonsense = table.folder.path().join("nonsense");
    fs::write(&nonsense, "nonsense").expect("written");
    replay(&mut table.studio, &nonsense);
    table.studio.tend();
    is_left(&table);
    let why = table.studio.take_unread().expect("why it is not shown").to_string();
    assert!(why.contains("nonsense") && !table.studio.is_closing(), "{why}");
    // The last one can be read. A turn of one step a frame would take minutes.
    table.studio.work_in_turns(Duration::from_micros(100));
    replay(&mut table.studio, &path);
    assert!(table.studio.is_reading(), "it takes more than a turn");
    while table.studio.is_working() {
        table.studio.tend();
    }
    let player = replay_of(table.studio.session());
    assert!(player.is_playing() && table.studio.session().path() == path && player.position() == 0);
}
