//! The arguments of `osp draw-occlusion`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::{
    draw_index_args::SideArg, numbers, occlusion_test_args::score_parser, outputs::ForceArgs,
    parsers::camera_parser, played::FrameArgs,
};
use osp::occlusion::Score;
use osp_session::{recording::Camera, replay::CameraChoice};

/// Draw the occluders of a frame, their shadows and the MSVBSP tree.
///
/// The picture shows the eye's view; each plane of the tree appears as a line. Below are the shadows in parallel
/// projection and the tree. The tree tests the bounding box of each polygon in view. The command finds the visible
/// polygons with the same method as `osp verify`. It also prints the occluders, best first.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  osp draw-occlusion recordings/room.ron room.png
  osp draw-occlusion docs/figures/vanish.ron v.png --form both --occluders 2
  osp draw-occlusion recordings/room.ron planes.gif --occluders 3
  osp draw-occlusion recordings/room.ron tree.dot   (for Graphviz)

A .gif shows the growth of the tree: each picture has --every N planes more than the picture before, and marks the \
polygons that these planes hide. The picture omits planes that do not cross their cell.")]
pub(super) struct DrawOcclusionArgs {
    #[command(flatten)]
    pub(super) session: FrameArgs,
    /// File of the picture: .svg, .png or .gif, or .dot for the tree.
    #[arg(value_name = "OUT")]
    pub(super) out: PathBuf,
    /// Form of the tree: `conservative` (`msvbsp`), `paper` (`msvbsp-paper`, hides visible polygons), or `both` side by
    /// side.
    #[arg(long, value_enum, default_value_t = Form::Conservative)]
    pub(super) form: Form,
    /// Position of the eye: `auto` is the recorded head path, else the session's own camera, else `orbit`. `orbit`
    /// circles around the model, `follow` is behind the hand, `inside` turns in the middle of the model.
    #[arg(long, default_value = "auto", value_parser = camera_parser())]
    pub(super) camera: CameraChoice,
    /// Position of the eye, in place of --camera, in the form of a recording's header: `(p: (x, y, z), q: (x, y, z, w),
    /// fov_degrees: 60)` is the eye in metres, the rotation from view to world, and the vertical field of view.
    #[arg(long, conflicts_with = "camera")]
    pub(super) view: Option<Camera>,
    /// Largest number of occluders.
    #[arg(long, default_value = "6", value_name = "N", value_parser = numbers::occluders)]
    pub(super) occluders: usize,
    /// Score of an occluder: the `solid-angle` of its part in view, or equation (1) of the `paper`.
    #[arg(long, default_value = "solid-angle", value_parser = score_parser())]
    pub(super) score: Score,
    /// The side from which the shadows are seen [default: top, or a side if the eye looks up or down].
    #[arg(long, value_enum)]
    pub(super) from: Option<SideArg>,
    /// Planes that each picture of a .gif adds [default: 1].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(super) every: Option<u32>,
    #[command(flatten)]
    pub(super) force: ForceArgs,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Form {
    /// The conservative form.
    Conservative,
    /// The paper's form.
    Paper,
    /// Both, side by side.
    Both,
}
