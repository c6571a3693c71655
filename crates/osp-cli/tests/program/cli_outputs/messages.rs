//! Messages say each thing once, and nothing in a file or its name commands the terminal.

use std::fs;

use super::{built::has, session_text, write_session};
use crate::OSP;
use osp_testkit::{stderr, stdout, temp};

#[test]
fn no_part_of_a_message_is_told_twice() {
    let folder = temp();
    write_session(folder.path(), "a.ron");
    fs::write(folder.path().join("bad.ron"), "Header(format: 1)\nnonsense\n").expect("written");
    fs::write(folder.path().join("bad.pins"), "(pins: [1])").expect("written");
    let mut cases = vec![
        vec!["replay", "none.ron"],
        vec!["replay", "bad.ron"],
        vec!["replay", "a.ron", "--check", "none"],
        vec!["replay", "a.ron", "--check", "bad.pins"],
        vec!["verify", "a.ron", "--whole", "--pvs", "none"],
        vec!["verify", "a.ron", "--whole", "--pvs", "a.ron"],
        vec!["replay", "a.ron", "--csv", "/dev/full"],
        vec!["import", "bad.ron", "o.ron"],
        vec!["import", "a.ron", "none/o.ron"],
        vec!["verify", "scene:none"],
    ];
    if cfg!(feature = "window") {
        cases.push(vec!["sketch", "--autosave", "autosaves", "--rig", "none"]);
        cases.push(vec!["send", "a.ron", "--to", "nowhere"]);
    }
    if cfg!(feature = "live") {
        cases.push(vec!["join", "nowhere"]);
        cases.push(vec!["join", "nats://127.0.0.1:1/x", "--credentials", "none"]);
        cases.push(vec!["join", "nats://127.0.0.1:1/x", "--play", "bad.ron"]);
        cases.push(vec!["join", "nats://127.0.0.1:1/x", "none/o.ron"]);
    }
    for args in cases {
        let said = OSP.refused_in(folder.path(), &args);
        let parts: Vec<_> = said.trim_start_matches("error: ").trim().split(": ").collect();
        for (i, part) in parts.iter().enumerate() {
            assert!(!parts[..i].contains(part), "{args:?}: {said}");
        }
    }
}

/// Bytes that a terminal takes for a command; what is left of them in an answer.
fn assert_harmless(text: &str, about: &str) {
    let bad: Vec<_> =
        text.chars().filter(|c| (c.is_control() && *c != '\n') || "\u{202e}\u{2066}".contains(*c)).collect();
    assert!(bad.is_empty(), "{about}: {bad:?} in {text:?}");
}

#[cfg(unix)]
#[test]
fn names_and_titles_do_not_command_the_terminal() {
    let folder = temp();
    let evil = "e\u{1b}]0;owned\u{7}\u{9b}31m\r\u{202e}\n2";
    let title = r"t\u{1b}[31m\u{9b}2J\nfake: line";
    let session = session_text(0.0)
        .replace("name: \"small\"", &format!("name: \"{title}\""))
        .replace("\"test\"", &format!("\"{title}\""));
    let file = format!("{evil}.ron");
    fs::write(folder.path().join(&file), &session).expect("written");
    let damaged = format!("{evil} damaged.ron");
    fs::write(folder.path().join(&damaged), session + "Point(\u{1b}[31m\u{9b}\n").expect("written");
    let missing = format!("{evil} missing.ron");
    let svg = format!("{evil}.svg");
    let quick = "--views 1 --pixels 16x16 --repeats 1 --occlusion msvbsp".split(' ');
    let cases = [
        (vec!["info", &file], 0),
        (vec!["info", &file, "--json"], 0),
        (vec!["replay", &file], 0),
        (vec!["replay", &file, "--json"], 0),
        (vec!["replay", &file, "--chart", "c.svg", "--csv", "c.csv"], 0),
        (["verify", &file].into_iter().chain(quick).collect(), 0),
        (vec!["draw-index", &file, &svg], 0),
        (vec!["draw-insertion", &file, "o.gif"], 0),
        (vec!["draw-occlusion", &file, &svg, "--force"], 0),
        (vec!["race", &file], 0),
        (vec!["query", &file, "--at", "0.5,0.5"], 0),
        (vec!["import", &file, "o.ron"], 0),
        (vec!["bench", &file, "--quick", "--no-growth", "--index", "osp", "--pace", "samples:16"], 0),
        (vec!["replay", &damaged], 2),
        (vec!["info", &damaged, "--lenient"], 0),
        (vec!["replay", &missing], 2),
        (vec!["replay", &file, "--index", evil], 2),
        (vec![evil], 2),
        (vec!["replay", &file, "--check", &missing], 2),
        (vec!["import", &file, &svg], 2),
    ];
    for (args, code) in cases.into_iter().filter(|(args, _)| has(args)) {
        let output = OSP.run_in(folder.path(), &args);
        assert_eq!(output.status.code(), Some(code), "{args:?}: {}", stderr(&output));
        assert_harmless(&stdout(&output), &format!("{args:?}"));
        assert_harmless(&stderr(&output), &format!("{args:?}"));
        if args.contains(&"--json") {
            let value: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON still");
            assert!(value["recording"].as_str().is_some_and(|name| name.ends_with(&file)), "{value}");
        }
        // Line ends of a name or a title fake no lines of ours.
        let lines = [stdout(&output), stderr(&output)].concat();
        assert!(
            !lines.lines().any(|line| line.starts_with("fake") || line.starts_with("2.ron")),
            "{args:?}: {lines}"
        );
    }
    let chart = fs::read_to_string(folder.path().join("c.svg"));
    assert_eq!(chart.is_ok(), cfg!(feature = "bench"));
    assert!(!chart.unwrap_or_default().chars().any(|c| c.is_control() && c != '\n'), "no XML otherwise");
    // On a terminal the progress is there, too.
    let run = format!("{} replay \"$FILE\" --pace samples:1", OSP.0);
    let mut script = std::process::Command::new("script");
    script.args(["-qec", &run, "/dev/null"]).env("TERM", "xterm").env("FILE", folder.path().join(&file));
    match script.output() {
        Ok(output) => {
            let said = stdout(&output);
            assert!(
                said.contains("frames, ") && !said.contains("]0;owned\u{7}") && !said.contains('\u{202e}'),
                "{said:?}"
            );
        }
        Err(error) => eprintln!("skipped the terminal: script(1): {error}"),
    }
}
