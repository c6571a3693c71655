//! Where osp is judged: slow and exact references, benchmarks, reports.
//!
//! [`oracle`] finds the visible polygons, [`verify`] compares culling with it, [`scenes`] are models for that, [`literal`] is
//! what the paper says where that is wrong, [`pvs`] samples potentially visible sets, [`mod@bench`] measures structures against
//! each other (feature `bench`), [`report`] makes tables, pages and charts. It knows all crates but those of the network, the window and the program.

#[cfg(feature = "bench")]
pub mod bench;
#[cfg(feature = "report")]
#[cfg_attr(not(feature = "bench"), allow(dead_code, reason = "only benchmarks repeat what they measure"))]
mod clock;
mod contender;
pub mod literal;
#[cfg(feature = "report")]
mod machine;
pub mod oracle;
pub mod pvs;
mod reach;
#[cfg(feature = "report")]
pub mod report;
pub mod scenes;
pub mod verify;

pub use contender::Contender;
#[cfg(feature = "report")]
pub use machine::Machine;
pub use reach::{Reach, lost_polygons};
