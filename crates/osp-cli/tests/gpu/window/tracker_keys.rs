//! The word that a tracker has to know stands in a variable, which no list of processes shows.

use crate::OSP;
use osp_app::tracker::{Tracker, TrackerAddress, TrackerOptions};
use osp_testkit::{shipped_session, stderr, wait_until};

#[test]
fn a_tracker_has_to_know_the_key() {
    let recording = shipped_session("scribble");
    let options = TrackerOptions { key: Some("open-sesame".parse().expect("a key")) };
    let address = TrackerAddress::Udp("127.0.0.1:0".parse().expect("an address"));
    let tracker = Tracker::open(&address, &options, || {}).expect("a tracker");
    let to = tracker.local_address.expect("a port").to_string();
    let run = |args: &[&str], key: &str| {
        let output = OSP.command(args).env("OSP_TRACKER_KEY", key).output().expect("osp");
        (output.status.code(), stderr(&output))
    };
    let send = ["send", &recording, "--to", &to, "--pace", "samples:500", "--speed", "1000"];
    assert_eq!(run(&send, "open-sesamo").0, Some(0));
    wait_until("refusals", || tracker.counts().refused > 0);
    assert!(tracker.take().is_none());
    assert_eq!(run(&send, "open-sesame").0, Some(0));
    wait_until("messages", || tracker.take().is_some());
    // Both commands refuse a word that is no key, before they send or show anything. A command that has failed leaves
    // the variable empty: then nobody is let in.
    for command in [&send[..], &["sketch", "--tracker", "udp://127.0.0.1:0"]] {
        for key in ["two secrets", "", &"secret".repeat(1000)] {
            let (code, said) = run(command, key);
            assert_eq!(code, Some(2), "{said}");
            let expected = "error: OSP_TRACKER_KEY: expected 1 to 64 ";
            assert!(said.contains(expected) && !said.contains("secret"), "{said}");
        }
    }
}
