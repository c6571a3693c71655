//! The arguments of `osp bench` and `osp race`.

use std::path::PathBuf;

use anyhow::ensure;
use clap::{
    Args,
    builder::{PossibleValuesParser, TypedValueParser},
};

use super::{
    bench_paper_args::PaperArgs,
    built::{Feature, Lacking},
    outputs::ForceArgs,
    parsers::{camera_parser, index_parser},
    reading::ReadArgs,
    structure_args::RebuildArgs,
};
use osp_lab::Contender;
use osp_rivals::IndexKind;
use osp_session::{recording::Pace, replay::CameraChoice};

/// Compare all structures on sessions and on a growing model.
///
/// All indexes take turns in one process: each frame goes through every index before the next frame begins. The report
/// gives the 95 % confidence interval of each median, and counts of work beside each time.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  osp bench recordings/*.ron --quick
  osp bench sketch.tilt --html sketch.html --csv sketch.csv
  osp bench --sizes 1000,100000,10000000 --index osp,octree-rebuild,lbvh
  osp bench recordings/room.ron --no-growth --json
  osp bench --sizes 10000,1000000 --no-rays --index osp,bvh-sah,dynamic-bvh
  osp bench recordings/room.ron --paper --draw --html paper.html
  osp bench sketch.tilt --paper --depth 15 --cube 0.5,1,2 --score paper \\
      --node-test sphere

Parts of the report:
  sessions  each file through every index, with one sample of the hand per
            frame
  growth    a synthetic session at each of the sizes: frames that insert a few
            polygons, and frames that insert none
  flight    the finished sessions: frustum culling, also with occlusion culling
  rays      the finished sessions, and the synthetic session at each of the
            sizes up to a million: nearest hit, any hit, polygons in a box,
            polygons nearest to a point; in order and best first; while polygons
            are inserted; refit against rebuild as polygons move
  moving    the synthetic session at each of the sizes up to a million. In a
            measurement, 1, 10 or 100 % of the polygons move in every frame: in
            pieces, as a group that is placed as a whole, or scattered with
            shuffled numbers. In another one, 100 instances of one mesh move.
            Each structure updates their boxes; `group-index` stores one box for
            each group. The report counts index entries that are changed or
            inserted, and node boxes that are computed. If a result is wrong,
            the command fails
  paper     with --paper: the paper's experiments. They compare the paper's tree
            and octree with loops over all boxes and with other structures
            (--index), while the model grows (figures 19, 21 to 23). The report
            counts the plane tests of insertion. All polygons of nodes that the
            frustum cuts are drawn. A flight runs every culler (figure 20),
            including the paper's cullers, which cull visible polygons (`not
            conservative`). Another experiment finds the best depth and cube
            size of the paper's tree. --node-test and --score apply to the
            conservative cullers
The page (--html) is one file that works offline, with the verdict, a first chart, and links to all parts. A click \
on a column header sorts its table (best first at the start). Charts show the values under the pointer; a click on a \
name shows or hides its line. The page follows the system's dark mode. Without scripts there are only tables.
Every value is a row: part, recording, index, figure, unit, value, and the confidence interval of a median. --csv \
writes these rows, --json prints them. The tables of --all and the page contain the same rows.
`osp replay --help` describes the indexes.")]
pub(super) struct BenchArgs {
    /// The sessions, of any format that replay reads.
    pub(super) files: Vec<PathBuf>,
    /// Measure for a shorter time: under a minute for the recordings of osp.
    #[arg(long)]
    pub(super) quick: bool,
    /// The indexes, separated by commas [default: all but octree-rebuild at other times; with --paper the paper's trees, octree-rebuild, time-order,
    /// brute-simd, brute-force and osp].
    #[arg(long, value_delimiter = ',', value_parser = contender_parser())]
    pub(super) index: Vec<Contender>,
    /// The index that the others are compared with.
    #[arg(long, default_value = "osp", value_parser = index_parser())]
    pub(super) reference: IndexKind,
    /// Sizes of the growing model, polygons [default: 1000,10000,100000,1000000; with --quick up to 10000].
    #[arg(long, value_delimiter = ',', value_parser = clap::value_parser!(u32).range(1..=50_000_000))]
    pub(super) sizes: Vec<u32>,
    /// Leave out the growing model.
    #[arg(long, conflicts_with = "sizes")]
    pub(super) no_growth: bool,
    /// Leave out rays, ranges and neighbours.
    #[arg(long)]
    pub(super) no_rays: bool,
    /// Leave out moving polygons.
    #[arg(long)]
    pub(super) no_moving: bool,
    /// Length of a frame: `recorded` (by the session's time stamps) or `samples:N` (N samples of the hand).
    #[arg(long, default_value = "samples:1")]
    pub(super) pace: Pace,
    /// Position of the eye in the sessions: `auto` is the recorded head path, else the session's own camera, else `orbit`.
    /// `orbit` circles around the model, `follow` is behind the hand, `inside` turns in the middle of the model.
    #[arg(long, default_value = "auto", value_parser = camera_parser())]
    pub(super) camera: CameraChoice,
    /// Write every figure to a CSV file, one per line.
    #[arg(long, value_name = "FILE")]
    pub(super) csv: Option<PathBuf>,
    /// Print every table, instead of the summary and one table for each part.
    #[arg(long, conflicts_with = "json")]
    pub(super) all: bool,
    /// Print one JSON object instead of the tables.
    #[arg(long)]
    pub(super) json: bool,
    /// Write one HTML page with tables and charts. The terminal then shows only the summary, unless --all is given.
    #[arg(long, value_name = "FILE")]
    pub(super) html: Option<PathBuf>,
    #[command(flatten)]
    pub(super) force: ForceArgs,
    #[command(flatten)]
    pub(super) paper: PaperArgs,
    #[command(flatten)]
    pub(super) reading: ReadArgs,
}

impl BenchArgs {
    /// Returns the seconds to spend on each index for a session.
    pub(super) fn session_secs(&self) -> f64 {
        if self.quick { 0.06 } else { 5.0 }
    }

    /// Returns the numbers of polygons of the growing model.
    pub(super) fn sizes(&self) -> Vec<u32> {
        match (&self.sizes[..], self.quick) {
            ([], true) => vec![1000, 10_000],
            ([], false) => vec![1000, 10_000, 100_000, 1_000_000],
            (sizes, _) => sizes.to_vec(),
        }
    }

    /// Returns the seconds to spend on each index for one size.
    pub(super) fn growth_secs(&self) -> f64 {
        if self.quick { 0.08 } else { 3.0 }
    }
}

fn contender_parser() -> impl TypedValueParser<Value = Contender> {
    let own = IndexKind::ALL.iter().map(|kind| kind.name());
    PossibleValuesParser::new(own.chain(Contender::PEERS)).try_map(|name| {
        let lacking = || Lacking(&[Feature::Peers]).to_string();
        Contender::from_name(&name).ok_or_else(lacking)
    })
}

/// Race structures on one session, frame by frame.
///
/// Each structure gets the same polygons and the same view in every frame. One thread runs all of them in turns; the
/// structure that begins changes from frame to frame. A frame consists of insertion, commit and culling; nothing is
/// drawn. All structures must find the same polygons in view in every frame.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  osp race recordings/portrait.ron
  osp race --synth 20000 --rebuild frame,insert,thread
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
    #[command(flatten)]
    pub(super) rebuild: RebuildArgs,
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
    /// Returns the structures, in the order of their rows.
    pub(super) fn kinds(&self) -> Vec<Contender> {
        self.rebuild.expand(&self.index, Contender::Own)
    }

    /// Returns an error unless the race has two to four different structures.
    pub(super) fn check(&self) -> anyhow::Result<()> {
        self.rebuild.check(self.index.contains(&Contender::Own(IndexKind::OctreeRebuild)))?;
        let kinds = self.kinds();
        let found = kinds.len();
        ensure!((2..=4).contains(&found), "--index: expected two to four structures; found {found}");
        for (at, kind) in kinds.iter().enumerate() {
            let name = kind.name();
            ensure!(!kinds[..at].contains(kind), "--index: expected each structure once; found {name} twice");
        }
        Ok(())
    }
}
