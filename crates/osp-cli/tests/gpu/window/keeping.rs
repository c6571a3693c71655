//! What becomes of sessions when files are lost and disks are full.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use osp_session::recording::{self, OpenOptions};

use super::desk::{Desk, OspWindow};
use osp_testkit::shipped_session;

/// Through the middle of the model's part of a window of 1280 by 800.
fn line(height: i32) -> Vec<(i32, i32)> {
    (0..=24).map(|i| (440 + 12 * i, height)).collect()
}

fn events_in(path: &Path) -> u64 {
    let events = recording::open(path, &OpenOptions::default()).expect("a recording");
    events.inspect(|event| assert!(event.is_ok(), "whole lines: {event:?}")).count() as u64
}

fn sessions_in(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = fs::read_dir(folder) else { return Vec::new() };
    let paths = entries.map(|entry| entry.expect("an entry").path());
    paths.filter(|path| path.extension().is_some_and(|ending| ending == "ron")).collect()
}

fn draw(window: &mut OspWindow<'_>, height: i32) {
    let strokes = window.number("strokes");
    window.drag(1, &line(height));
    window.until_last("a stroke", |frame| frame["strokes"].as_u64() > Some(strokes) && frame["samples"] == 0);
    window.settle();
}

/// The keyboard goes one widget on in a frame.
fn slowly(window: &mut OspWindow<'_>, keys: &[&str]) {
    for key in keys {
        window.settle();
        window.key(key);
    }
}

fn press(window: &mut OspWindow<'_>, keys: &[&str]) {
    slowly(window, keys);
    window.until_last("no question", |frame| frame["question"].is_null());
}

/// From the last answer, which has the keyboard, to the second.
fn answer_go_on(window: &mut OspWindow<'_>) {
    slowly(window, &["Tab", "Tab", "Return"]);
}

#[test]
fn a_file_that_is_lost_while_a_tracker_draws_is_missed_at_once() {
    let Some(desk) = Desk::new() else { return };
    let recording = shipped_session("scribble");
    for accident in ["removed", "replaced"] {
        let file = desk.folder().join(format!("{accident}.ron"));
        let address = super::tracking::free_address();
        let from = format!("udp://{address}");
        let path = file.to_str().expect("a path");
        let mut window = desk.open(&["sketch", path, "--tracker", &from, "--window", "1280x800"]);
        let send = ["send", &recording, "--to", &address, "--pace", "samples:8", "--speed", "4"];
        std::thread::scope(|scope| {
            let sender = scope.spawn(|| desk.osp(&send));
            window.until_last("something drawn", |frame| frame["events"].as_u64() > Some(300));
            match accident {
                "removed" => fs::remove_file(&file).expect("removed"),
                _ => {
                    let other = desk.folder().join("other");
                    fs::write(&other, "somebody's work").expect("written");
                    fs::rename(&other, &file).expect("renamed");
                }
            }
            window.until("it is said", |frames| frames.iter().any(|frame| !frame["trouble"].is_null()));
            assert!(sender.join().expect("no panic").status.success());
        });
        window.settle();
        window.keep_picture(&format!("{accident}.png"));
        let events = window.number("events");
        assert!(events > 10_000, "{events}");
        if accident == "replaced" {
            assert_eq!(fs::read(&file).expect("a file"), b"somebody's work");
        }
        window.ask_to_close();
        window.until_last("a question", |frame| frame["question"] == "Not everything is written");
        window.settle();
        window.keep_picture("unwritten.png");
        press(&mut window, &["Return"]);
        assert_eq!(window.number("events"), events, "it is still there");
        window.ask_to_close();
        window.until_last("a question", |frame| frame["question"] == "Not everything is written");
        let stderr = window.stderr_file();
        answer_go_on(&mut window);
        assert_eq!(window.wait().code(), Some(2));
        let said = fs::read_to_string(stderr).expect("text");
        let shelters = sessions_in(&desk.folder().join("data/osp/sketches"));
        let [shelter] = &shelters[..] else { panic!("one shelter: {shelters:?}") };
        assert!(said.contains(shelter.to_str().expect("a path")), "{said}");
        assert_eq!(events_in(shelter), events, "not one is lost");
        // And the next window brings it back.
        let mut next = desk.open(&["sketch", "--window", "900x600"]);
        assert_eq!(next.number("events"), events);
        assert!(next.close().success());
        fs::remove_file(shelter).expect("removed");
    }
}

/// Forbids a process files of more bytes.
fn limit_files(process: u32, bytes: &str) -> bool {
    let arguments = ["--pid", &process.to_string(), &format!("--fsize={bytes}:")];
    Command::new("prlimit").args(arguments).status().is_ok_and(|status| status.success())
}

#[test]
fn on_a_full_disk_drawing_goes_on_and_nothing_is_lost() {
    let Some(desk) = Desk::new() else { return };
    // So long that the window's other files stay far below the limit, which is a little above.
    let mut text = "Header(format:1,name:\"long\",source:\"osp sketch 0.1.0\")\n".to_owned();
    text += &"Undo(t:0.5)\n".repeat(200_000);
    for end in ["with room", "by the user", "by a signal"] {
        let file = desk.folder().join(format!("full {end}.ron"));
        fs::write(&file, &text).expect("written");
        let mut window = desk.open(&["sketch", file.to_str().expect("a path"), "--window", "1280x800"]);
        if !limit_files(window.process_id(), &(text.len() + 1500).to_string()) {
            eprintln!("skipped: there is no `prlimit` here to make a disk small");
            return;
        }
        for height in [300, 400, 500] {
            draw(&mut window, height);
        }
        window.until_last("it is said", |frame| !frame["trouble"].is_null());
        window.keep_picture("full.png");
        let (events, written) = (window.number("events"), events_in(&file));
        assert!(events > written + 20 && written > 200_000, "{written} of {events}");
        if end == "with room" {
            limit_files(window.process_id(), "unlimited");
            // Within seconds it is tried again, without a hand.
            window.point(600, 600);
            window.until_last("everything written", |frame| frame["trouble"].is_null());
            assert!(window.close().success());
            assert_eq!(events_in(&file), events);
        } else {
            let stderr = window.stderr_file();
            if end == "by the user" {
                window.ask_to_close();
                window.until_last("a question", |frame| frame["question"] == "Not everything is written");
                answer_go_on(&mut window);
            } else {
                let process = window.process_id().to_string();
                Command::new("kill").args(["-TERM", &process]).status().expect("a signal");
            }
            assert_eq!(window.wait().code(), Some(2), "ended {end}");
            let said = fs::read_to_string(stderr).expect("text");
            assert!(said.contains(&format!("{} changes are in no file", events - written)), "{said}");
        }
    }
}
