//! Groups that are inserted whole: the same polygons in view, and far fewer of them inserted again.

use super::*;
use crate::{OSP, csv::Lines};
use osp_testkit::temp;

/// The columns of a replay of the session with moving groups: polygons inserted again, and the fingerprint, of each frame.
fn replay(folder: &Path, more: &[&str]) -> (u64, Vec<String>) {
    let session = osp_testkit::at("recordings/nested.ron");
    let session = session.to_str().expect("utf-8");
    let args = [&["replay", session, "--csv", "frames.csv", "--force"], more].concat();
    OSP.done_in(folder, &args);
    let lines = Lines::read(folder.join("frames.csv"));
    let prints = lines.column("fingerprint").iter().map(|print| (*print).to_owned()).collect();
    (lines.numbers("updated").iter().sum(), prints)
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
