//! Where osp is judged: references that are slow and exact, and what measures and reports.
//!
//! [`oracle`] says which polygons can be seen, [`verify`] compares culling with it, [`scenes`] are models to do that with,
//! [`literal`] is what the paper says where that is wrong, [`pvs`] finds by sampling what can be seen from where, [`mod@bench`] measures structures against each other, [`report`]
//! makes tables, pages and charts. Knows all but the window and the command line.

#[cfg(feature = "cli")]
pub mod bench;
pub mod literal;
pub mod oracle;
pub mod pvs;
mod reach;
#[cfg(feature = "cli")]
pub mod report;
pub mod scenes;
pub mod verify;

pub use reach::{Reach, lost_polygons};
