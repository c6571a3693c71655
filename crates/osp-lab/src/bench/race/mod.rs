//! A race: structures cull the same frames of one session in turns. It shows which structures reach the frame rate of a
//! headset.

mod film;
mod plot;
mod racer;
mod report;
mod run;

pub use film::{FilmError, RaceFilm};
pub use racer::Racer;
pub use report::RaceReport;
pub use run::{Race, RaceError, RaceInput, RaceRun, race};
