//! The maker of films, which the program gives to the window.

use std::{io, path::Path};

use crate::{
    studio::Studio,
    working::{Done, Exported, Kind, Progress, Whole},
};
use osp_session::export::ExportError;

/// Writes a film of the session in the first file to the second file, and returns a line for the user. Calls its last
/// argument with the number of finished pictures, and ends without a film once this call returns `false`.
pub type MakeFilm = fn(&Path, &Path, &dyn Fn(u64) -> bool) -> Result<String, String>;

/// The program's maker of films, which needs encoders that the window lacks.
#[derive(Clone, Copy, Debug)]
pub struct FilmMaker {
    pub pictures: fn(&Path) -> u64,
    pub make: MakeFilm,
}

impl Studio {
    /// Sets the maker of films. Without it the window makes no films.
    pub fn set_film_maker(&mut self, maker: FilmMaker) {
        self.work.film_maker = Some(maker);
    }

    pub fn makes_films(&self) -> bool {
        self.work.film_maker.is_some()
    }

    pub(super) fn export_film(&mut self, path: &Path) {
        self.finish_gestures();
        self.apply_events();
        let Some(FilmMaker { pictures, make }) = self.work.film_maker else {
            self.report_file(Err(format!("{}: this program makes no films", path.display())));
            return;
        };
        let replayed = || self.session.is_replay().then(|| self.session.path());
        let Some(file) = self.session.file_to_play().or_else(replayed).map(Path::to_owned) else {
            self.report_file(Err("a film needs a session in a file: save it first".to_owned()));
            return;
        };
        let what = format!("writing {}", path.display());
        let kind = Kind::Filming { count: pictures(path) };
        let path = path.to_owned();
        let work = move |progress: &Progress| {
            let made = make(&file, &path, &|done| progress.note(done));
            let outcome =
                made.map(Exported::Film).map_err(|error| ExportError::from(io::Error::other(error)));
            Done::Exported { path, outcome }
        };
        self.start(what, kind, Box::new(Whole::new(work)));
    }
}
