use std::path::PathBuf;

use thiserror::Error;

/// The reason why nothing could be drawn. The scene is never affected.
#[derive(Debug, Error)]
pub enum RenderError {
    /// The system has no graphics driver.
    #[error(
        "no graphics adapter was found: is a driver installed? (on Linux, mesa-vulkan-drivers has one in software)"
    )]
    NoAdapter,
    /// The driver lacks a required capability.
    #[error("the graphics adapter {adapter} cannot be used: it lacks {lacks}")]
    Lacks {
        /// Name of the adapter.
        adapter: String,
        /// The missing capability.
        lacks: &'static str,
    },
    /// The driver lacks a capability for occlusion culling on the GPU.
    #[error("the graphics adapter {adapter} cannot cull hidden polygons: it lacks {lacks}")]
    NoOcclusion {
        /// Name of the adapter.
        adapter: String,
        /// The missing capability.
        lacks: &'static str,
    },
    /// The driver refused to open a device.
    #[error("the graphics adapter {adapter} did not open: {reason}")]
    NoDevice {
        /// Name of the adapter.
        adapter: String,
        /// The driver's message.
        reason: String,
    },
    /// The device was lost (driver restarted, adapter unplugged). A new [`super::Gpu`] can replace it.
    #[error("the graphics device was lost: {0}")]
    DeviceLost(String),
    /// The driver reported an error, such as lack of memory.
    #[error("the graphics driver reported: {0}")]
    Device(String),
    /// The size of a picture is zero, or exceeds the limit of the adapter.
    #[error("a picture of {width}x{height} cannot be drawn: expected 1 to {limit} pixels each way")]
    Size {
        /// Width requested, pixels.
        width: u32,
        /// Height requested, pixels.
        height: u32,
        /// Largest width and height, pixels.
        limit: u32,
    },
    /// The window has no surface to draw on.
    #[error("the window has no drawable surface: {0}")]
    Surface(String),
    /// The picture could not be written to the file.
    #[error("{}: {reason}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The message of the system or the encoder.
        reason: String,
    },
}
