//! The fast form of the octal space partition tree.
//!
//! Its origin is the OSP tree of the paper that [`osp_rivals::OspPaper`] follows to the letter: a cube divided ahead
//! of time, into which polygons are inserted one by one as they are drawn. What it keeps of it: the octal partition, its
//! preallocated levels, and insertion that never rebuilds.
//!
//! # Differences from the paper
//!
//! * A polygon that a split plane cuts is *not* kept at that plane's node. It goes by its centre to a cell of its own
//!   size, and the cell's tight box sticks out as far as it has to (a loose octree; Ulrich, 2000). Kept at the planes,
//!   a few per cent of all polygons would sit near the root and be tested in every frame.
//! * Three binary levels (X, Y, Z) are one step of eight.
//! * The unit in the tree is a *run*: polygons of one block of sixteen ids that lie side by side, as the pieces of a
//!   stroke do, with a tight box around them. The block being drawn is kept apart and inserted when the next begins.
//! * Nodes exist only where there is something. A leaf splits above 256 runs; its node collapses below 96. Until 256 runs exist,
//!   all stay in one root list. Only the *links* of the upper levels are preallocated, four bytes a cell, so a run finds its
//!   leaf without a descent.
//! * The root cube is no border: levels are added on top when something lies outside, and taken off again.
//! * Boxes are tested eight or sixteen at a time (children of a node, pages of a leaf, runs of a page, polygons of a
//!   run), each kind in rows that a wide register reads. Planes that a box has passed are not tested below it.
//! * If everything is inside the frustum, the ids are copied from the id map, and the tree is not read.
//! * If most is, the walk looks for what is hidden and takes it out of all ids: of what is seen, nothing is read (`plan.rs`).
//! * A leaf that is full is divided in shares of a frame (`divide.rs`).
//! * Leaves of polygons that arrive in no order are packed in the order of space, few in a frame (`order.rs`).
//! * While they rest, their ids lie once more in the order of the tree: a subtree in view is one copy (`rest.rs`).
//! * As long as there are few polygons, there is no tree: their boxes are a plain list in blocks of sixteen ids
//!   (`linear.rs`). They move to the tree all at once, which takes some microseconds, and back when most of them are erased.
//! * What moves in frame after frame is kept in flat rows beside the tree (`movers.rs`), and goes back when it has rested
//!   (`settle.rs`).
//! * Erasing is not in the paper. Here it clears a bit; boxes are made to fit again, and pages, leaves and nodes joined,
//!   in the commits that follow, as much as was erased.
//!
//! # Layout
//!
//! ```text
//! node: 8 boxes ─> node | leaf          straddlers: runs longer than the node's children
//! leaf: a chain of buckets              bucket: 16 boxes ─> 16 pages
//! page: 16 runs (first id and mask)     page boxes, apart: 16 boxes, one a run ─> store
//! store: the 16 exact boxes of a block of ids; a run of one polygon needs none
//! ids: block of 16 ids ─> where its runs are, and its store
//! ```

mod adjust;
mod announce;
mod answer;
mod divide;
mod file;
mod form;
mod grid;
mod heat;
mod ids;
mod index;
mod layout;
mod linear;
mod many_views;
mod movers;
mod movers_query;
mod open;
mod order;
mod pages;
mod pair_sets;
mod plan;
mod pool;
mod query;
mod ray;
mod remove;
mod rest;
mod settle;
mod spans;
mod thin;
mod tuning;
mod validate;
mod visit;

pub use index::Osp;
