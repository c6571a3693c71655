//! The comparison of structures that `osp bench` prints: sessions, growth to millions of polygons, and a flight through
//! the finished model; and the experiments of the paper.
//!
//! All structures are measured in turns, frame by frame, in one process, and each harness gives [`crate::rows`]. Disturbances of
//! the machine affect all of them alike, and ratios are taken within a frame. Medians come with an interval (see
//! [`crate::rows::Estimate`]), times with counts of work, which do not depend on the machine.

mod curves;
mod flight;
mod growth;
mod moving;
mod page;
mod paper;
mod race;
mod rays;
mod report;
mod session;

pub use crate::contender::Contender;
pub use crate::machine::Machine;
pub use flight::fly;
pub use growth::{GrowthConfig, grow};
pub use moving::{MovingConfig, move_things};
pub use page::page;
pub use paper::{Adapter, PaperConfig, PaperError, PaperInput, run_paper};
pub use race::{FilmError, Race, RaceError, RaceFilm, RaceInput, RaceReport, RaceRun, Racer, race};
pub use rays::{RaysConfig, RaysModel, cast_rays};
pub use report::{BenchReport, Length};
pub use session::{SessionInput, run_session};
