//! The film of `osp race --film`.

use std::io;

use anyhow::Context;

use super::{gif_file::GifFile, outputs::Output, progress, version};
use osp::view::View;
use osp_lab::{
    Machine,
    bench::{FilmError, Race, RaceFilm},
};
use osp_session::recording::{Event, RecordingError};

/// Duration of a film without the pause at its end, hundredths of a second.
const GROWING: usize = 1300;
/// Duration of the pause at the end of a film, hundredths of a second.
const END: u16 = 300;

/// Writes the film of a race. The film plays `events` and shows the model in `view`.
pub(super) fn write(
    output: &Output,
    race: &Race,
    view: View,
    events: impl Iterator<Item = Result<Event, RecordingError>>,
) -> anyhow::Result<()> {
    let film = RaceFilm::new(race, &Machine::here(version::COMMIT));
    let name = || output.path().display().to_string();
    anyhow::ensure!(film.frames() > 0, "{}: there is no frame to draw", name());
    let delay = (GROWING / film.frames()) as u16;
    let mut file = GifFile::begin(output.create()?, film.size()).with_context(name)?;
    let progress = progress::bar(film.frames() as u64, "frames", &name());
    let mut drawn = 0;
    let take = |rgb: &[u8]| -> io::Result<()> {
        drawn += 1;
        progress.inc(1);
        file.add(rgb, if drawn == film.frames() { delay + END } else { delay })
    };
    film.draw(view, events, take).map_err(|error| match error {
        // Unwraps the error, because the hint about a damaged session needs its type.
        FilmError::Recording(error) => error.into(),
        error => anyhow::Error::from(error).context(name()),
    })?;
    progress.finish_and_clear();
    output.commit(file.finish().with_context(name)?)?;
    Ok(())
}
