mod lines;
mod touched;

use std::{fs, path::PathBuf, process::Command};

use glam::Vec3;

use super::*;
use crate::{Access, OpenError, Opening, Session};
use osp_session::recording::{self, Author, Flush, Limits, OpenOptions, RonWriter, StrokeId};

struct Desk {
    folder: tempfile::TempDir,
}

impl Desk {
    fn new() -> Self {
        Self { folder: tempfile::tempdir().expect("a folder") }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn autosaves(&self) -> Autosaves {
        Autosaves::new(Some(self.path("autosaves")))
    }

    /// Creates a session of three events at this path and closes it.
    fn drawn(&self, name: &str) -> PathBuf {
        let mut document = self.open(name);
        draw(&mut document, 3);
        document.close().expect("written");
        self.path(name)
    }

    fn open(&self, name: &str) -> Session {
        Session::open(&self.path(name), &self.autosaves()).expect("a session").0
    }

    fn autosaved(&self) -> Vec<PathBuf> {
        let Ok(entries) = fs::read_dir(self.path("autosaves")) else { return Vec::new() };
        let mut found: Vec<PathBuf> = entries.map(|entry| entry.expect("an entry").path()).collect();
        found.sort();
        found
    }
}

fn draw(document: &mut Session, events: u32) {
    for _ in 0..events {
        let t = document.last_secs() + 1.0;
        assert!(document.apply(Event::Undo { author: Author::SOLE, t }));
    }
}

fn events_in(path: &Path) -> usize {
    let events = recording::open(path, &OpenOptions::default()).expect("a recording");
    events.inspect(|event| assert!(event.is_ok(), "whole lines: {event:?}")).count()
}

fn header() -> Header {
    Header::new("test", "osp sketch, a test")
}

fn later() -> Instant {
    Instant::now() + 2 * RETRY
}

#[test]
fn every_event_is_in_the_file_at_once_and_a_crash_is_found() {
    let desk = Desk::new();
    let autosaves = desk.autosaves();
    let mut journal = Journal::unnamed(&autosaves, "sketch", header()).expect("a header");
    assert!(!journal.path().exists(), "nothing is written before the first event");
    assert!(!journal.is_named());
    for count in 1..5 {
        journal.write(&Event::Undo { author: Author::SOLE, t: 0.0 }).expect("an event");
        assert_eq!(events_in(journal.path()), count);
    }
    let path = journal.path().to_owned();
    assert_eq!(autosaves.marked(), std::slice::from_ref(&path));
    assert!(SessionLock::take_over(&path).is_none(), "its program lives");
    // A crash: the lock vanishes with the program, the lock file stays.
    drop(journal);
    let (mut document, opened) = Session::recover_or_new(&autosaves, Limits::DEFAULT);
    assert!(opened.is_recovered && !document.journal().is_named());
    draw(&mut document, 1);
    assert_eq!(events_in(&path), 5);
    document.close().expect("written");
    assert_eq!(autosaves.marked(), Vec::<PathBuf>::new(), "closed on purpose");
    assert!(path.exists());
}

#[test]
fn a_session_without_events_leaves_no_file() {
    let desk = Desk::new();
    let make = || Journal::unnamed(&desk.autosaves(), "sketch", header()).expect("a header");
    let (first, second) = (make(), make());
    assert_ne!(first.path(), second.path());
    first.close().expect("nothing to write");
    drop(second);
    assert!(desk.autosaves().marked().is_empty());
    assert!(desk.autosaved().is_empty());
}

#[test]
fn an_unchanged_session_is_closed_as_it_was_found() {
    let desk = Desk::new();
    let whole = fs::read(desk.drawn("a.ron")).expect("a file");
    let torn =
        [&whole[..], b"Begin(t:9,stroke:0,tool:Ribbon,width:1.0,color:(1,1,1,1))\nPoint(t:10,str"].concat();
    for bytes in [&whole[..], &torn, &torn[..torn.len() - 15]] {
        fs::write(desk.path("a.ron"), bytes).expect("written");
        let modified = || fs::metadata(desk.path("a.ron")).and_then(|data| data.modified()).expect("a time");
        let before = modified();
        let mut document = desk.open("a.ron");
        document.journal_mut().tend(later());
        assert!(document.scene().strokes().iter().all(|stroke| !stroke.is_open()));
        document.close().expect("nothing to write");
        assert!(fs::read(desk.path("a.ron")).expect("a file") == bytes);
        assert_eq!(modified(), before);
        assert_eq!(fs::read_dir(desk.folder.path()).expect("the folder").count(), 1, "nothing else is there");
        // Postponed events are written with the first event.
        let mut document = desk.open("a.ron");
        draw(&mut document, 1);
        let (events, file) = (document.event_count(), desk.path("a.ron"));
        assert_eq!(events_in(&file) as u64, events);
        document.close().expect("written");
    }
}

#[test]
fn a_session_has_one_writer() {
    let desk = Desk::new();
    for name in ["there.ron", "not-there-yet.ron"] {
        if name == "there.ron" {
            desk.drawn(name);
        }
        let path = desk.path(name);
        let mut first = desk.open(name);
        let second = Session::open(&path, &desk.autosaves());
        let Err(OpenError::Held(held)) = second else { panic!("held: {second:?}") };
        let said = held.to_string();
        assert!(said.contains(&std::process::id().to_string()) && said.contains("since"), "{said}");
        draw(&mut first, 1);
        let events = events_in(&path);
        // Reading the session, and drawing on a copy of it, is allowed.
        let (mut looking, _) =
            Session::open_as(&path, &desk.autosaves(), Opening::with(Access::ReadOnly)).expect("readable");
        assert!(looking.is_read_only() && !looking.apply(Event::Undo { author: Author::SOLE, t: 0.0 }));
        looking.close().expect("nothing to write");
        let copy = Opening::with(Access::Copy);
        let (mut copy, _) = Session::open_as(&path, &desk.autosaves(), copy).expect("readable");
        draw(&mut copy, 5);
        assert_eq!(events_in(copy.path()), events + 5);
        copy.close().expect("written");
        draw(&mut first, 1);
        assert_eq!(events_in(&path), events + 1);
        // Nor can another session be saved to its path.
        let mut other = Session::new(&desk.autosaves());
        draw(&mut other, 1);
        let refused = other.save_as(&path).expect_err("held");
        assert!(matches!(refused, SaveError::Held(_)), "{refused}");
        assert_eq!(events_in(&path), events + 1);
        other.close().expect("written");
        first.close().expect("written");
        desk.open(name).close().expect("free again");
    }
}

#[cfg(unix)]
#[test]
fn another_name_of_the_file_is_no_way_around() {
    let desk = Desk::new();
    let path = desk.drawn("a.ron");
    std::os::unix::fs::symlink(&path, desk.path("soft.ron")).expect("a link");
    fs::hard_link(&path, desk.path("hard.ron")).expect("a link");
    let first = desk.open("a.ron");
    for name in ["soft.ron", "hard.ron"] {
        let second = Session::open(&desk.path(name), &desk.autosaves());
        assert!(matches!(second, Err(OpenError::Held(_))), "{name}: {second:?}");
    }
    first.close().expect("unchanged");
    assert_eq!(fs::read_dir(desk.folder.path()).expect("the folder").count(), 3);
}

/// Changes to a file, by other programs, while it is open.
type Accident = (&'static str, fn(&Path));

fn accidents() -> [Accident; 6] {
    [
        ("removed", |path| fs::remove_file(path).expect("removed")),
        ("replaced", |path| {
            let other = path.with_extension("other");
            fs::write(&other, "somebody's work").expect("written");
            fs::rename(other, path).expect("renamed");
        }),
        ("appended to", |path| {
            use std::io::Write;
            let mut file = fs::File::options().append(true).open(path).expect("the file");
            file.write_all(b"// a remark\n").expect("written");
        }),
        ("written over in place", |path| {
            use std::io::{Seek, SeekFrom, Write};
            let data = || fs::metadata(path).expect("the file");
            let before = data();
            // The system's clock for files advances in steps of some milliseconds.
            osp_testkit::wait_until("a later time", || {
                let mut file = fs::File::options().write(true).open(path).expect("the file");
                file.seek(SeekFrom::Start(80)).expect("a place");
                file.write_all(b"########").expect("written");
                file.set_modified(before.modified().expect("a time")).expect("set back");
                contents::Stamp::of(&data()) != contents::Stamp::of(&before)
            });
        }),
        ("emptied", |path| drop(fs::File::create(path).expect("the file"))),
        ("its folder moved", |path| {
            let folder = path.parent().expect("a folder");
            fs::rename(folder, folder.with_extension("moved")).expect("renamed");
        }),
    ]
}

#[test]
fn a_file_that_is_lost_is_left_alone_and_nothing_of_the_session_is_lost() {
    for (what, accident) in accidents() {
        for notice_by in ["an event", "a pause", "the end"] {
            let case = format!("{what}, noticed by {notice_by}");
            let desk = Desk::new();
            fs::create_dir(desk.path("work")).expect("a folder");
            let path = desk.drawn("work/a.ron");
            let mut document = desk.open("work/a.ron");
            draw(&mut document, 4);
            accident(&path);
            let left = fs::read(&path).ok();
            match notice_by {
                "an event" => draw(&mut document, 1),
                "a pause" => document.journal_mut().tend(Instant::now()),
                _ => {}
            }
            if notice_by != "the end" {
                assert!(document.journal().trouble().is_some_and(Trouble::is_lost), "{case}");
                let news = document.take_news().join("\n");
                assert!(news.contains("a.ron"), "{case}: {news}");
                // If power failed now, the shelter would have all events.
                let shelter = document.journal().shelter().expect("a shelter");
                assert_eq!(events_in(shelter) as u64, document.event_count(), "{case}");
                draw(&mut document, 2);
            }
            let events = document.event_count();
            assert_eq!(document.journal().missing(), 0, "{case}");
            let unwritten = document.close().expect_err("not without a word");
            assert_eq!(fs::read(&path).ok(), left, "{case}: nothing of another's is touched");
            let kept_in = unwritten.kept_in.as_ref().expect("a shelter");
            assert_eq!(events_in(kept_in) as u64, events, "{case}");
            assert!(unwritten.to_string().contains(&kept_in.display().to_string()), "{unwritten}");
            // The next window restores it.
            let (document, opened) = Session::recover_or_new(&desk.autosaves(), Limits::DEFAULT);
            assert!(opened.is_recovered && document.event_count() == events, "{case}");
            document.close().expect("unchanged");
        }
    }
}

#[test]
fn a_lost_session_is_saved_whole_elsewhere_and_at_its_own_place() {
    for (what, accident) in accidents() {
        for to in ["elsewhere.ron", "work/a.ron"] {
            let desk = Desk::new();
            fs::create_dir(desk.path("work")).expect("a folder");
            let path = desk.drawn("work/a.ron");
            let mut document = desk.open("work/a.ron");
            draw(&mut document, 2);
            accident(&path);
            draw(&mut document, 2);
            if what == "its folder moved" {
                fs::create_dir(desk.path("work")).expect("a folder");
            }
            document.save_as(&desk.path(to)).expect("saved");
            assert_eq!(document.journal().trouble(), None, "{what} {to}");
            draw(&mut document, 1);
            assert_eq!(events_in(&desk.path(to)), 8, "{what} {to}");
            assert!(desk.autosaved().is_empty(), "the shelter is not needed any more");
            document.close().expect("written");
            desk.open(to).close().expect("no lock is left");
        }
    }
}

#[test]
fn a_file_that_comes_back_is_gone_on_with() {
    let desk = Desk::new();
    let path = desk.drawn("a.ron");
    let mut document = desk.open("a.ron");
    draw(&mut document, 1);
    fs::rename(&path, desk.path("away")).expect("renamed");
    draw(&mut document, 1);
    assert_eq!(document.journal().trouble(), Some(&Trouble::Removed));
    fs::rename(desk.path("away"), &path).expect("renamed");
    document.journal_mut().tend(later());
    assert_eq!(document.journal().trouble(), None);
    assert_eq!(events_in(&path), 5);
    assert!(desk.autosaved().is_empty());
    document.close().expect("written");
}

#[test]
fn a_session_without_a_name_goes_on_in_another_file() {
    let desk = Desk::new();
    let mut document = Session::new(&desk.autosaves());
    draw(&mut document, 2);
    let first = document.path().to_owned();
    fs::remove_dir_all(desk.path("autosaves")).expect("removed");
    draw(&mut document, 1);
    let second = document.path().to_owned();
    assert_eq!(document.journal().trouble(), None);
    assert_ne!(first, second);
    assert_eq!(events_in(&second), 3);
    let news = document.take_news().join("\n");
    assert!(news.contains("removed") && news.contains(&second.display().to_string()), "{news}");
    document.close().expect("written");
}

#[test]
fn saving_elsewhere_moves_a_session_without_a_name() {
    let desk = Desk::new();
    let mut document = Session::new(&desk.autosaves());
    draw(&mut document, 1);
    let old = document.path().to_owned();
    let refused = document.save_as(&desk.path("no/such/folder.ron"));
    assert!(refused.expect_err("no folder").to_string().contains("folder.ron"));
    let refused = document.save_as(&desk.path("model.obj"));
    assert!(refused.expect_err("no recording").to_string().contains(".ron"));
    assert_eq!(document.path(), old);
    let new = desk.path("mine.ron");
    document.save_as(&new).expect("saved");
    draw(&mut document, 1);
    assert_eq!(events_in(&new), 2);
    assert!(!old.exists() && document.journal().is_named() && desk.autosaved().is_empty());
    document.save_as(&new).expect("to the same place");
    assert_eq!(events_in(&new), 2);
    document.close().expect("written");
}

#[test]
fn events_wait_where_the_file_cannot_be_made() {
    let desk = Desk::new();
    fs::create_dir(desk.path("blocked")).expect("a folder");
    let mut document = desk.open("blocked/a.ron");
    // Files where folders are expected.
    fs::remove_dir_all(desk.path("blocked")).expect("removed");
    fs::write(desk.path("blocked"), "").expect("a file");
    fs::write(desk.path("autosaves"), "").expect("a file");
    draw(&mut document, 2);
    assert_eq!((document.journal().missing(), document.journal().shelter()), (2, None));
    assert!(document.journal().trouble().is_some());
    fs::remove_file(desk.path("blocked")).expect("removed");
    document.journal_mut().tend(later());
    assert_eq!((document.journal().missing(), document.journal().trouble()), (0, None));
    assert_eq!(events_in(&desk.path("blocked/a.ron")), 2);
    document.close().expect("written");
}

#[test]
fn a_pause_brings_everything_to_the_disk() {
    let desk = Desk::new();
    let mut document = desk.open("a.ron");
    let before = Instant::now();
    draw(&mut document, 2);
    assert!(!document.journal().is_synced());
    document.journal_mut().tend(before);
    assert!(!document.journal().is_synced(), "this is no pause");
    // It is synced on another thread.
    while !document.journal().is_synced() {
        document.journal_mut().tend(later());
    }
    draw(&mut document, 1);
    document.journal_mut().settle().expect("written");
    assert!(document.journal().is_synced(), "so does the end");
    document.close().expect("written");
}

#[test]
fn a_move_of_very_many_strokes_is_one_line_and_what_is_longer_stops_nothing() {
    let desk = Desk::new();
    let mut document = desk.open("a.ron");
    let moved = |count: usize| {
        let strokes = (0..count).map(|i| StrokeId(u32::MAX - i as u32)).collect();
        Event::Move { author: Author::SOLE, t: 1.0, strokes, by: Vec3::X }
    };
    for count in [170_000, Event::MAX_STROKES_NAMED] {
        assert!(document.apply(moved(count)), "{count} strokes");
    }
    assert!(!document.apply(moved(Event::MAX_STROKES_NAMED + 1000)), "no line holds it");
    assert_eq!(document.refused(), 1);
    assert!(document.take_news().join("\n").contains("invalid changes were skipped"));
    draw(&mut document, 1);
    assert_eq!(document.journal().trouble(), None);
    document.close().expect("written");
    assert_eq!(events_in(&desk.path("a.ron")), 3);
}

/// A disk of a few kilobytes: the test runs itself under a limit of the file size, which acts like a full disk.
#[test]
fn a_full_disk_loses_nothing() {
    const INSIDE: &str = "OSP_TEST_INSIDE_A_LIMIT";
    if std::env::var_os(INSIDE).is_some() {
        return on_a_full_disk();
    }
    let has_limits = Command::new("prlimit").arg("--version").output().is_ok_and(|run| run.status.success());
    if !has_limits {
        eprintln!("skipped: there is no `prlimit` here to make a disk small");
        return;
    }
    // Beyond the limit the system would send a signal that ends the program, instead of refusing the write.
    let script = "trap '' XFSZ; exec \"$0\" --exact journal::tests::a_full_disk_loses_nothing --nocapture";
    let program = std::env::current_exe().expect("this program");
    let run = Command::new("sh").args(["-c", script]).arg(program).env(INSIDE, "1").output().expect("sh");
    let said = String::from_utf8_lossy(&run.stdout).into_owned() + &String::from_utf8_lossy(&run.stderr);
    assert!(run.status.success() && said.contains("1 passed"), "{said}");
}

fn limit_files(bytes: &str) {
    let process = std::process::id().to_string();
    let limit = format!("--fsize={bytes}:");
    let status = Command::new("prlimit").args(["--pid", &process, &limit]).status().expect("prlimit");
    assert!(status.success());
}

fn on_a_full_disk() {
    let desk = Desk::new();
    let path = desk.drawn("a.ron");
    let mut document = desk.open("a.ron");
    limit_files("2000");
    draw(&mut document, 1000);
    let (events, journal) = (document.event_count(), document.journal());
    assert!(journal.trouble().is_some_and(|trouble| !trouble.is_lost()), "{:?}", journal.trouble());
    // The shelter is on the same disk.
    let in_file = events_in(&path) as u64;
    assert!(in_file > 50 && journal.missing() == events - in_file, "{in_file} and {}", journal.missing());
    let refused = document.save_as(&desk.path("b.ron")).expect_err("no room there either");
    assert!(refused.to_string().contains("b.ron") && !desk.path("b.ron").exists(), "{refused}");
    // Some space, but not enough.
    limit_files("3000");
    document.journal_mut().tend(later());
    assert!(document.journal().missing() > 0 && events_in(&path) as u64 > in_file);
    // The loss is reported.
    let unwritten = document.journal_mut().settle().expect_err("no room");
    assert!(unwritten.missing > 500 && unwritten.to_string().contains("in no file"), "{unwritten}");
    // A user frees some space.
    limit_files("unlimited");
    document.journal_mut().tend(later());
    assert_eq!((document.journal().missing(), document.journal().trouble()), (0, None));
    assert_eq!(events_in(&path) as u64, events);
    draw(&mut document, 1);
    document.close().expect("written");
    assert_eq!(events_in(&path) as u64, events + 1);
}

#[test]
fn of_sessions_left_open_the_newest_that_can_be_read_is_brought_back() {
    let desk = Desk::new();
    for count in [1, 2] {
        let mut document = Session::new(&desk.autosaves());
        draw(&mut document, count);
        drop(document);
    }
    let mut marked = desk.autosaves().marked();
    marked.sort_by_key(|path| events_in(path));
    let [older, newest] = &marked[..] else { panic!("two sessions: {marked:?}") };
    let text = fs::read_to_string(newest).expect("text");
    let damaged = text.replacen("Undo", "Nothing", 1);
    fs::write(newest, &damaged).expect("written");
    let ages = fs::File::options().write(true).open(newest).expect("the file");
    ages.set_modified(std::time::SystemTime::now() + Duration::from_secs(60)).expect("a time");
    let (document, opened) = Session::recover_or_new(&desk.autosaves(), Limits::DEFAULT);
    assert_eq!(document.path(), older);
    let said = opened.remarks.join("\n");
    let newest_name = newest.display().to_string();
    assert!(
        said.contains("line 2") && said.contains(&format!("osp sketch --lenient {newest_name}")),
        "{said}"
    );
    document.close().expect("unchanged");
    assert_eq!(desk.autosaves().marked(), std::slice::from_ref(newest), "it is not forgotten");
    assert_eq!(fs::read_to_string(newest).expect("text"), damaged);
    // The readable part is opened as a copy.
    let lenient = Opening { lenient: true, ..Opening::default() };
    let (document, opened) = Session::open_as(newest, &desk.autosaves(), lenient).expect("a copy");
    assert_eq!(document.event_count(), 1);
    assert!(opened.remarks.join("\n").contains("damaged parts skipped: 1"));
    document.close().expect("unchanged");
}

#[test]
fn windows_that_start_at_once_bring_back_different_sessions() {
    let desk = Desk::new();
    for round in 0..20 {
        let mut crashed = Session::new(&desk.autosaves());
        draw(&mut crashed, 2);
        let path = crashed.path().to_owned();
        drop(crashed);
        let start = std::sync::Barrier::new(2);
        let paths: Vec<PathBuf> = std::thread::scope(|scope| {
            let windows = [(); 2].map(|()| {
                scope.spawn(|| {
                    start.wait();
                    let (mut document, _) = Session::recover_or_new(&desk.autosaves(), Limits::DEFAULT);
                    draw(&mut document, 50);
                    let path = document.path().to_owned();
                    document.close().expect("written");
                    path
                })
            });
            windows.into_iter().map(|window| window.join().expect("no panic")).collect()
        });
        assert_ne!(paths[0], paths[1], "round {round}");
        assert!(paths.contains(&path), "round {round}");
        for drawn in paths {
            assert_eq!(events_in(&drawn), if drawn == path { 52 } else { 50 });
            fs::remove_file(drawn).expect("removed");
        }
    }
}
