//! A world is there whole or not at all, and none is replaced unasked.

use std::{
    collections::BTreeMap,
    fs,
    path::Path,
    process::{Command, Stdio},
    time::{Duration, Instant},
};

use glam::Vec3;
use osp_net::world::{PackOrder, Replacing, World, WorldError, WorldWriter};
use osp_session::{recording::SynthKind, scene::Scene};

use super::{open, pack, place_to_read, place_to_write, session};
use crate::OSP;
use osp_testkit::temp;

const HERE: &[Vec3] = &[Vec3::ZERO];

/// All files of a folder and their contents.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut files = BTreeMap::new();
    for name in ["", "blocks"] {
        for entry in fs::read_dir(folder.join(name)).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_file() {
                let name = path.strip_prefix(folder).expect("below").to_string_lossy().into_owned();
                files.insert(name, fs::read(path).expect("a file"));
            }
        }
    }
    files
}

fn assert_none(folder: &Path) {
    match World::open(place_to_read(folder)) {
        Err(WorldError::Place { problem, .. }) => {
            assert!(problem.contains("manifest.osp-world"), "{problem}")
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn the_same_sessions_make_the_same_world() {
    let room = session(SynthKind::Room, 20_000, 1);
    let (a, b) = (temp(), temp());
    for folder in [&a, &b] {
        pack(folder.path(), PackOrder::Space, &[(&room, &[Vec3::ZERO, Vec3::X * 9.0])]).expect("packed");
    }
    let files_of_a = files(a.path());
    assert!(files_of_a.len() >= 2 && files_of_a == files(b.path()));
    let world = open(a.path());
    assert_eq!(world.manifest.polygon_count(), 2 * room.counts().visible);
    assert_eq!(world.manifest.sources[0].copies, 2);
}

#[test]
fn without_its_end_a_pack_leaves_no_world_and_the_next_one_tidies_up() {
    let (room, scribble) = (session(SynthKind::Room, 6_000, 1), session(SynthKind::Scribble, 3_000, 1));
    let folder = temp();
    let place = place_to_write(folder.path());
    let mut writer = WorldWriter::create(place, Replacing::Never, PackOrder::Strokes).expect("begun");
    // More than one object, so that some are written.
    writer.add("room", &room, &[Vec3::ZERO; 60]).expect("blocks");
    drop(writer);
    let left = files(folder.path());
    assert!(left.keys().any(|name| name.ends_with(".osp-blocks")), "{:?}", left.keys());
    assert_none(folder.path());
    pack(folder.path(), PackOrder::Space, &[(&scribble, HERE)]).expect("packed");
    let world = open(folder.path());
    assert_eq!(world.manifest.polygon_count(), scribble.counts().visible);
    assert_eq!(files(folder.path()).len(), 1 + world.manifest.object_count(), "what was left is gone");
}

#[test]
fn a_pack_that_is_killed_leaves_no_world() {
    let folder = temp();
    let out = folder.path().join("out");
    let mut child = Command::new(OSP.0)
        .args(["pack", "recordings/room.ron", "--repeat", "40x1x20", "--out"])
        .arg(&out)
        .stdout(Stdio::null())
        .current_dir(osp_testkit::ROOT)
        .spawn()
        .expect("the program starts");
    let start = Instant::now();
    let has_written = || fs::read_dir(out.join("blocks")).is_ok_and(|blocks| blocks.count() > 0);
    while !has_written() {
        assert!(start.elapsed() < Duration::from_secs(120), "nothing is written");
        std::thread::sleep(Duration::from_millis(1));
    }
    child.kill().expect("it runs still");
    child.wait().expect("it has ended");
    assert_none(&out);
    let scribble = session(SynthKind::Scribble, 500, 1);
    pack(&out, PackOrder::Space, &[(&scribble, HERE)]).expect("packed");
    assert_eq!(open(&out).manifest.polygon_count(), scribble.counts().visible);
}

#[test]
fn a_world_is_replaced_only_when_asked_and_only_by_a_whole_one() {
    let (room, scribble) = (session(SynthKind::Room, 2_000, 1), session(SynthKind::Scribble, 500, 1));
    let folder = temp();
    pack(folder.path(), PackOrder::Space, &[(&room, HERE)]).expect("packed");
    let before = files(folder.path());
    let refused = pack(folder.path(), PackOrder::Space, &[(&scribble, HERE)]);
    assert!(matches!(refused, Err(WorldError::Exists { .. })), "{refused:?}");
    assert_eq!(files(folder.path()), before);
    let replace = |ends: bool| {
        let place = place_to_write(folder.path());
        let mut writer = WorldWriter::create(place, Replacing::World, PackOrder::Space).expect("begun");
        writer.add("scribble", &scribble, HERE).expect("blocks");
        if ends {
            writer.finish().expect("packed");
        }
    };
    replace(false);
    assert_eq!(open(folder.path()).manifest.polygon_count(), room.counts().visible);
    replace(true);
    let world = open(folder.path());
    assert_eq!(world.manifest.polygon_count(), scribble.counts().visible);
    assert_eq!(files(folder.path()).len(), 1 + world.manifest.object_count());
}

#[test]
fn while_a_pack_runs_no_other_begins_in_its_place() {
    let (room, scribble) = (session(SynthKind::Room, 2_000, 1), session(SynthKind::Scribble, 500, 1));
    let folder = temp();
    let begin = |replacing: Replacing| {
        WorldWriter::create(place_to_write(folder.path()), replacing, PackOrder::Space)
    };
    let mut first = begin(Replacing::World).expect("begun");
    first.add("session", &room, HERE).expect("blocks");
    for replacing in [Replacing::Never, Replacing::World] {
        let refused = begin(replacing);
        assert!(matches!(refused, Err(WorldError::Busy { .. })), "{refused:?}");
    }
    first.finish().expect("packed");
    assert_eq!(
        files(folder.path()).len(),
        1 + open(folder.path()).manifest.object_count(),
        "no mark is left"
    );
    // One that ended without a world keeps nobody away either.
    drop(begin(Replacing::World).expect("begun"));
    let mut second = begin(Replacing::World).expect("begun");
    second.add("session", &scribble, HERE).expect("blocks");
    second.finish().expect("packed");
    assert_eq!(open(folder.path()).manifest.polygon_count(), scribble.counts().visible);
}

#[test]
fn a_pack_whose_blocks_were_removed_replaces_nothing() {
    let (room, scribble) = (session(SynthKind::Room, 6_000, 1), session(SynthKind::Scribble, 500, 1));
    let folder = temp();
    pack(folder.path(), PackOrder::Space, &[(&scribble, HERE)]).expect("packed");
    let before = files(folder.path());
    let place = place_to_write(folder.path());
    let mut writer = WorldWriter::create(place, Replacing::World, PackOrder::Space).expect("begun");
    // More than one object, so that some are written before it ends.
    writer.add("room", &room, &[Vec3::ZERO; 60]).expect("blocks");
    let written: Vec<String> =
        files(folder.path()).into_keys().filter(|name| !before.contains_key(name)).collect();
    let blocks: Vec<&String> = written.iter().filter(|name| name.ends_with(".osp-blocks")).collect();
    assert!(!blocks.is_empty(), "{written:?}");
    fs::remove_file(folder.path().join(blocks[0])).expect("removed");
    let error = writer.finish().expect_err("blocks are gone").to_string();
    assert!(error.contains(blocks[0].as_str()) && error.contains("written, but gone"), "{error}");
    let world = open(folder.path());
    assert_eq!(world.manifest.polygon_count(), scribble.counts().visible);
    for number in 0..world.manifest.blocks.len() as u32 {
        world.load(number).expect("a whole block");
    }
}

#[test]
fn nothing_makes_an_empty_world() {
    let folder = temp();
    pack(folder.path(), PackOrder::Space, &[(&Scene::new(), HERE)]).expect("packed");
    let world = open(folder.path());
    assert_eq!((world.manifest.polygon_count(), world.manifest.blocks.len()), (0, 0));
    assert!(world.bounds.is_empty());
}
