//! The arguments of `osp thumbs`.

use std::path::PathBuf;

use clap::Args;

use super::{outputs::ForceArgs, parsers::Size, reading::ReadArgs};

/// Draw a picture of each session in folders.
///
/// A picture is a PNG with the artist's view, drawn like `osp render`. The command skips a picture that is newer than its session, so the same command continues after an interruption. If
/// there were errors, they are listed at the end, and the exit code is 2. One graphics adapter draws all pictures; a
/// software adapter suffices.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  osp thumbs sketches --out thumbs
  osp thumbs sketches --size 512x512
  osp thumbs a.tilt b.ron --out thumbs

Without --out, the picture of sketch.tilt is sketch.thumb.png in the same folder. With --out FOLDER, it is \
FOLDER/sketch.png.")]
pub(super) struct ThumbsArgs {
    /// The sessions, of any format that replay reads, or folders of them.
    #[arg(required = true, value_name = "FILES_OR_FOLDERS")]
    pub(super) files: Vec<PathBuf>,
    /// The folder for the pictures. They get the same subfolders as the sessions [default: beside each session].
    #[arg(long, value_name = "FOLDER")]
    pub(super) out: Option<PathBuf>,
    /// Width and height in pixels.
    #[arg(long, default_value = "320x240")]
    pub(super) size: Size,
    #[command(flatten)]
    pub(super) force: ForceArgs,
    #[command(flatten)]
    pub(super) reading: ReadArgs,
}
