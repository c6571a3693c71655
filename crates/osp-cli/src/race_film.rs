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

/// Time of the growing model, and of its end, in hundredths of a second.
const GROWING: usize = 1300;
const END: u16 = 300;

/// Writes the film of a race on these events, with this view of the model.
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
        // The error names the file, so that the hint about a damaged session can name it, too.
        FilmError::Recording(error) => error.into(),
        error => anyhow::Error::from(error).context(name()),
    })?;
    progress.finish_and_clear();
    output.commit(file.finish().with_context(name)?)?;
    Ok(())
}
