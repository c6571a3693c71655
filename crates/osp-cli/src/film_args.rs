//! The arguments of `osp film`.

use std::path::PathBuf;

use clap::Args;

use super::{numbers, parsers::Size, reading::ReadArgs, render_args::MOMENT_S};
use osp_session::recording::Pace;

/// Film a session: a turn around the finished model, the model as it grows, or what its artist saw.
///
/// It draws what `osp render` draws, with all brushes, on the graphics adapter (one in software will do), and writes an
/// animated GIF.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  osp film sketch.tilt film.gif
  osp film recordings/portrait.ron grow.gif --path grow --seconds 6
  osp film painting.apa seen.gif --path recorded --size 480x270 --fps 15

Paths:
  turntable  once around the finished model, from the side that `osp render --camera whole` shows
  grow       the model as it was drawn, from where `osp render` sees it
  recorded   the model as it was drawn, by the recorded head path

With `grow` and `recorded` the session plays in --seconds, and its end stays for a second more.
A GIF has 256 colours a frame. For other kinds of video, let `osp render --every` write numbered
pictures: it prints the command of ffmpeg that makes an .mp4 of them.")]
pub(super) struct FilmArgs {
    /// The session, of any format that replay reads.
    pub(super) file: PathBuf,
    /// The film to write.
    #[arg(value_name = "OUT.gif")]
    pub(super) out: PathBuf,
    /// The way of the eye.
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
    /// Part of the session in a frame: `recorded` (by its time stamps) or `samples:N` (N samples of
    /// the hand). With `grow` and `recorded` the film shares them out evenly.
    #[arg(long, default_value = "samples:16")]
    pub(super) pace: Pace,
    /// The moment at which brushes which move by themselves begin, seconds; they move with the film.
    #[arg(long, default_value_t = MOMENT_S, value_parser = numbers::moment_s)]
    pub(super) time: f32,
    #[command(flatten)]
    pub(super) reading: ReadArgs,
    /// Let the film replace a file of another kind, but never the session.
    #[arg(long)]
    pub(super) force: bool,
}
