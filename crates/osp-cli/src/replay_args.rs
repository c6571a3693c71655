//! The arguments of `osp replay`.

use std::path::PathBuf;

use anyhow::bail;
use clap::{Args, ValueEnum};

use super::{
    built::{Feature, Lacking},
    numbers,
    outputs::ForceArgs,
    parsers::{Size, camera_parser, index_parser, occlusion_parser},
    reading::ReadArgs,
    rig_args::RigPathArgs,
    structure_args::{CutNodesArgs, IndexSettingsArgs, RebuildArgs, TestArgs},
};
use osp_lab::Method;
use osp_rivals::{CutNodes, IndexKind, IndexSettings};
use osp_session::{recording::Pace, replay::CameraChoice};

/// Default of --polygon-ns.
const POLYGON_NS: f64 = 10.0;

/// Play sessions through several indexes and print the cost of the frames.
///
/// Each frame takes the next samples of the session and turns them into polygons. Each index then inserts these
/// polygons and culls by the camera's frustum. Within a frame the indexes run one after the other, on the same polygons
/// and the same view. If two indexes find different polygons in a frame, the exit code is 1.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  osp replay recordings/portrait.ron
  osp replay sketch.tilt --index osp,octree-rebuild --rebuild frame,insert
  osp replay sketch.tilt --index osp,octree-rebuild --chart frames.png
  osp replay painting.apa --pace samples:1 --camera inside --csv frames.csv
  osp replay recordings/room.ron --index osp-paper,lbvh --depth 9 --cube 2 \\
      --leaf 16 --morton-bits 10
  osp replay recordings/*.ron --check recordings/fingerprints.pins
  osp replay recordings/room.ron --occlusion none,msvbsp,auto --verify-frames 8
  osp replay room.ron --occlusion msvbsp --node-test sphere --score paper
  osp replay recordings/room.ron --rig dual-wall --occlusion none,msvbsp

The table has a line for each index (times of this machine, one thread):
  insert           time to insert the frame's polygons, including a rebuild:
                   nanoseconds per polygon, median
  cull             time of one frustum query, median
  frame            insert and cull together: median, 95th and 99th percentile,
                   slowest frame
  visible          polygons in the frustum, mean over the frames
  culled           polygons outside the frustum, mean over the frames
  frames measured  number of measured frames; a slow index is measured on evenly
                   spaced ranges of the session (--budget)
  ratio            an index's time of a frame, divided by that of the fastest
                   index, over the frames measured with both
  input            time to apply the frame's events to the model, median; not a
                   part of `frame`
Columns that do not fit the terminal (or COLUMNS) are omitted, from the right. The line below the table names the \
fastest index.
With --occlusion the table has a line for each index and method, and more columns:
  occluded      polygons in the frustum that the method culled because others
                hide them, mean
  occlusion     time to choose occluders, build the culler and test: median of
                the frames that used it
  occluders, build, tests
                these three stages one by one, as far as the method has them
  used          share of the frames that used the method
  with drawing  assumed total: frame time plus --polygon-ns for each drawn
                polygon, median
With --rig each frame is culled for every screen and eye of the rig. The tracked head is at the eye of --camera, by \
default the recorded head; --room sets whether the room moves with it. The columns visible, culled and occluded, and \
all times, are sums over all views. A second table has for each screen and eye the polygons in view and drawn (means \
of the frames with this view), and these columns:
  all views mean   time of a frame with all views, mean without the slowest 1 %
  views x one mean mean time of a frame with one view, times the number of views
  all against one  ratio: time of all views to that of as many single views
With --draw:
  draw  time from submission to completion on the graphics adapter: median and
        99th percentile
  send  time to upload new polygons and the draw list, median
With --draw and --occlusion hzb the table also has mean numbers of the groups of polygons tested, and of the \
polygons drawn in the depth pass and in the colour pass. It has medians of the adapter's own times of the depth \
pass, the test and the colour pass.
With --cut-nodes drawn, a replay accepts only one index, and neither --check nor --pin.

Indexes:
  brute-force         tests every polygon: the reference
  brute-simd          one loop over all boxes with SIMD
  time-order          a hierarchy of boxes over the order of insertion
  osp-paper           the paper's own tree: binary, preallocated
  osp                 our own form of the paper's tree
  octree-rebuild      an adaptive octree, rebuilt once in frames with new polygons
  octree-rebuild-insert, -thread, -nth
                      the same, rebuilt at other times (--rebuild)
  octree-paper        the paper's octree: rebuilt, tests all eight children
  octree-every-child  an octree that stores a polygon in every child that it
                      touches, also rebuilt
  octree-bvh          an octree with a hierarchy of boxes in each cell, rebuilt
  bvh-midpoint, bvh-median, bvh-sah, bvh-sah-sweep, lbvh, hlbvh
                      bounding volume hierarchies, rebuilt in every frame that
                      inserts a polygon
  bvh-two-level, dynamic-bvh
                      bounding volume hierarchies that insert polygons in place
  loose-octree, kd-tree, quadtree
                      trees that insert polygons in place
  bsp                 a BSP tree along the polygons' planes, also rebuilt

Methods of --occlusion:
  none          frustum culling alone
  frusta        one shadow volume for each occluder
  svbsp         the shadow-volume BSP tree of Chin and Feiner
  svbsp-paper   the paper's variant: inserts single planes
  msvbsp        the paper's modified tree, made conservative
  depth         a depth buffer in software; only pixels that an occluder wholly
                covers count
  depth-last    a depth buffer of the polygons that were visible in the last
                frame, joined at shared edges
  auto          in each frame the cheapest of none, msvbsp, depth-last, and hzb
                with --draw
  hzb, queries  on the graphics adapter, while drawing: a hierarchical depth
                buffer, or hardware occlusion queries
  msvbsp-paper  not conservative: it can cull visible polygons")]
pub(super) struct ReplayArgs {
    /// The sessions: .ron, .ron.zst, .tilt, .apa, CASSIE .json, .poses, .obj, .obj.gz, .glb or .gltf.
    #[arg(required = true)]
    pub(super) files: Vec<PathBuf>,
    #[command(flatten)]
    pub(super) play: PlayArgs,
    #[command(flatten)]
    pub(super) tuning: TuningArgs,
    /// Write a CSV file with one line for each index and frame.
    #[arg(long, value_name = "FILE")]
    pub(super) csv: Option<PathBuf>,
    /// Draw a chart of the frame times over the session, .png or .svg. With several sessions, each has its own file: NAME-1.png.
    /// Needs the feature `bench`.
    #[arg(long, value_name = "FILE")]
    pub(super) chart: Option<PathBuf>,
    /// Print one JSON object for each session instead of a table.
    #[arg(long)]
    pub(super) json: bool,
    /// Compare the fingerprint of the visible polygons with the fingerprint in this file; the exit code is 1 if they
    /// differ.
    #[arg(long, value_name = "FILE")]
    pub(super) check: Option<PathBuf>,
    /// Write the fingerprints of this run to a file for --check.
    #[arg(long, value_name = "FILE")]
    pub(super) pin: Option<PathBuf>,
    /// Number of frames in which to compare the culled polygons with the polygons that really are hidden.
    #[arg(long, value_name = "N", default_value_t = 0, requires = "occlusion", value_parser = clap::value_parser!(u64).range(0..=1_000_000))]
    pub(super) verify_frames: u64,
    #[command(flatten)]
    pub(super) force: ForceArgs,
    #[command(flatten)]
    pub(super) rig: RigPathArgs,
    /// Also draw the remaining polygons of each frame on the graphics adapter, and measure the time [default size:
    /// 1280x720].
    #[arg(long, value_name = "WxH", num_args = 0..=1, default_missing_value = "1280x720", require_equals = true)]
    pub(super) draw: Option<Size>,
    /// Play the session in a window, with times and counts. The replay starts immediately, unless --paused is given.
    #[arg(long, conflicts_with_all = ["csv", "chart", "json", "check", "pin"])]
    pub(super) window: bool,
    /// With --window: pause before the first frame, until you press play.
    #[arg(long, requires = "window")]
    pub(super) paused: bool,
    /// With --window: write one line of JSON for each frame shown.
    #[arg(long, value_name = "FILE", requires = "window")]
    pub(super) trace: Option<PathBuf>,
}

/// Pace, camera and structures of a replay.
#[derive(Args, Clone, Debug)]
pub(super) struct PlayArgs {
    /// The indexes to run, separated by commas [default: brute-force,osp-paper,osp,octree-rebuild].
    #[arg(long, value_delimiter = ',', value_parser = index_parser())]
    pub(super) index: Vec<IndexKind>,
    #[command(flatten)]
    pub(super) rebuild: RebuildArgs,
    /// Part of the session that each frame plays. `recorded`: up to the time of the frame, by the recorded time stamps.
    /// `samples:N`: the next N hand samples.
    #[arg(long, default_value = "samples:16")]
    pub(super) pace: Pace,
    /// Position of the eye: `auto` is the recorded head path, else the session's own camera, else `orbit`. `orbit`
    /// circles around the model, `follow` is behind the hand, `inside` turns in the middle of the model.
    #[arg(long, default_value = "auto", value_parser = camera_parser())]
    pub(super) camera: CameraChoice,
    /// Largest number of seconds to spend on each index, including the time to apply the events.
    #[arg(long, default_value_t = 20.0, value_name = "SECS", value_parser = numbers::seconds)]
    pub(super) budget: f64,
    /// Methods of occlusion culling, separated by commas; each runs after frustum culling. If --index is missing, the only
    /// index is `osp`. `auto` chooses by measured times. In a study, and with --check or --pin, it chooses by counts of work,
    /// which are the same on every machine. `hzb` and `queries` need --draw.
    #[arg(long, value_delimiter = ',', value_parser = occlusion_parser())]
    pub(super) occlusion: Vec<Method>,
    #[command(flatten)]
    pub(super) reading: ReadArgs,
}

/// Settings of the structures and of occlusion culling.
#[derive(Args, Clone, Debug)]
pub(super) struct TuningArgs {
    #[command(flatten)]
    pub(super) settings: IndexSettingsArgs,
    #[command(flatten)]
    pub(super) cut_nodes: CutNodesArgs,
    /// Largest number of occluders in a frame [default: 64; 16 for `auto`].
    #[arg(long, value_name = "N", value_parser = numbers::occluders)]
    pub(super) occluders: Option<usize>,
    #[command(flatten)]
    pub(super) tests: TestArgs,
    /// Assumed time to draw one polygon, nanoseconds. Occlusion culling tests only nodes that take longer to draw than
    /// to test, and `auto` compares methods by this time.
    #[arg(long, value_name = "NS", default_value_t = POLYGON_NS, value_parser = numbers::nanoseconds)]
    pub(super) polygon_ns: f64,
    /// Index for the polygons of a moving group. `polygons` updates each polygon in every frame in which the group
    /// moves. `whole` stores the polygons in a second index, in the group's own space. Both find the same polygons. A
    /// window always uses `whole`.
    #[arg(long, value_enum, default_value_t = GroupIndexing::Polygons)]
    pub(super) groups: GroupIndexing,
}

impl Default for TuningArgs {
    /// The values without options.
    fn default() -> Self {
        Self {
            settings: IndexSettingsArgs::default(),
            cut_nodes: CutNodesArgs::default(),
            occluders: None,
            tests: TestArgs::default(),
            polygon_ns: POLYGON_NS,
            groups: GroupIndexing::Polygons,
        }
    }
}

/// Index for the polygons of groups that move.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum GroupIndexing {
    /// In the main index, each by its box in the world.
    Polygons,
    /// In a separate index for each group.
    Whole,
}

impl PlayArgs {
    /// Returns the indexes, in the order of their rows in the table.
    pub(super) fn indexes(&self) -> Vec<IndexKind> {
        self.rebuild.expand(self.named_indexes(), |kind| kind)
    }

    fn named_indexes(&self) -> &[IndexKind] {
        match (self.index.as_slice(), self.occlusion.is_empty()) {
            ([], true) => IndexKind::DEFAULT,
            ([], _) => &[IndexKind::Osp],
            (indexes, _) => indexes,
        }
    }

    /// Returns each combination of an index and a method of occlusion culling, if any.
    pub(super) fn runs(&self) -> Vec<(IndexKind, Option<Method>)> {
        let methods: Vec<_> = match self.occlusion.as_slice() {
            [] => vec![None],
            methods => methods.iter().copied().map(Some).collect(),
        };
        self.indexes().iter().flat_map(|index| methods.iter().map(|method| (*index, *method))).collect()
    }

    /// Returns the values of all options in one line, including the defaults. Equal lines mean the same work.
    pub(super) fn in_one_line(&self) -> String {
        let indexes = self.indexes();
        let join = |names: Vec<&str>| names.join(",");
        let mut indexes: Vec<&str> = indexes.iter().map(|index| index.name()).collect();
        indexes.dedup();
        let mut line = format!(
            "--index {} --pace {} --camera {} --budget {} --max-polygons {}",
            join(indexes),
            self.pace,
            self.camera.name(),
            self.budget,
            self.reading.options().limits.polygons
        );
        if self.reading.lenient {
            line += " --lenient";
        }
        if !self.occlusion.is_empty() {
            line += &format!(
                " --occlusion {}",
                join(self.occlusion.iter().map(|method| method.name()).collect())
            );
        }
        line
    }

    /// Reports errors in the options before the work begins. `draws`: whether the command draws frames.
    pub(super) fn check(&self, draws: bool) -> anyhow::Result<()> {
        self.rebuild.check(self.named_indexes().contains(&IndexKind::OctreeRebuild))?;
        if let Some(choice) = self.occlusion.iter().find(|choice| choice.is_while_drawing() && !draws) {
            let name = choice.name();
            let drawn = "culls while drawing: it needs `osp replay --draw`";
            match Feature::Render.is_built() {
                true => bail!("--occlusion {name} {drawn}"),
                false => bail!("--occlusion {name} {drawn}, which {}", Lacking(&[Feature::Render])),
            }
        }
        Ok(())
    }
}

impl TuningArgs {
    /// Returns the settings of these indexes. An option that concerns none of them is an error.
    pub(super) fn settings(&self, indexes: &[IndexKind]) -> anyhow::Result<IndexSettings> {
        let settings = self.cut_nodes.add_to(self.settings.settings(indexes)?, indexes)?;
        if settings.cut_nodes == CutNodes::Drawn && indexes.iter().any(|other| *other != indexes[0]) {
            bail!(
                "--cut-nodes drawn: expected one index, because it also draws polygons that are not in view"
            );
        }
        Ok(settings)
    }

    /// Reports errors in the options before the work begins.
    pub(super) fn check(&self, play: &PlayArgs) -> anyhow::Result<()> {
        if let Some(option) = self.tests.given().filter(|_| play.occlusion.is_empty()) {
            bail!("{option} is about occlusion culling: it needs --occlusion");
        }
        self.settings(&play.indexes()).map(drop)
    }
}
