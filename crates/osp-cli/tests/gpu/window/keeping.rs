//! What becomes of sessions when disks are full.

use std::{fs, path::Path, process::Command};

use osp_session::recording::{self, OpenOptions};

use super::desk::{Desk, OspWindow};

/// Through the middle of the model's part of a window of 1280 by 800.
fn line(height: i32) -> Vec<(i32, i32)> {
    (0..=24).map(|i| (440 + 12 * i, height)).collect()
}

fn events_in(path: &Path) -> u64 {
    let events = recording::open(path, &OpenOptions::default()).expect("a recording");
    events.inspect(|event| assert!(event.is_ok(), "whole lines: {event:?}")).count() as u64
}

fn draw(window: &mut OspWindow<'_>, height: i32) {
    let strokes = window.number("strokes");
    window.drag(1, &line(height));
    window.until_last("a stroke", |frame| frame["strokes"].as_u64() > Some(strokes) && frame["samples"] == 0);
    window.settle();
}

/// From the last answer, which has the keyboard, to the second. The keyboard goes one widget on in a frame.
fn answer_go_on(window: &mut OspWindow<'_>) {
    for key in ["Tab", "Tab", "Return"] {
        window.settle();
        window.key(key);
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
