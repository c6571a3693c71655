//! Messages say each thing once, and nothing in a file or its name commands the terminal.

use std::{error::Error, fs, io, path::PathBuf};

use super::{built::has, session_text, write_session};
use crate::OSP;
use osp_lab::{
    pvs::PvsError,
    report::{PinError, Pins},
};
use osp_session::{
    recording::RecordingError,
    rig::{Rig, RigError},
};
use osp_testkit::{stderr, stdout, temp};

/// Texts of an error and of its causes.
fn chain(error: &(dyn Error + 'static)) -> Vec<String> {
    std::iter::successors(Some(error), |&error| error.source()).map(ToString::to_string).collect()
}

fn assert_says_each_thing_once(error: &(dyn Error + 'static)) {
    let texts = chain(error);
    for (i, text) in texts.iter().enumerate() {
        for cause in &texts[i + 1..] {
            assert!(!text.contains(cause.as_str()), "told twice: {texts:?}");
        }
    }
}

fn system() -> io::Error {
    io::Error::from_raw_os_error(2)
}

type NamedError = (&'static str, Box<dyn Error + Send + Sync>);

/// One of each type of error, by name; those of types without a cause are not here.
fn errors() -> Vec<NamedError> {
    let path = PathBuf::from("some/file");
    let folder = temp();
    let bad = folder.path().join("bad.pins");
    fs::write(&bad, "(pins: [1])").expect("written");
    let errors: Vec<NamedError> = vec![
        ("RecordingError", Box::new(RecordingError::io(&path, system()))),
        ("PinError", Box::new(PinError::Io { path: path.clone(), cause: system() })),
        ("PinError", Box::new(Pins::read(&bad).expect_err("no pins"))),
        ("PvsError", Box::new(PvsError::Io { path, cause: system() })),
        ("RigError", Box::new(RigError::Io { path: "some/file".to_owned(), cause: system() })),
        ("RigError", Box::new(Rig::open("no such rig").expect_err("no rig"))),
        (
            "OutputError",
            Box::new(osp_session::output_file::OutputError::Io { path: "some/file".into(), cause: system() }),
        ),
        ("ExportError", Box::new(osp_session::export::ExportError::Io(system()))),
    ];
    errors.into_iter().chain(bench_errors()).chain(live_errors()).chain(window_errors()).collect()
}

#[cfg(not(feature = "bench"))]
fn bench_errors() -> Vec<NamedError> {
    Vec::new()
}

#[cfg(feature = "bench")]
fn bench_errors() -> Vec<NamedError> {
    use osp_lab::{
        bench::{FilmError, PaperError, RaceError},
        report::ChartError,
    };
    vec![
        ("ChartError", Box::new(ChartError::Draw { path: "some/file".into(), message: "why".to_owned() })),
        ("PaperError", Box::new(PaperError::Recording(RecordingError::io("some/file".as_ref(), system())))),
        ("PaperError", Box::new(PaperError::Drawing(Box::new(system())))),
        ("FilmError", Box::new(FilmError::Recording(RecordingError::io("some/file".as_ref(), system())))),
        ("FilmError", Box::new(FilmError::Io(system()))),
        ("RaceError", Box::new(RaceError::Recording(RecordingError::io("some/file".as_ref(), system())))),
    ]
}

#[cfg(not(feature = "live"))]
fn live_errors() -> Vec<NamedError> {
    Vec::new()
}

#[cfg(feature = "live")]
fn live_errors() -> Vec<NamedError> {
    use osp_net::live::{AddressError, Credentials, LiveError};
    vec![
        ("AddressError", Box::new(AddressError::File { path: "some/file".into(), cause: system() })),
        ("AddressError", Box::new(Credentials::read("no such file".as_ref()).expect_err("no file"))),
        ("LiveError", Box::new(LiveError::System(system()))),
    ]
}

#[cfg(not(feature = "window"))]
fn window_errors() -> Vec<NamedError> {
    Vec::new()
}

#[cfg(feature = "window")]
fn window_errors() -> Vec<NamedError> {
    use osp_app::{
        OpenError, SaveError, Trouble, WindowError,
        tracker::{Tracker, TrackerAddress, TrackerOptions},
    };
    use osp_render::RenderError;
    let tracker = || {
        let address = TrackerAddress::File("no such file".into());
        Tracker::open(&address, &TrackerOptions::default(), || {}).expect_err("no file")
    };
    vec![
        ("TrackerError", Box::new(tracker())),
        ("WindowError", Box::new(WindowError::Tracker(tracker()))),
        ("OpenError", Box::new(OpenError::Recording(RecordingError::io("some/file".as_ref(), system())))),
        (
            "SaveError",
            Box::new(SaveError::Failed {
                path: "some/file".into(),
                cause: Trouble::CannotWrite(system().to_string()),
            }),
        ),
        ("WindowError", Box::new(WindowError::Render(RenderError::NoAdapter))),
        ("WindowError", Box::new(WindowError::Trace { path: "some/file".into(), cause: system() })),
    ]
}

#[test]
fn a_cause_is_told_once() {
    for (_, error) in errors() {
        assert_says_each_thing_once(error.as_ref());
        // As the program prints it.
        let printed = format!("{:#}", anyhow::Error::from_boxed(error));
        let system = system().to_string();
        assert!(printed.matches(&system).count() <= 1, "{printed}");
    }
}

/// So that a new type of error with a cause is looked at, too.
#[test]
fn every_type_of_error_with_a_cause_is_looked_at() {
    let known: Vec<_> = errors().into_iter().map(|(name, _)| name).collect();
    let packages = osp_testkit::packages().into_iter();
    let mut folders: Vec<PathBuf> = packages.map(|package| package.join("src")).collect();
    let mut found = 0;
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).expect("sources") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let text = fs::read_to_string(&path).expect("a source");
            // From each derived error to the end of its declaration.
            for piece in text
                .split("#[derive(")
                .skip(1)
                .filter(|piece| piece.split(')').next().is_some_and(|d| d.contains("Error")))
            {
                let end = piece.find("\n}").or_else(|| piece.find(';')).unwrap_or(piece.len());
                let piece = &piece[..end];
                let has_cause = ["source:", "#[source]", "#[from]", "cause:", "transparent"]
                    .iter()
                    .any(|mark| piece.contains(mark));
                let name =
                    piece.split_whitespace().skip_while(|word| !["enum", "struct"].contains(word)).nth(1);
                let name = name.expect("a name").trim_end_matches(|c: char| !c.is_alphanumeric());
                found += 1;
                let is_in = |folder: &str| path.components().any(|part| part.as_os_str() == folder);
                let is_built = (cfg!(feature = "window") || !is_in("osp-app"))
                    && (cfg!(feature = "bench") || !(is_in("bench") || is_in("chart.rs")))
                    && (cfg!(feature = "live") || !is_in("live"));
                // Private ones are told to nobody but the program.
                let is_public = piece.contains("\npub enum") || piece.contains("\npub struct");
                assert!(
                    !has_cause || !is_built || !is_public || known.contains(&name),
                    "{name} in {}",
                    path.display()
                );
                assert!(!piece.contains(" source:"), "{name}: `cause` in the text, or `source` without it");
            }
        }
    }
    assert!(found >= 12, "{found} types of errors found");
}

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
        cases.push(vec!["join", "nats://127.0.0.1:1/x", "--tls-ca", "none"]);
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
    let cases = [
        (vec!["info", &file], 0),
        (vec!["info", &file, "--json"], 0),
        (vec!["replay", &file], 0),
        (vec!["replay", &file, "--json"], 0),
        (vec!["replay", &file, "--chart", "c.svg", "--csv", "c.csv"], 0),
        (
            vec![
                "verify",
                &file,
                "--views",
                "1",
                "--pixels",
                "16x16",
                "--repeats",
                "1",
                "--occlusion",
                "msvbsp",
            ],
            0,
        ),
        (vec!["draw-index", &file, &svg], 0),
        (vec!["draw-insertion", &file, "o.gif"], 0),
        (vec!["draw-occlusion", &file, &svg, "--force"], 0),
        (vec!["race", &file], 0),
        (vec!["pick", &file], 0),
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
