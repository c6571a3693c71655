//! The benchmarks of `osp bench`: sessions, growth to millions of polygons, a flight through the finished model, and
//! the experiments of the paper.
//!
//! All structures are measured in turns, frame by frame, in one process, so a disturbance of the machine affects all of
//! them. Ratios are computed per frame. Each benchmark returns [`crate::rows`]. Medians have an interval (see
//! [`crate::rows::Estimate`]). Times are accompanied by counts of work, which do not depend on the machine.

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
