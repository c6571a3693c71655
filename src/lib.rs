//! osp keeps a growing, hand-made 3D model drawable in real time.
//!
//! # The way the data flows
//!
//! ```text
//! recording ──> stroke ──> scene ──> index ──> visibility
//!  events       ribbons    polygons   OSP or    frustum, occlusion
//!  (RON lines,  polygons   strokes,   a rival      │
//!   importers)             erase/undo              └──> metrics ──> report
//! ```
//!
//! A later module knows the earlier ones, never the other way round.

pub mod index;
pub mod math;
pub mod metrics;
pub mod recording;
pub mod scene;
pub mod stroke;
pub mod visibility;
