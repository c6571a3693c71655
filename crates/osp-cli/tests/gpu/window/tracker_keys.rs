//! The word that a tracker has to know: on the command line, in a file, in a variable.

use crate::OSP;
use osp_app::tracker::{Listening, Tracker, TrackerAddress, TrackerKey, TrackerOptions};
use osp_testkit::{shipped_session, stderr, wait_until};

fn listen(options: &TrackerOptions) -> Tracker {
    let address = TrackerAddress::Udp("127.0.0.1:0".parse().expect("an address"));
    Tracker::open(&address, options, || {}).expect("a tracker")
}

fn key(word: &str) -> TrackerOptions {
    TrackerOptions { key: Some(word.parse::<TrackerKey>().expect("a key")), ..TrackerOptions::default() }
}

/// The list of processes shows what stands on the command line: the word may come from elsewhere.
#[test]
fn a_key_that_no_list_of_processes_shows() {
    let recording = shipped_session("scribble");
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("key.txt");
    let file = file.to_str().expect("plain text");
    std::fs::write(file, "open-sesame\n").expect("written");
    let tracker = listen(&TrackerOptions { listening: Listening::Everybody, ..key("open-sesame") });
    let to = tracker.local_address.expect("a port").to_string();
    let run = |args: &[&str], variable: Option<&str>| {
        let mut command = OSP.command(args);
        command.env_remove("OSP_TRACKER_KEY").envs(variable.map(|word| ("OSP_TRACKER_KEY", word)));
        let output = command.output().expect("osp");
        (output.status.code(), stderr(&output))
    };
    let send = ["send", &recording, "--to", &to, "--pace", "samples:500", "--speed", "1000"];
    // The file comes before the variable.
    for (more, variable) in [
        (&["--key-file", file][..], None),
        (&[][..], Some("open-sesame")),
        (&["--key-file", file][..], Some("open-sesamo")),
    ] {
        let (code, said) = run(&[&send[..], more].concat(), variable);
        assert_eq!(code, Some(0), "{said}");
        wait_until("messages", || {
            let has_come = tracker.take().is_some();
            while tracker.take().is_some() {}
            has_come
        });
    }
    assert_eq!(tracker.counts().refused, 0);
    // Both commands refuse a word that is no key, before they send or show anything.
    let (bad, long) = (folder.path().join("bad.txt"), folder.path().join("long.txt"));
    let [bad, long] = [&bad, &long].map(|path| path.to_str().expect("plain text"));
    std::fs::write(bad, "two secrets\n").expect("written");
    std::fs::write(long, "secret\n".repeat(1000)).expect("written");
    let sketch = ["sketch", "--tracker", "udp://127.0.0.1:0"];
    for (command, file_option) in [(&send[..], "--key-file"), (&sketch[..], "--tracker-key-file")] {
        for (more, variable, expected) in [
            (&[file_option, bad][..], None, format!("error: {bad}: expected 1 to 64 ")),
            (&[file_option, long][..], None, format!("error: {long}: expected at most 128 bytes")),
            (&[][..], Some("two secrets"), "error: OSP_TRACKER_KEY: expected 1 to 64 ".to_owned()),
            // A command that has failed leaves it empty: then nobody is let in.
            (&[][..], Some(""), "error: OSP_TRACKER_KEY: expected 1 to 64 ".to_owned()),
        ] {
            let (code, said) = run(&[command, more].concat(), variable);
            assert_eq!(code, Some(2), "{said}");
            assert!(said.contains(&expected) && !said.contains("secret"), "{expected}: {said}");
        }
    }
}
