//! Slow and exact references, benchmarks and reports for osp.
//!
//! [`oracle`] finds the visible polygons. [`verify`] compares occlusion culling with the oracle on the models of
//! [`scenes`]. [`literal`] has the paper's rules that cull visible polygons. [`pvs`] samples potentially visible sets.
//! [`shadows`] has a view's tree of shadow volumes, plane by plane. [`outline`] searches along a ray in any structure's tree.
//! [`mod@bench`] compares structures (feature `bench`). [`report`] makes tables, pages and charts. This crate may
//! depend on all others except `osp-net`, `osp-app` and `osp-cli`.

#![allow(missing_docs, reason = "only this workspace uses the crate; many names need no comment")]

#[cfg(feature = "bench")]
pub mod bench;
#[cfg(feature = "report")]
#[cfg_attr(not(feature = "bench"), allow(dead_code, reason = "only benchmarks repeat what they measure"))]
mod clock;
mod contender;
pub mod literal;
#[cfg(feature = "report")]
mod machine;
mod method;
pub mod oracle;
pub mod outline;
pub mod pvs;
mod reach;
#[cfg(feature = "report")]
pub mod report;
#[cfg(feature = "report")]
pub mod rows;
pub mod scenes;
pub mod shadows;
mod tree_layout;
pub mod verify;
#[cfg(feature = "report")]
mod verify_rows;

pub use contender::Contender;
#[cfg(feature = "report")]
pub use machine::Machine;
pub use method::Method;
pub use reach::{Reach, lost_polygons};
pub use tree_layout::TreeLayout;
