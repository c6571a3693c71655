//! Inputs of the experiments.

use thiserror::Error;

use crate::Contender;
use osp::{
    math::Aabb,
    occlusion::{NodeTest, Score},
};
use osp_rivals::IndexKind;
use osp_session::{
    recording::{Pace, RecordingError},
    replay::{CameraPath, Summary},
    scene::Scene,
};

/// Reason for which the paper's experiments could not be run.
#[derive(Debug, Error)]
pub enum PaperError {
    #[error(transparent)]
    Recording(#[from] RecordingError),
    #[error("drawing failed")]
    Drawing(#[source] Box<dyn std::error::Error + Send + Sync>),
    #[error("{0}")]
    NoOcclusion(String),
}

#[derive(Clone, Debug, PartialEq)]
pub struct PaperConfig {
    /// The structures of the growing model. `osp` and the reference are always added.
    pub kinds: Vec<Contender>,
    /// The reference structure of the growing model.
    pub reference: IndexKind,
    /// Maximum depths of the tree, binary levels (Fig. 2, step 1).
    pub depths: Vec<u32>,
    /// Edges of the tree's cube, as multiples of the edge of the session's own cube.
    pub cubes: Vec<f32>,
    /// Number of frames measured in each experiment.
    pub frames: u64,
    /// Number of frames of the flight in which the culled polygons are compared with the visible polygons.
    pub verified: u64,
    pub occluders: usize,
    /// Node test of the conservative methods.
    pub node_test: NodeTest,
    /// Occluder score of the conservative methods.
    pub score: Score,
}

impl PaperConfig {
    /// The default of `kinds`: the paper's trees, the octree in its best form, and structures that are not rebuilt and
    /// lack the paper's planes.
    pub const USUAL: [Contender; 7] = [
        Contender::Own(IndexKind::OspPaper),
        Contender::Own(IndexKind::OctreePaper),
        Contender::Own(IndexKind::OctreeRebuild),
        Contender::Own(IndexKind::TimeOrder),
        Contender::Own(IndexKind::BruteSimd),
        Contender::Own(IndexKind::BruteForce),
        Contender::Own(IndexKind::Osp),
    ];

    /// The depth of the tree in the other experiments: the value of `depths` if there is only one, else the default.
    pub(super) fn depth(&self) -> u32 {
        if let [depth] = self.depths[..] { depth } else { osp_rivals::DEFAULT_MAX_DEPTH }
    }

    /// The cube of the other experiments, as a multiple of the session's cube: the value of `cubes` if there is only
    /// one, else 1.
    pub(super) fn cube(&self) -> f32 {
        if let [cube] = self.cubes[..] { cube } else { 1.0 }
    }
}

#[derive(Debug)]
pub struct PaperInput<'a> {
    pub recording: &'a str,
    pub summary: &'a Summary,
    /// Part of the session that each frame plays.
    pub pace: Pace,
    /// The camera's path while the model grows, and its name.
    pub camera: (CameraPath, &'static str),
    /// The session's cube.
    pub root: Aabb,
    /// The finished model.
    pub scene: &'a Scene,
}

impl PaperInput<'_> {
    /// The number of polygons of the session.
    pub(super) fn capacity(&self) -> usize {
        usize::try_from(self.summary.counts.polygons).unwrap_or(usize::MAX)
    }

    /// The session's cube, scaled.
    pub(super) fn cube(&self, factor: f32) -> Aabb {
        Aabb::cube(self.root.center(), self.root.extent().max_element() * factor)
    }
}

/// The mean of a sum over `len` frames.
pub(super) fn mean(sum: u64, len: usize) -> f64 {
    sum as f64 / len.max(1) as f64
}
