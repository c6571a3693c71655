//! The time that the paper's tree saves, and the share of this time that a loop over all boxes also saves.

use super::growing::WHOLE;
use crate::{
    report::{one_line, short},
    rows::{Rows, distinct},
};

const TREE: &str = "osp-paper";
const OCTREE: &str = "octree-paper";
/// A loop over all boxes.
const LOOP: &str = "brute-force";
/// Structures without the paper's planes.
const OTHERS: [&str; 4] = [LOOP, "brute-simd", "time-order", "osp"];

/// A sentence for each session on which the paper's two trees grew.
pub(in crate::bench) fn verdict(rows: &Rows) -> Vec<String> {
    let of_growing = rows.rows.iter().filter(|row| row.part == WHOLE);
    let recordings = distinct(of_growing.map(|row| row.recording.as_str()));
    recordings.into_iter().filter_map(|recording| sentence(rows, recording)).collect()
}

fn sentence(rows: &Rows, recording: &str) -> Option<String> {
    let us = |index: &str| {
        let figure = |figure| rows.value(WHOLE, recording, index, figure);
        // A frame that was not drawn consists only of insertion and culling.
        figure("insert_and_cull").or_else(|| figure("time")).filter(|us| *us > 0.0)
    };
    let (tree, octree) = (us(TREE)?, us(OCTREE)?);
    let mut said = format!(
        "{}, insertion and culling: {OCTREE}, which is rebuilt in every frame, takes {} times as long as {TREE}",
        one_line(recording),
        short(octree / tree)
    );
    let others = OTHERS.into_iter().filter_map(|index| Some((index, us(index)? / tree)));
    for (at, (index, ratio)) in others.enumerate() {
        said += if at == 0 { "; without rebuilding and without its planes " } else { ", " };
        said += &format!("{index} {}{} times", if at == 0 { "takes " } else { "" }, short(ratio));
    }
    said += ".";
    if let Some(of_loop) = us(LOOP).filter(|_| tree < octree) {
        let percent = 100.0 * (octree - of_loop) / (octree - tree);
        said += &format!(" {LOOP}, a loop over all boxes, saves {percent:.0} % of what {TREE} saves");
        said += if percent > 50.0 { ": most of it is saved by not rebuilding." } else { "." };
    }
    Some(said)
}
