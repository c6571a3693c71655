//! The fast form of the octal space partition tree.
//!
//! Its origin is the OSP tree of the paper that [`osp_rivals::OspPaper`] follows to the letter: a cube divided ahead of
//! time, into which polygons are inserted one by one as they are drawn. This form keeps the octal partition, its
//! preallocated levels, and insertion without rebuilds.
//!
//! # Differences from the paper
//!
//! * A polygon that a split plane cuts is *not* kept at that plane's node. Its centre selects a cell of its own size,
//!   and its tight box extends beyond the cell as far as needed (a loose octree; Ulrich, 2000). Kept at the planes, a
//!   few per cent of all polygons would lie near the root and be tested in every frame.
//! * Three binary levels (X, Y, Z) are one step of eight.
//! * The unit in the tree is a *run*: neighbouring polygons of one block of sixteen ids, such as pieces of a stroke,
//!   with a tight box around them. The block being drawn is kept apart, and inserted when the next block begins.
//! * Nodes exist only for cells with polygons. A leaf splits above 256 runs; its node collapses at 96 or fewer. Up to
//!   256 runs, all stay in one root list. Only the *links* of the upper levels are preallocated, four bytes a cell, so
//!   a run finds its leaf without a descent.
//! * The root cube is no border: levels are added on top when a polygon lies outside, and removed again.
//! * Boxes are tested eight or sixteen at a time: children of a node, pages of a leaf, runs of a page, polygons of a
//!   run. They are stored in rows that a wide register reads. A plane that a box has passed is not tested below it.
//! * If everything is inside the frustum, the ids are copied from the id map, and the tree is not read.
//! * If most of the tree is inside, the query finds the polygons outside and removes them from the set of all ids. It
//!   reads nothing of the parts that lie inside (`plan.rs`).
//! * A full leaf is divided over several commits (`divide.rs`).
//! * Leaves of polygons that arrive in no order are sorted along a space-filling curve, a few in each commit
//!   (`order.rs`).
//! * While such polygons rest, a second list has their ids in the order of the tree: a subtree in view is one copy
//!   (`rest.rs`).
//! * Few polygons need no tree: their boxes are a plain list in blocks of sixteen ids (`linear.rs`). The list becomes a
//!   tree when it is full, and the tree a list again when most polygons are erased (`form.rs`).
//! * Polygons that move in frame after frame are kept in flat rows beside the tree (`movers.rs`), and return to it when
//!   they have rested (`settle.rs`).
//! * The paper does not erase polygons. Here, erasing clears a bit. Later commits tighten boxes and join pages, leaves
//!   and nodes; the work is proportional to the number of erased polygons.
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
