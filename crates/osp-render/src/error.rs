use std::path::PathBuf;

use thiserror::Error;

/// The reason why nothing could be drawn. The scene is never affected.
#[derive(Debug, Error)]
pub enum RenderError {
    #[error(
        "no graphics adapter was found: is a driver installed? (on Linux, mesa-vulkan-drivers has one in software)"
    )]
    NoAdapter,
    /// The driver lacks a required capability.
    #[error("the graphics adapter {adapter} cannot be used: it lacks {lacks}")]
    Lacks { adapter: String, lacks: &'static str },
    /// The driver lacks a capability for occlusion culling on the GPU.
    #[error("the graphics adapter {adapter} cannot cull hidden polygons: it lacks {lacks}")]
    NoOcclusion { adapter: String, lacks: &'static str },
    /// The driver refused to open a device.
    #[error("the graphics adapter {adapter} did not open: {reason}")]
    NoDevice { adapter: String, reason: String },
    /// The device was lost (driver restarted, adapter unplugged). A new [`super::Gpu`] can replace it.
    #[error("the graphics device was lost: {0}")]
    DeviceLost(String),
    /// The driver reported an error, such as lack of memory.
    #[error("the graphics driver reported: {0}")]
    Device(String),
    /// The size of a picture is zero, or exceeds the limit of the adapter.
    #[error("a picture of {width}x{height} cannot be drawn: expected 1 to {limit} pixels each way")]
    Size { width: u32, height: u32, limit: u32 },
    #[error("the window has no drawable surface: {0}")]
    Surface(String),
    /// The picture could not be written to the file.
    #[error("{}: {reason}", path.display())]
    Write { path: PathBuf, reason: String },
}
