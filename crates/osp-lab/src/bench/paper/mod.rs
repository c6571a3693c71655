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
mod input;
mod result;
mod table;

pub use cubes::CubeRow;
pub use drawing::Adapter;
pub use flight::FlightRow;
pub use growing::GrowingRow;
pub use input::{PaperConfig, PaperError, PaperInput};
pub use result::PaperResult;

pub(super) use charts::charts;
pub(super) use table::{notes, tables};

use osp_session::{
    recording::{Event, RecordingError},
    replay::{CameraChoice, CameraPath},
};

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
