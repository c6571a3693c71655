use std::path::PathBuf;

use thiserror::Error;

/// The reason why nothing could be drawn. The scene is never affected.
#[derive(Debug, Error)]
pub enum RenderError {
    #[error(
        "no graphics adapter was found: is a driver installed? (on Linux, mesa-vulkan-drivers has one in software)"
    )]
    NoAdapter,
    #[error("the graphics adapter {adapter} cannot be used: it lacks {lacks}")]
    Lacks { adapter: String, lacks: &'static str },
    #[error("the graphics adapter {adapter} cannot cull hidden polygons: it lacks {lacks}")]
    NoOcclusion { adapter: String, lacks: &'static str },
    #[error("the graphics adapter {adapter} did not open: {reason}")]
    NoDevice { adapter: String, reason: String },
    /// The device was lost (driver restarted, adapter unplugged). A new [`super::Gpu`] can replace it.
    #[error("the graphics device was lost: {0}")]
    DeviceLost(String),
    #[error("the graphics driver reported: {0}")]
    Device(String),
    #[error("a picture of {width}x{height} cannot be drawn: expected 1 to {limit} pixels each way")]
    Size { width: u32, height: u32, limit: u32 },
    #[error("the window has no drawable surface: {0}")]
    Surface(String),
    #[error("{}: {reason}", path.display())]
    Write { path: PathBuf, reason: String },
}
