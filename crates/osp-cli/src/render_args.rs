//! The arguments of `osp render`, `osp film` and `osp thumbs`.

#[cfg(feature = "window")]
use std::{ffi::OsStr, path::Path};
use std::{path::PathBuf, str::FromStr};

use clap::{
    Args,
    builder::{PossibleValuesParser, TypedValueParser},
};
#[cfg(feature = "window")]
use clap::{Command, FromArgMatches};

use super::{
    numbers,
    outputs::ForceArgs,
    parsers::{Size, index_parser, occlusion_parser},
    played::FrameChoice,
    reading::ReadArgs,
    rig_args::RigPathArgs,
};
use osp_lab::Method;
#[cfg(feature = "render")]
use osp_render::{Image, Offscreen, Renderer, linear_from_srgb};
use osp_rivals::IndexKind;
use osp_session::{
    recording::{Camera, Pace},
    replay::CameraChoice,
};

/// Names of the sorting methods of the painter's algorithm.
const PAINTERS: [&str; 2] = ["bsp", "centre"];
/// Names of the drawing orders of opaque polygons, then the name for all of them.
const ORDERS: [&str; 6] = ["none", "front-to-back", "back-to-front", "material", "z-prepass", "all"];

/// Default time of animated brushes, seconds after their beginning.
pub(super) const MOMENT_S: f32 = 11.5;

/// Draw frames of a session to PNG files, without a window.
///
/// The command plays the session up to the frame like `osp replay`, culls by the index, and draws the remaining
/// polygons on the graphics adapter. A software adapter suffices.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  osp render recordings/portrait.ron portrait.png
  osp render sketch.tilt --frame 120 --camera orbit --size 1920x1080 sketch.png
  osp render sketch.tilt s.png --view '(p:(0,1.6,3),q:(0,0,0,1),fov_degrees:60)'
  osp render painting.apa --every 30 --to frames/
  osp render portrait.ron --every 50 --to frames/ --occlusion msvbsp --check
  osp render sketch.tilt sketch.png --occlusion hzb --check
  osp render recordings/room.ron room.png --painter bsp --check
  osp render sketch.tilt sketch.png --order all
  osp render recordings/class.ron class.png --color-by authors
  osp render room.ron room.png --rig dual-wall --stereo mono --camera recorded

With --rig osp writes a picture for each screen and eye: room-front-right-eye.png is the picture on the screen \
`front` for the right eye. --size gives the height; the width follows from the screen. The tracked head is at the \
camera's eye.

With --occlusion hzb osp draws each picture twice, as two frames of a camera at rest. The printed times and counts \
are those of the second frame. --check compares both frames with the picture without culling. With --every, hzb \
starts from the visible polygons of the preceding picture.
Both pictures that --painter compares show every polygon solid, in its plain colour.
A pixel that differs is unexplained if its colour is not between the colours of the 3 x 3 pixels around the same \
position in the other picture. Differences at edges of polygons are explained.
`osp replay --help` describes the indexes and the methods of occlusion culling.")]
pub(super) struct RenderArgs {
    /// The session: .ron, .ron.zst, .tilt, .apa, CASSIE .json, .poses, .obj, .obj.gz, .glb or .gltf.
    pub(super) file: PathBuf,
    /// The picture to write.
    #[arg(value_name = "OUT.png", required_unless_present_any = ["to", "every"])]
    pub(super) out: Option<PathBuf>,
    /// The frame to draw: its number from 0, or `last`.
    #[arg(long, default_value = "last", conflicts_with = "every")]
    pub(super) frame: FrameChoice,
    /// Draw every Nth frame and the last frame, into the folder --to.
    #[arg(long, value_name = "N", requires = "to", conflicts_with = "out", value_parser = clap::value_parser!(u64).range(1..))]
    pub(super) every: Option<u64>,
    /// The folder for the pictures of --every. The command makes it if it does not exist.
    #[arg(long, value_name = "DIR", requires = "every")]
    pub(super) to: Option<PathBuf>,
    /// Width and height in pixels.
    #[arg(long, default_value = "1280x720")]
    pub(super) size: Size,
    /// The index that finds the polygons in view.
    #[arg(long, default_value = "osp", value_parser = index_parser())]
    pub(super) index: IndexKind,
    /// Also cull hidden polygons by this method.
    #[arg(long, default_value = "none", value_parser = occlusion_parser())]
    pub(super) occlusion: Method,
    /// Draw each frame a second time without culling; the exit code is 1 if a pixel differs.
    #[arg(long)]
    pub(super) check: bool,
    /// Draw by the painter's algorithm: polygons in view from back to front, without a depth test. `bsp` finds the
    /// order by a BSP tree, and cuts polygons that have no order; `centre` sorts by the distance of their centres. The
    /// command compares the picture with one that is drawn with a depth buffer. With --check, the exit code is 1 if
    /// more than one pixel in 10,000 is unexplained (see below).
    #[arg(long, value_name = "ORDER", conflicts_with = "rig", value_parser = PAINTERS)]
    pub(super) painter: Option<String>,
    /// Also draw each frame with its opaque polygons in other orders, separated by commas, and print a table of their
    /// costs. The table has the time of drawing, overdraw, draw calls and changes of material. The picture uses the
    /// first order. `none` is the renderer's own order, by polygon number.
    #[arg(long, value_delimiter = ',', value_parser = ORDERS)]
    #[arg(conflicts_with_all = ["painter", "check", "rig"])]
    pub(super) order: Vec<String>,
    /// Number of measured rounds of --order. Each round draws every order. An additional first round is not measured.
    #[arg(long, value_name = "N", requires = "order", default_value_t = 9, value_parser = clap::value_parser!(u16).range(1..))]
    pub(super) repeats: u16,
    /// Print the figures of --order as JSON, one object for each frame.
    #[arg(long, requires = "order")]
    pub(super) json: bool,
    /// Position of the eye. `own` is the session's own camera (for a sketch, the camera of its thumbnail), else
    /// `whole`. `whole` shows the whole model except distant strays, from the side of the session's own camera, else
    /// from the first position of the artist. `recorded` is what other commands call `auto`: the recorded head path,
    /// else the session's own camera, else `orbit`. `orbit` circles around the model, `follow` is behind the hand,
    /// `inside` turns in the middle of the model.
    #[arg(long, default_value = "own", value_parser = camera_parser())]
    pub(super) camera: RenderCamera,
    /// Position of the eye, in place of --camera, in the form of a recording's header: `(p: (x, y, z), q: (x, y, z, w),
    /// fov_degrees: 60)` gives the eye in metres, the rotation from view to world, and the vertical field of view.
    #[arg(long, conflicts_with = "camera")]
    pub(super) view: Option<Camera>,
    /// Colour strokes with their own paint (`own`), or by author (`authors`, which `osp info` lists).
    #[arg(long, value_name = "WHOSE", default_value = "own", value_parser = ["own", "authors"], conflicts_with_all = ["painter", "order"])]
    pub(super) color_by: String,
    #[command(flatten)]
    pub(super) shown: ShownArgs,
    #[command(flatten)]
    pub(super) rig: RigPathArgs,
}

/// Options for reading a session of which pictures or films are made.
#[derive(Args, Debug)]
pub(super) struct ShownArgs {
    /// Part of the session that each frame plays. `recorded`: up to the time of the frame, by the recorded time stamps.
    /// `samples:N`: the next N hand samples.
    #[arg(long, default_value = "samples:16")]
    pub(super) pace: Pace,
    /// Time at which animated brushes are shown, seconds after the beginning.
    #[arg(long, default_value_t = MOMENT_S, value_parser = numbers::moment_s)]
    pub(super) time: f32,
    /// Colour behind the model, as #rrggbb, or `transparent` (not in films) [default: the sky of the session, else dark, or
    /// light behind dark models].
    #[arg(long, value_name = "COLOR")]
    pub(super) background: Option<Background>,
    #[command(flatten)]
    pub(super) reading: ReadArgs,
    #[command(flatten)]
    pub(super) force: ForceArgs,
}

/// The background of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Background {
    Transparent,
    /// sRGB.
    Color([u8; 3]),
}

impl FromStr for Background {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "transparent" {
            return Ok(Self::Transparent);
        }
        let digits = text.strip_prefix('#').unwrap_or(text);
        let number = u32::from_str_radix(digits, 16).ok().filter(|_| digits.len() == 6);
        let [_, r, g, b] = number.ok_or("expected #rrggbb or transparent")?.to_be_bytes();
        Ok(Self::Color([r, g, b]))
    }
}

#[cfg(feature = "render")]
impl Background {
    /// Applies a colour to a renderer.
    pub(super) fn apply(self, renderer: &mut Renderer) {
        renderer.hide_sky();
        if let Self::Color(color) = self {
            renderer.set_background(color.map(|c| linear_from_srgb(f64::from(c) / 255.0)));
        }
    }

    /// The picture that `draw` draws, with a transparent background if that is asked for.
    pub(super) fn image<T>(
        of: Option<Self>,
        drawer: &mut Offscreen,
        mut draw: impl FnMut(&mut Offscreen) -> anyhow::Result<(Image, T)>,
    ) -> anyhow::Result<(Image, T)> {
        if of != Some(Self::Transparent) {
            return draw(drawer);
        }
        drawer.renderer.set_background([0.0; 3]);
        let (black, _) = draw(drawer)?;
        drawer.renderer.set_background([1.0; 3]);
        let (white, times) = draw(drawer)?;
        Ok((Image::cut_out(&black, &white), times))
    }
}

/// Position of the eye in a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum RenderCamera {
    /// The session's camera, else the same as `Whole`.
    Own,
    /// A position from which the eye sees the whole model.
    Whole,
    /// The same as in a replay.
    Path(CameraChoice),
}

fn camera_parser() -> impl TypedValueParser<Value = RenderCamera> {
    PossibleValuesParser::new(["own", "whole", "recorded", "orbit", "follow", "inside"]).try_map(|name| {
        match name.as_str() {
            "own" => Ok(RenderCamera::Own),
            "whole" => Ok(RenderCamera::Whole),
            "recorded" => Ok(RenderCamera::Path(CameraChoice::Auto)),
            name => {
                let found = CameraChoice::ALL.iter().find(|choice| choice.name() == name);
                found
                    .map(|choice| RenderCamera::Path(*choice))
                    .ok_or_else(|| format!("no camera is called {name}"))
            }
        }
    })
}

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
    /// Colour behind the model, as #rrggbb, or `transparent` [default: the sky of the session, else dark, or light behind
    /// dark models].
    #[arg(long, value_name = "COLOR")]
    pub(super) background: Option<Background>,
    #[command(flatten)]
    pub(super) force: ForceArgs,
    #[command(flatten)]
    pub(super) reading: ReadArgs,
}

#[cfg(all(test, feature = "render"))]
mod tests {
    use super::*;
    use osp_render::{OpaqueOrder, Painter};

    #[test]
    fn the_names_are_those_of_the_painters_and_orders() {
        assert!(Painter::ALL.map(Painter::name) == PAINTERS);
        assert!(OpaqueOrder::ALL.map(OpaqueOrder::name) == ORDERS[..5]);
        assert!(ORDERS[5] == "all");
    }
}
