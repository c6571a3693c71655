//! The arguments of `osp race`.

use std::path::PathBuf;

use anyhow::ensure;
use clap::Args;

use super::{bench_args::contender_parser, outputs::ForceArgs, parsers::camera_parser, reading::ReadArgs};
use osp_lab::Contender;
use osp_session::{recording::Pace, replay::CameraChoice};

/// Race structures on one session, frame by frame.
///
/// Each structure gets the same polygons and the same view in every frame. One thread runs all of them in turns; the
/// structure that begins changes from frame to frame. A frame consists of insertion, commit and culling; nothing is
/// drawn. All structures must find the same polygons in view in every frame.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  osp race recordings/portrait.ron
  osp race --synth 200000
  osp race sketch.tilt --index osp,bvh-sah,dynamic-bvh --csv race.csv
  osp race --synth 400000 --pace samples:64 --film race.gif

On a terminal osp shows for each structure the time of the latest frame, a strip chart of the previous frames, the \
longest frame, and the number of frames over 11.1 ms. The full height of the chart is 11.1 ms, a frame at 90 Hz; \
longer frames are red. At the end osp prints the verdict in one sentence, and a table.
The exit code is 1 if two structures found different polygons.
`osp replay --help` describes the indexes.")]
pub(super) struct RaceArgs {
    /// The session, of any format that replay reads.
    #[arg(required_unless_present = "synth", conflicts_with = "synth")]
    pub(super) file: Option<PathBuf>,
    /// Race on a synthetic session of loose strokes with this many polygons instead.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    pub(super) synth: Option<u32>,
    /// Two to four structures, separated by commas.
    #[arg(long, value_delimiter = ',', default_value = "osp,octree-rebuild", value_parser = contender_parser())]
    pub(super) index: Vec<Contender>,
    /// Part of the session that each frame plays. `recorded`: up to the time of the frame, by the recorded time stamps.
    /// `samples:N`: the next N hand samples.
    #[arg(long, default_value = "samples:16")]
    pub(super) pace: Pace,
    /// Position of the eye: `auto` is the recorded head path, else the session's own camera, else `orbit`. `orbit` circles
    /// around the model, `follow` is behind the hand, `inside` turns in the middle of the model.
    #[arg(long, default_value = "auto", value_parser = camera_parser())]
    pub(super) camera: CameraChoice,
    /// Number of races. The shortest time of each frame counts. This excludes most of the time that other programs take
    /// from the core.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=100))]
    pub(super) runs: u32,
    /// Write every figure to a CSV file, one per line.
    #[arg(long, value_name = "FILE")]
    pub(super) csv: Option<PathBuf>,
    /// Write a film of the race to a GIF file. For each structure it shows the growing model, the time of a frame, and
    /// a strip chart. Frames that missed 90 Hz stay red in the chart.
    #[arg(long, value_name = "OUT.gif")]
    pub(super) film: Option<PathBuf>,
    /// Print one JSON object instead of the summary and the table.
    #[arg(long)]
    pub(super) json: bool,
    #[command(flatten)]
    pub(super) force: ForceArgs,
    #[command(flatten)]
    pub(super) reading: ReadArgs,
}

impl RaceArgs {
    /// Returns an error unless the race has two to four different structures.
    pub(super) fn check(&self) -> anyhow::Result<()> {
        let found = self.index.len();
        ensure!((2..=4).contains(&found), "--index: expected two to four structures; found {found}");
        for (at, kind) in self.index.iter().enumerate() {
            let name = kind.name();
            ensure!(
                !self.index[..at].contains(kind),
                "--index: expected each structure once; found {name} twice"
            );
        }
        Ok(())
    }
}
