//! The comparison of structures that `osp bench` prints: sessions, growth to millions of polygons, and a flight through
//! the finished model; and the experiments of the paper.
//!
//! All structures are measured in turns, frame by frame, in one process: what disturbs the machine disturbs
//! all of them alike, and ratios are taken within a frame. Medians come with an interval (see [`Estimate`]), times with counts
//! of work, which do not depend on the machine.

mod charts;
mod csv;
mod estimate;
mod flight;
mod grid;
mod growth;
mod moving;
mod page;
mod paper;
mod rays;
mod report;
mod session;
mod table;
mod verdict;

pub use crate::contender::Contender;
pub use crate::machine::Machine;
pub use estimate::Estimate;
pub use flight::{Flight, FlightFrame, fly};
pub use growth::{GrowthConfig, GrowthRow, Skipped, grow};
pub use moving::{MotionResult, MovingConfig, MovingResult, MovingRow, UpkeepRow, move_things};
pub use page::page;
pub use paper::{
    Adapter, CubeRow, FlightRow, GrowingRow, PaperConfig, PaperError, PaperInput, PaperResult, run_paper,
};
pub use rays::{Asked, MovedRow, RayRow, RaysConfig, RaysModel, RaysResult, Walked, cast_rays};
pub use report::BenchReport;
pub use session::{SessionInput, SessionResult, SessionRow, ViewsRow, run_session};
