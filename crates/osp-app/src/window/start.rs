//! Options and errors of opening a window.

use std::{io, path::PathBuf};

use thiserror::Error;
use winit::event_loop::EventLoop;

use crate::{
    journal::Unwritten,
    threads::Wake,
    tracker::{TrackerAddress, TrackerError, TrackerOptions},
};
use osp_render::RenderError;

#[derive(Clone, Debug, Default)]
pub struct WindowOptions {
    /// Width and height in points; `None` means 1280 by 800.
    pub size: Option<(u32, u32)>,
    /// A tracker to listen to.
    pub tracker: Option<TrackerAddress>,
    /// The messages that are accepted.
    pub tracker_options: TrackerOptions,
    /// A file to which one line of JSON is written for each frame.
    pub trace: Option<PathBuf>,
    /// File of the window's settings; `None` if they are not stored.
    pub settings: Option<PathBuf>,
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MonitorInfo {
    /// Number of the monitor from 1, ordered from left to right, then from top to bottom.
    pub number: usize,
    /// Name of the monitor in the system; empty if it has none.
    pub name: String,
    /// Width and height, pixels.
    pub size_px: (u32, u32),
    /// Upper left corner on the desktop, pixels.
    pub at_px: (i32, i32),
}

impl std::fmt::Display for MonitorInfo {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let ((width, height), (x, y)) = (self.size_px, self.at_px);
        write!(f, "{} `{}` ({width}x{height} at {x},{y})", self.number, self.name)
    }
}

/// The text of a window system's error without its source position, which does not help the user.
fn without_place(error: &str) -> &str {
    let cause = error.strip_prefix("os error at ").and_then(|rest| rest.split_once(": "));
    cause.map_or(error, |(_, cause)| cause)
}

/// Reason for which a window cannot be opened, or has closed.
#[derive(Debug, Error)]
pub enum WindowError {
    #[error("no window can be opened: {}", without_place(.0))]
    NoDisplay(String),
    /// No adapter can draw.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// The tracker cannot be read.
    #[error(transparent)]
    Tracker(#[from] TrackerError),
    /// A rig names a monitor that does not exist.
    #[error("no monitor `{wanted}`: expected {}", expected_monitors(.there))]
    NoMonitor { wanted: String, there: Vec<MonitorInfo> },
    /// A rig names the same monitor in two ways.
    #[error("the rig has two names for monitor {0}: expected one for all its outputs")]
    SameMonitor(MonitorInfo),
    /// A part of a session could not be written.
    #[error(transparent)]
    Unwritten(#[from] Unwritten),
    /// The trace cannot be written.
    #[error("{}: {cause}", path.display())]
    Trace { path: PathBuf, cause: io::Error },
}

fn expected_monitors(monitors: &[MonitorInfo]) -> String {
    match monitors {
        [] => "a display with monitors".to_owned(),
        _ => format!("one of {}", monitors.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ")),
    }
}

/// Opens an event loop. On a system without a display this fails. Without a keyboard library winit panics; the panic
/// becomes an error.
pub(crate) fn open_event_loop() -> Result<EventLoop<Wake>, WindowError> {
    let hook = std::panic::take_hook();
    std::panic::set_hook(Box::new(|_| {}));
    let opened = std::panic::catch_unwind(|| EventLoop::<Wake>::with_user_event().build());
    std::panic::set_hook(hook);
    match opened {
        Ok(Ok(event_loop)) => Ok(event_loop),
        Ok(Err(error)) => Err(WindowError::NoDisplay(error.to_string().replace('\n', " "))),
        Err(panic) => {
            let said = panic.downcast_ref::<String>().map(String::as_str);
            let said =
                said.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("the window system failed");
            Err(WindowError::NoDisplay(said.replace('\n', " ")))
        }
    }
}
