//! The experiments of the OSP paper (section 4, Figs. 19 to 23), as printed and with osp's versions.
//!
//! The trees and the occluders are the paper's. Occluders are single polygons, ranked by equation (1). Nodes are tested
//! by their sphere or their eight corners. All polygons of a node that the frustum intersects are drawn (Fig. 6).
//! Methods that cull visible polygons are used only here and in `osp verify`, and the tables mark them.

mod cubes;
mod drawing;
mod flight;
mod growing;
mod input;
mod verdict;

pub(super) use verdict::verdict;

pub use drawing::Adapter;
pub use input::{PaperConfig, PaperError, PaperInput};

use crate::{report::short, rows::Rows};
use osp_session::{
    recording::{Event, RecordingError},
    replay::{CameraChoice, CameraPath},
};

/// Runs the paper's experiments on a session; the rows are the parts `paper-growing`, `paper-flight` and `paper-cube`.
/// Draws if there is an adapter. `progress` is called with the name of the next measurement.
///
/// # Errors
/// The recording is damaged, or the adapter failed.
pub fn run_paper<I>(
    input: &PaperInput<'_>,
    config: &PaperConfig,
    events: I,
    adapter: Option<&Adapter>,
    mut progress: impl FnMut(&str),
) -> Result<Rows, PaperError>
where
    I: Iterator<Item = Result<Event, RecordingError>>,
{
    progress("growing");
    let mut rows = Rows::default();
    let moments = growing::grow(&mut rows, input, config, events, adapter)?;
    progress("flight");
    // The recorded head path if the session has one, else a rotation in the middle of the model.
    let choice = if input.summary.heads > 0 { CameraChoice::Auto } else { CameraChoice::Inside };
    let path = CameraPath::new(choice, None, &input.summary.bounds);
    let views: Vec<_> = moments.iter().map(|moment| path.view(moment)).collect();
    flight::fly(&mut rows, input, config, &views, adapter, &mut progress)?;
    progress("depths and cubes");
    cubes::measure(&mut rows, input, config, &views);
    let drawing = match adapter {
        Some(adapter) => {
            format!("Drawn by {}: a frame is insertion, culling, sending and drawing.", adapter.name())
        }
        None => {
            "Nothing was drawn (--draw): a frame is insertion and culling, so its time gives no frame rate."
                .to_owned()
        }
    };
    let cube_m = short(f64::from(input.cube(config.cube()).extent().max_element()));
    let flown = if input.summary.heads > 0 { "the recorded head" } else { choice.name() };
    for note in [
        drawing,
        "The ranking can be compared with the paper's; the frame rates cannot: the paper used another machine and renderer.".to_owned(),
        format!(
            "The paper's tree: {} levels over a cube of {cube_m} m. As in Fig. 6 osp-paper and octree-paper draw all polygons of a node \
             that the frustum cuts; the others draw those in view.",
            config.depth()
        ),
    ] {
        rows.note("paper-growing", note);
    }
    let (camera, occluders) = (input.camera.1, config.occluders);
    rows.note("paper-growing", format!("{}: {}, camera {camera}.", input.recording, input.pace));
    rows.note("paper-flight", format!("{}: camera {flown}; {occluders} occluders.", input.recording));
    Ok(rows)
}
