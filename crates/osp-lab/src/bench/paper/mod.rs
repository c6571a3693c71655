//! The experiments of the OSP paper (section 4, Figs. 19 to 23), as it is printed and beside what osp makes of it.
//!
//! The trees and the occluders are the paper's: single polygons ranked by equation (1), nodes tested by their sphere or
//! their eight corners, all polygons of a node drawn that the frustum cuts (Fig. 6). What of that culls visible polygons
//! takes part here and in `osp verify` only, and its table says so.

mod charts;
mod csv;
mod cubes;
mod drawing;
mod flight;
mod growing;
mod table;

use serde::Serialize;
use thiserror::Error;

pub use cubes::CubeRow;
pub use drawing::Adapter;
pub use flight::FlightRow;
pub use growing::GrowingRow;

pub(super) use charts::charts;
pub(super) use table::{notes, tables};

use osp::{
    math::Aabb,
    occlusion::{NodeTest, Score},
};
use osp_session::{
    recording::{Event, Pace, RecordingError},
    replay::{CameraChoice, CameraPath, Summary},
    scene::Scene,
};

/// Why the paper's experiments could not be made.
#[derive(Debug, Error)]
pub enum PaperError {
    /// The session is damaged.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The adapter failed.
    #[error("drawing failed")]
    Drawing(#[source] Box<dyn std::error::Error + Send + Sync>),
}

/// How the paper's experiments are made.
#[derive(Clone, Debug, PartialEq)]
pub struct PaperConfig {
    /// Maximum depths of the tree, binary levels (Fig. 2, step 1).
    pub depths: Vec<u32>,
    /// Edges of its cube, as multiples of the session's own cube.
    pub cubes: Vec<f32>,
    /// Frames that are measured, of each experiment.
    pub frames: u64,
    /// Frames of the flight in which what is culled is compared with what can be seen.
    pub verified: u64,
    /// Most occluders of a frame.
    pub occluders: usize,
    /// How the conservative methods test nodes.
    pub node_test: NodeTest,
    /// How the conservative methods score occluders.
    pub score: Score,
}

impl PaperConfig {
    /// The tree of the other experiments: the only depth that was asked for, else the usual one.
    fn depth(&self) -> u32 {
        if let [depth] = self.depths[..] { depth } else { osp_rivals::DEFAULT_MAX_DEPTH }
    }

    /// The cube of the other experiments, as a multiple of the session's.
    fn cube(&self) -> f32 {
        if let [cube] = self.cubes[..] { cube } else { 1.0 }
    }
}

/// A session as the experiments take it.
#[derive(Debug)]
pub struct PaperInput<'a> {
    /// Name of the recording.
    pub recording: &'a str,
    /// What it holds at this pace.
    pub summary: &'a Summary,
    /// How much of it a frame takes.
    pub pace: Pace,
    /// The camera's path while the model grows, and its name.
    pub camera: (CameraPath, &'static str),
    /// The session's cube.
    pub root: Aabb,
    /// The finished model.
    pub scene: &'a Scene,
}

impl PaperInput<'_> {
    /// The session's cube, scaled.
    fn cube(&self, factor: f32) -> Aabb {
        Aabb::cube(self.root.center(), self.root.extent().max_element() * factor)
    }
}

/// A session through all experiments.
#[derive(Clone, Debug, Serialize)]
pub struct PaperResult {
    /// Name of the recording.
    pub recording: String,
    /// Polygons made.
    pub polygons: u64,
    /// Frames of the session.
    pub frames: u64,
    /// The pace, as on the command line.
    pub pace: String,
    /// The camera while the model grows.
    pub camera: String,
    /// Who drew, and how large; `None`: nothing was drawn, and a frame is insertion and culling.
    pub drawn_by: Option<String>,
    /// Maximum depth of the paper's tree, binary levels.
    pub depth: u32,
    /// Edge of its cube, metres.
    pub cube_m: f32,
    /// Most occluders of a frame.
    pub occluders: usize,
    /// How the conservative methods test nodes.
    pub node_test: &'static str,
    /// How the conservative methods score occluders.
    pub score: &'static str,
    /// The growing model (Figs. 19, 21 to 23).
    pub growing: Vec<GrowingRow>,
    /// The camera of the flight.
    pub flight_camera: String,
    /// The flight through the finished model (Fig. 20).
    pub flight: Vec<FlightRow>,
    /// Depths and cubes (the inputs of Fig. 2).
    pub cubes: Vec<CubeRow>,
}

/// Plays a session through the paper's experiments; draws if there is an adapter. `progress` hears what comes next.
///
/// # Errors
/// The recording is damaged, or the adapter failed.
pub fn run_paper<I>(
    input: &PaperInput<'_>,
    config: &PaperConfig,
    events: I,
    adapter: Option<&Adapter>,
    mut progress: impl FnMut(&str),
) -> Result<PaperResult, PaperError>
where
    I: Iterator<Item = Result<Event, RecordingError>>,
{
    progress("growing");
    let (growing, moments) = growing::grow(input, config, events, adapter)?;
    progress("flight");
    // The session's own walk, if there is one: else a turn in the middle of the model.
    let choice = if input.summary.heads > 0 { CameraChoice::Auto } else { CameraChoice::Inside };
    let path = CameraPath::new(choice, None, &input.summary.bounds);
    let views: Vec<_> = moments.iter().map(|moment| path.view(moment)).collect();
    let flight = flight::fly(input, config, &views, adapter, &mut progress)?;
    progress("depths and cubes");
    let cubes = cubes::measure(input, config, &views);
    Ok(PaperResult {
        recording: input.recording.to_owned(),
        polygons: input.summary.counts.polygons,
        frames: input.summary.frames,
        pace: input.pace.to_string(),
        camera: input.camera.1.to_owned(),
        drawn_by: adapter.map(Adapter::name),
        depth: config.depth(),
        cube_m: input.cube(config.cube()).extent().max_element(),
        occluders: config.occluders,
        node_test: config.node_test.name(),
        score: config.score.name(),
        growing,
        flight_camera: if input.summary.heads > 0 { "the recorded head" } else { choice.name() }.to_owned(),
        flight,
        cubes,
    })
}

/// The mean of what is counted, over `len` of them.
fn mean(sum: u64, len: usize) -> f64 {
    sum as f64 / len.max(1) as f64
}
