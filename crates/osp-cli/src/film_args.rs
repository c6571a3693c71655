//! The arguments of `osp film`.

use std::path::PathBuf;

use clap::Args;

use super::{numbers, parsers::Size, render_args::ShownArgs};

/// Film a session: a turn around the finished model, the growing model, or the artist's own view.
///
/// The command draws the same pictures as `osp render`, with all brushes, on the graphics adapter (a software adapter
/// suffices). The result is an animated GIF.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  osp film sketch.tilt film.gif
  osp film recordings/portrait.ron grow.gif --path grow --seconds 6
  osp film painting.apa seen.gif --path recorded --size 480x270 --fps 15

Paths:
  turntable  once around the finished model, from the side that `osp render --camera whole` shows
  grow       the model as it was drawn, from where `osp render` sees it
  recorded   the model as it was drawn, by the recorded head path

With `grow` and `recorded` the session plays in --seconds, its frames (--pace) shared out evenly, and
its end stays for a second more. Brushes that move by themselves begin at --time and move with the film.
A GIF has 256 colours a frame. For other kinds of video, let `osp render --every` write numbered
pictures: it prints the command of ffmpeg that makes an .mp4 of them.")]
pub(super) struct FilmArgs {
    /// The session, of any format that replay reads.
    pub(super) file: PathBuf,
    /// The film to write.
    #[arg(value_name = "OUT.gif")]
    pub(super) out: PathBuf,
    /// Path of the eye.
    #[arg(long, default_value = "turntable", value_parser = ["turntable", "grow", "recorded"])]
    pub(super) path: String,
    /// Length of the film, seconds.
    #[arg(long, value_name = "S", default_value_t = 10.0, value_parser = numbers::film_s)]
    pub(super) seconds: f64,
    /// Frames a second; browsers show at most 50.
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = clap::value_parser!(u16).range(1..=50))]
    pub(super) fps: u16,
    /// Width and height in pixels.
    #[arg(long, default_value = "640x360")]
    pub(super) size: Size,
    #[command(flatten)]
    pub(super) shown: ShownArgs,
}
