//! The formats of films.

use std::{io, num::NonZeroU32, path::Path};

use anyhow::{bail, ensure};

use super::{gif_file::GifFile, mp4_file::Mp4File, outputs::ending, parsers::Size};
use osp_render::Image;
use osp_session::atomic_file::{AtomicFile, Destination};

/// Additional time for which a film shows its last frame, seconds.
const END_S: u16 = 1;
/// Largest number of pictures a second in a GIF. Browsers show a faster GIF slowly.
const MOST_A_SECOND_IN_GIF: u16 = 50;
/// Limits of the long and the short side of a picture in a video, pixels. The encoder of H.264 sets them.
const MOST_SIDES: (u32, u32) = (3840, 2160);
/// Shortest side of a picture in a video, pixels: a block of H.264.
const LEAST_SIDE: u32 = 16;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FilmFormat {
    Gif,
    Mp4,
}

impl FilmFormat {
    /// Returns the format by the ending of the file's name. The format of a pipe without such an ending is GIF.
    pub(super) fn of(path: &Path) -> anyhow::Result<Self> {
        let is_file = matches!(Destination::of(path), Ok(Destination::File(_)));
        match ending(path).as_str() {
            "mp4" if !is_file => bail!("{}: a film in .mp4 is written to a file only", path.display()),
            "mp4" => Ok(Self::Mp4),
            "gif" => Ok(Self::Gif),
            _ if !is_file => Ok(Self::Gif),
            _ => bail!("{}: expected a name that ends in .mp4 or .gif", path.display()),
        }
    }

    /// Returns the size of the pictures, pixels: the requested one or the format's default, with even sides in a video.
    pub(super) fn size(self, asked: Option<Size>) -> anyhow::Result<(u32, u32)> {
        let asked = asked.map(|size| (size.width, size.height));
        if self == Self::Gif {
            return Ok(asked.unwrap_or((640, 360)));
        }
        let (width, height) = asked.unwrap_or((1280, 720));
        let even = (width.next_multiple_of(2), height.next_multiple_of(2));
        let (long, short) = (even.0.max(even.1), even.0.min(even.1));
        let (most_long, most_short) = MOST_SIDES;
        ensure!(
            long <= most_long && short <= most_short && short >= LEAST_SIDE,
            "--size {width}x{height}: a video has {LEAST_SIDE}x{LEAST_SIDE} to {most_long}x{most_short} pixels, also in portrait"
        );
        Ok(even)
    }

    pub(super) fn pictures_a_second(self, asked: Option<u16>) -> anyhow::Result<u16> {
        let rate = asked.unwrap_or(match self {
            Self::Gif => 20,
            Self::Mp4 => 30,
        });
        ensure!(
            self != Self::Gif || rate <= MOST_A_SECOND_IN_GIF,
            "--fps {rate}: a GIF shows at most {MOST_A_SECOND_IN_GIF} pictures a second; .mp4 allows more"
        );
        Ok(rate)
    }
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Times {
    pub(super) frames: u64,
    pub(super) fps: u16,
    /// Whether the film shows the last frame for [`END_S`] longer.
    pub(super) end_stays: bool,
}

impl Times {
    /// Returns the time for which the film shows a frame, in hundredths of a second. Rounding errors do not add up, so
    /// the mean frame rate is exact.
    fn delay(self, frame: u64) -> u16 {
        let at = |frame: u64| frame * 100 / u64::from(self.fps);
        (at(frame + 1) - at(frame)) as u16 + if self.is_end(frame) { END_S * 100 } else { 0 }
    }

    /// Returns the number of pictures for which the film shows a frame.
    fn pictures(self, frame: u64) -> u32 {
        1 + if self.is_end(frame) { u32::from(END_S * self.fps) } else { 0 }
    }

    fn is_end(self, frame: u64) -> bool {
        self.end_stays && frame + 1 == self.frames
    }
}

pub(super) enum FilmFile {
    Gif(Box<GifFile>, Times),
    Mp4(Box<Mp4File>, Times),
}

impl FilmFile {
    pub(super) fn begin(
        format: FilmFormat,
        file: AtomicFile,
        size: (u32, u32),
        times: Times,
    ) -> io::Result<Self> {
        let rate = NonZeroU32::try_from(u32::from(times.fps)).map_err(io::Error::other)?;
        Ok(match format {
            FilmFormat::Gif => Self::Gif(Box::new(GifFile::begin(file, size)?), times),
            FilmFormat::Mp4 => {
                let pictures = times.frames + u64::from(END_S * times.fps);
                Self::Mp4(Box::new(Mp4File::begin(file, size, rate, pictures)?), times)
            }
        })
    }

    pub(super) fn add(&mut self, image: &Image, frame: u64) -> io::Result<()> {
        match self {
            Self::Gif(film, times) => {
                let rgb: Vec<u8> =
                    image.rgba().chunks_exact(4).flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect();
                film.add(&rgb, times.delay(frame))
            }
            Self::Mp4(film, times) => film.add(image.rgba(), times.pictures(frame)),
        }
    }

    pub(super) fn finish(self) -> io::Result<AtomicFile> {
        match self {
            Self::Gif(film, _) => film.finish(),
            Self::Mp4(film, _) => film.finish(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rate_is_kept_where_it_does_not_divide_a_second() {
        for fps in [1, 7, 20, 24, 30, 50] {
            let times = Times { frames: u64::from(fps) * 3, fps, end_stays: true };
            let delays: Vec<u16> = (0..times.frames).map(|frame| times.delay(frame)).collect();
            assert_eq!(delays.iter().sum::<u16>(), 400, "{fps}");
            assert!(delays.iter().all(|delay| *delay >= 2), "{fps}: {delays:?}");
            let pictures: u32 = (0..times.frames).map(|frame| times.pictures(frame)).sum();
            assert_eq!(pictures, 4 * u32::from(fps), "{fps}");
        }
    }
}
