//! osp keeps a growing, hand-made 3D model drawable in real time: polygons stream in from a tracked hand, and every
//! frame files them into a spatial index without rebuilding it, and finds those that the view may see.
//!
//! # The way the data flows
//!
//! ```text
//! recording ──> stroke ──> scene ──> index ──> visibility
//!  events       ribbons    polygons   OSP or    views, cameras,
//!  (RON lines,  walls      strokes,   a rival   the frame
//!   importers)  tubes      erase/undo              └──> metrics ──> report
//! ```
//!
//! A later module knows the earlier ones, never the other way round; [`math`] is below them all, [`metrics`] serves
//! [`visibility`]. The program sits on top.
//!
//! # Vocabulary
//!
//! *Session*: one sitting of drawing; a *recording* is its file, an *event* one line of it. *Stroke*: what the hand
//! draws between press and release, through *control points* (samples). *Polygon*: convex and planar, three or four
//! corners; a twisted quad is two triangles. *Index*: a spatial structure of *nodes*. *View*: an *eye* and what its
//! *screen* shows. *Draw list*: the polygons that a frame has to draw. *Fingerprint*: a number for a visible set.
//!
//! World space is right-handed, +y up, -z forward, in metres; names carry units and spaces.
//!
//! # Guarantees
//!
//! * **Conservative.** A query may report too much, never too little; "cannot decide" means visible.
//! * **Each id once.** A query reports every polygon at most once.
//! * **Nothing is lost.** Polygons outside the root cube, over-sized or coincident are kept and found. A recording
//!   that is cut off replays up to the cut.
//! * **Deterministic.** Same recording, same settings: the same fingerprint of every frame on every machine. Every
//!   box test is the same `f32` expression (see [`math`]), so all indexes agree bit for bit.
//! * **Errors** name the file, the line or byte, and what was expected. No input makes the library panic.
//!
//! # References
//!
//! * "A Study on the Real Time Culling of Infinite Sets of Geometries Using OSP Tree": the octal space partition tree.

pub use glam;

#[cfg(feature = "window")]
pub mod app;
#[cfg(any(feature = "formats", feature = "render"))]
pub mod atomic_file;
#[cfg(feature = "cli")]
pub mod bench;
#[cfg(feature = "cli")]
pub mod cli;
#[cfg(feature = "formats")]
pub mod export;
pub mod index;
pub mod math;
pub mod metrics;
pub mod occlusion;
#[cfg(any(feature = "cli", feature = "window"))]
#[cfg_attr(not(feature = "cli"), expect(dead_code, reason = "the window writes models alone"))]
mod output_file;
pub mod polygon;
pub mod recording;
#[cfg(feature = "render")]
pub mod render;
#[cfg(feature = "cli")]
pub mod report;
pub mod scene;
mod small_file;
pub mod stroke;
pub mod visibility;

#[cfg(all(doctest, feature = "cli"))]
#[doc = include_str!("../README.md")]
struct ReadmeExample;
