//! How a window is opened, and why there is none.

use std::{io, path::PathBuf, sync::Arc};

use thiserror::Error;
use winit::{
    dpi::LogicalSize,
    event_loop::{ActiveEventLoop, EventLoop},
    window::Window,
};

use crate::{
    app::{
        journal::Unwritten,
        painter::Painter,
        studio::Studio,
        tracker::{TrackerAddress, TrackerError, TrackerOptions},
    },
    render::RenderError,
    view::Stereo,
};

/// How the window is opened.
#[derive(Clone, Debug, Default)]
pub struct WindowOptions {
    /// Width and height in points; 1280 by 800 if left out.
    pub size: Option<(u32, u32)>,
    /// A tracker to listen to.
    pub tracker: Option<TrackerAddress>,
    /// Which senders' messages are accepted.
    pub tracker_options: TrackerOptions,
    /// A file that gets one line of JSON for each frame.
    pub trace: Option<PathBuf>,
    /// Where the window keeps its settings; nowhere if left out.
    pub settings: Option<PathBuf>,
}

/// An error of the window system without the place in its source, which says nothing to a user.
fn without_place(error: &str) -> &str {
    let cause = error.strip_prefix("os error at ").and_then(|rest| rest.split_once(": "));
    cause.map_or(error, |(_, cause)| cause)
}

/// Why there is no window, or no more.
#[derive(Debug, Error)]
pub enum WindowError {
    /// The system has no display.
    #[error("no window can be opened: {}", without_place(.0))]
    NoDisplay(String),
    /// Nothing can be drawn.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// The tracker cannot be listened to.
    #[error(transparent)]
    Tracker(#[from] TrackerError),
    /// A part of a session could not be written.
    #[error(transparent)]
    Unwritten(#[from] Unwritten),
    /// The trace cannot be written.
    #[error("{}: {cause}", path.display())]
    Trace {
        /// The file.
        path: PathBuf,
        /// The system's error.
        cause: io::Error,
    },
}

/// An event from another thread: messages of a tracker, or the end of a dialog.
#[derive(Clone, Copy, Debug)]
pub(in crate::app) struct Wake;

/// A system without a display gives an error; one without a keyboard library makes winit panic, which is caught.
pub(super) fn open_event_loop() -> Result<EventLoop<Wake>, WindowError> {
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

/// A window for each screen and eye, where the rig asks for it.
pub(super) fn open_screens(
    event_loop: &ActiveEventLoop,
    studio: &Studio,
    painter: &mut Painter,
) -> Result<(), WindowError> {
    let room = studio.room();
    let Some(rig) = room.rig().filter(|_| room.stereo() == Stereo::Windows) else { return Ok(()) };
    for screen in &rig.screens {
        for eye in room.stereo().eyes() {
            let height = 480.0;
            let attributes = Window::default_attributes()
                .with_title(format!("osp: {} {eye:?}", screen.name))
                .with_inner_size(LogicalSize::new(height * f64::from(screen.aspect()), height));
            let window = event_loop
                .create_window(attributes)
                .map_err(|error| WindowError::NoDisplay(error.to_string()))?;
            painter.add_window(Arc::new(window))?;
        }
    }
    Ok(())
}
