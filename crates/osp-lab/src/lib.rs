//! Where osp is judged: slow and exact references, benchmarks, reports.
//!
//! [`oracle`] finds the visible polygons, [`verify`] compares culling with it, [`scenes`] are models for that, [`literal`] is
//! what the paper says where that is wrong, [`pvs`] samples potentially visible sets, [`mod@bench`] measures structures against
//! each other (feature `bench`), [`report`] makes tables, pages and charts. It knows all crates but those of the network, the window and the program.

#[cfg(feature = "bench")]
pub mod bench;
pub mod literal;
pub mod oracle;
pub mod pvs;
mod reach;
#[cfg(feature = "bench")]
pub mod report;
pub mod scenes;
pub mod verify;

pub use reach::{Reach, lost_polygons};
