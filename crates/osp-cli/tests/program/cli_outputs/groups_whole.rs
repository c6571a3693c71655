//! Groups that are inserted whole: the same polygons in view, and far fewer of them inserted again.

use super::*;
use crate::OSP;
use osp_testkit::temp;

/// The columns of a replay of the session with moving groups: polygons inserted again, and the fingerprint, of each frame.
fn replay(folder: &Path, more: &[&str]) -> (u64, Vec<String>) {
    let session = osp_testkit::at("recordings/nested.ron");
    let session = session.to_str().expect("utf-8");
    let args = [&["replay", session, "--csv", "frames.csv", "--force", "--budget", "1e9"], more].concat();
    OSP.done_in(folder, &args);
    let text = fs::read_to_string(folder.join("frames.csv")).expect("the lines");
    let mut lines = text.lines().map(|line| line.split(',').map(str::to_owned).collect::<Vec<_>>());
    let names = lines.next().expect("names");
    let at = |name: &str| names.iter().position(|other| other == name).expect("a column");
    let (updated, fingerprint) = (at("updated"), at("fingerprint"));
    let mut sum = 0;
    let prints = lines.map(|line| {
        sum += line[updated].parse::<u64>().expect("a number");
        line[fingerprint].clone()
    });
    let prints = prints.collect();
    (sum, prints)
}

#[test]
fn the_same_is_seen_and_little_is_inserted_again() {
    let folder = temp();
    for more in [&["--index", "osp,brute-force"][..], &["--rig", "dual-wall"]] {
        let (anew, prints) = replay(folder.path(), &[more, &["--groups", "polygons"]].concat());
        let (anew_whole, prints_whole) = replay(folder.path(), &[more, &["--groups", "whole"]].concat());
        assert_eq!(prints, prints_whole, "{more:?}");
        assert!(prints.len() > 300 && anew_whole * 4 < anew, "{more:?}: {anew_whole} of {anew}");
    }
}
