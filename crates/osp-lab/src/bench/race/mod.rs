//! A race: structures get the same frames of one session in turns. It shows which of them keep up with a headset.

mod racer;
mod report;
mod run;

pub use racer::Racer;
pub use report::RaceReport;
pub use run::{Race, RaceError, RaceInput, race};
