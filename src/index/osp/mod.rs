//! The fast form of the octal space partition tree.
//!
//! It derives from the OSP tree of the paper, which `osp_rivals::OspPaper` implements exactly: a cube is divided ahead
//! of time, and polygons are inserted one by one as they are drawn. This form keeps the octal partition, its
//! preallocated levels, and insertion without rebuilds.
//!
//! # Differences from the paper
//!
//! * A polygon that a split plane cuts is *not* kept at that plane's node. Its centre selects a cell of its own size, and
//!   its tight box extends beyond the cell as far as needed (a loose octree; Ulrich, 2000). In the paper's tree, planes
//!   near the root hold a few per cent of all polygons, which are tested in every frame.
//! * One level with eight children replaces three binary levels (X, Y, Z).
//! * The unit in the tree is a *run*: neighbouring polygons of one block of sixteen ids, such as pieces of a stroke,
//!   with a tight box around them. The *lane* of an id is its position in its block, `id % 16`. The block that is being
//!   drawn is kept outside the tree until the next block begins.
//! * Nodes exist only for cells with polygons. A leaf splits if it has more than 256 runs; its node becomes a leaf again at
//!   96 or fewer. A tree of up to 256 runs is a list at the root. Only the *links* of the upper levels are preallocated,
//!   four bytes a cell, so a run finds its leaf without a descent.
//! * The root cube is no limit: levels are added on top if a polygon lies outside, and removed together with it.
//! * Boxes are tested eight or sixteen at a time: children of a node, pages of a leaf, runs of a page, polygons of a run.
//!   Boxes are stored in rows that a SIMD register loads. A plane is not tested below a box that lies on its inner side.
//! * If all polygons are inside the frustum, the ids are copied from the id map, and the tree is not read.
//! * If most of the tree is inside, the query finds the polygons outside and removes them from the set of all ids. It does
//!   not read the parts that lie inside (`plan.rs`).
//! * A full leaf is divided over several commits (`divide.rs`).
//! * Leaves of polygons that are inserted in no order are sorted along a space-filling curve, a few in each commit
//!   (`order.rs`).
//! * Few polygons need no tree: their boxes are a plain list in blocks of sixteen ids (`linear.rs`). The list becomes a
//!   tree when it is full, and the tree a list again when most polygons are erased (`form.rs`).
//! * Polygons that move in frame after frame are kept in flat rows outside the tree (`movers.rs`). They return to the
//!   tree when they have not moved for some commits (`settle.rs`). If many different polygons move, or come and go, in
//!   every frame, all polygons are kept there until few change (`churn.rs`, `to_rows.rs`).
//! * The paper does not erase polygons. Here, erasing clears a bit. Later commits tighten boxes and join pages, leaves
//!   and nodes; the work is proportional to the number of erased polygons.
//!
//! # Files
//!
//! * Insert: `index.rs` (entry), `open.rs` (the block being drawn), `ids.rs`, `insert.rs` (to a leaf), `grid.rs`;
//!   `linear.rs`, `block_table.rs` and `form.rs` for few polygons; `announce.rs` prefetches.
//! * Move: `adjust.rs`, `movers.rs`, `groups.rs`, `slots.rs`, `heat.rs`, `churn.rs`, `to_rows.rs`. Remove: `remove.rs`.
//! * Commit, in this order: `to_rows.rs` (counts edits), `settle.rs`, then `linear.rs` for a list, or `remove.rs` (upkeep),
//!   `divide.rs`, `order.rs` for a tree.
//! * Query: `plan.rs` chooses the method, `query.rs` traverses the tree, `two_eyes.rs` traverses it once for two eyes,
//!   `answer.rs` writes the result; `movers_query.rs`, `visit.rs`, `ray.rs`. Then `thin.rs` removes hidden polygons.
//! * Creation: `warm.rs` loads the code of later frames.
//! * Storage: `layout.rs`, `pool.rs`, `pages.rs`, `rows.rs`, `pair_sets.rs`. `tuning.rs` has the constants,
//!   `validate.rs` checks all invariants.
//!
//! # Layout
//!
//! ```text
//! node: 8 boxes ─> node | leaf          straddlers: runs longer than the node's children
//! leaf: a chain of buckets              bucket: 16 boxes ─> 16 pages
//! page: 16 runs (first id and mask)     page boxes, stored separately: a box for each run ─> store
//! store: the 16 exact boxes of a block of ids; a run of one polygon needs none
//! ids: block of 16 ids ─> the pages of its runs, and its store
//! ```

mod adjust;
mod announce;
mod answer;
mod block_table;
mod churn;
mod divide;
mod form;
mod grid;
mod groups;
mod heat;
mod ids;
mod index;
mod insert;
mod layout;
mod linear;
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
mod rows;
mod settle;
mod slots;
mod thin;
mod to_rows;
mod tuning;
mod two_eyes;
mod validate;
mod visit;
mod warm;

pub use index::Osp;
