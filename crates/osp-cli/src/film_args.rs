//! The arguments of `osp film`.

use std::path::PathBuf;
#[cfg(feature = "window")]
use std::{ffi::OsStr, path::Path};

use clap::Args;
#[cfg(feature = "window")]
use clap::{Command, FromArgMatches};

use super::{numbers, parsers::Size, render_args::ShownArgs};

/// Film a session: a turn around the finished model, the growing model, or the artist's own view.
///
/// The command draws the same pictures as `osp render`, with all brushes, on the graphics adapter (a software adapter
/// suffices). The name decides the format: an MP4 (H.264), which players and sites accept, or an animated GIF.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  osp film sketch.tilt film.mp4
  osp film sketch.tilt film.mp4 --size 1920x1080 --fps 60
  osp film recordings/portrait.ron grow.gif --path grow --seconds 6
  osp film painting.apa seen.gif --path recorded --size 480x270 --fps 15

Paths:
  turntable  once around the finished model, beginning with the view of `osp
             render --camera whole`
  grow       the model while it was drawn, with the view of `osp render`
  recorded   the model while it was drawn, along the recorded head path

With `grow` and `recorded` the session's frames (--pace) are spread evenly over --seconds. The last picture stays \
for a second more. Animated brushes begin at --time and move with the film.
A GIF has 256 colours a frame. A video has even sides: an odd --size grows by one pixel. For other kinds of \
video, let `osp render --every` write numbered pictures: it prints a command of ffmpeg for them. The window makes \
the default film: *File*, *Save film…*.")]
pub(super) struct FilmArgs {
    /// The session, of any format that replay reads.
    pub(super) file: PathBuf,
    /// The film to write: .mp4 or .gif.
    #[arg(value_name = "OUT")]
    pub(super) out: PathBuf,
    /// Path of the eye.
    #[arg(long, default_value = "turntable", value_parser = ["turntable", "grow", "recorded"])]
    pub(super) path: String,
    /// Length of the film, seconds.
    #[arg(long, value_name = "S", default_value_t = 10.0, value_parser = numbers::film_s)]
    pub(super) seconds: f64,
    /// Frames a second; a GIF has at most 50 [default of a video: 30; of a GIF: 20].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=60))]
    pub(super) fps: Option<u16>,
    /// Width and height in pixels [default of a video: 1280x720; of a GIF: 640x360].
    #[arg(long)]
    pub(super) size: Option<Size>,
    #[command(flatten)]
    pub(super) shown: ShownArgs,
}

#[cfg(feature = "window")]
impl FilmArgs {
    /// The arguments of a film without options.
    pub(super) fn of_files(session: &Path, out: &Path) -> Result<Self, clap::Error> {
        let words = [OsStr::new("film"), OsStr::new("--"), session.as_os_str(), out.as_os_str()];
        Self::from_arg_matches(&Self::augment_args(Command::new("film")).try_get_matches_from(words)?)
    }
}
