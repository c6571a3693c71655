use std::io;

use thiserror::Error;

#[derive(Debug, Error)]
pub enum ExportError {
    #[error(transparent)]
    Io(#[from] io::Error),
    /// The file would be larger than the format allows: its byte counts have 32 bits.
    #[error("the model is too large for one file of this format: {0} bytes of at most 4294967295")]
    TooLarge(u64),
    /// This build has no compression: the feature `compress` is missing.
    #[error("expected a build of osp-session with its feature `compress`")]
    NotCompressed,
    /// A model of finished polygons, and a format of strokes.
    #[error("expected strokes with control points, of which .tilt consists; found {0} polygons of a model")]
    NoStrokes(u64),
    #[error("writing it was cancelled")]
    Cancelled,
}
