use serde::Serialize;

use super::{CubeRow, FlightRow, GrowingRow};

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
