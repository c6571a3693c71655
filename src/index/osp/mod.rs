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
//! * All boxes lie in a *store*, by id (`store.rs`): sixteen consecutive ids are a block, sixteen blocks a group, sixteen
//!   groups a shelf. The box around each of them lies beside it.
//! * A query walks the store in the order of the ids, if planes cut few groups (`in_order.rs`). Small models, drawn models
//!   and models in view are answered so. Otherwise the tree answers for the polygons that it holds, and the walk for the
//!   rest (`plan.rs`). Counted work decides, so the choice is the same on every machine.
//! * The unit in the tree is a *run*: neighbouring polygons of one block, such as pieces of a stroke, with a tight box
//!   around them (`runs.rs`). The *lane* of an id is its position in its block, `id % 16`.
//! * A polygon enters the tree when its block has not changed for some commits, and leaves it when it moves. If many
//!   polygons move, come and go in each frame, the tree stays empty until few do (`residence.rs`).
//! * Nodes exist only for cells with polygons. A leaf splits if it has more than 256 runs; its node becomes a leaf again at
//!   96 or fewer. Only the *links* of the upper levels are preallocated,
//!   four bytes a cell, so a run finds its leaf without a descent.
//! * The root cube is no limit: levels are added on top if a polygon lies outside, and removed together with it.
//! * Boxes are tested eight or sixteen at a time: children of a node, pages of a leaf, runs of a page, polygons of a run.
//!   Boxes are stored in rows that a SIMD register loads. A plane is not tested below a box that lies on its inner side.
//! * A full leaf is divided over several commits (`divide.rs`).
//! * Leaves of polygons that are inserted in no order are sorted along a space-filling curve, a few in each commit
//!   (`order.rs`).
//! * The paper does not erase polygons. Here, erasing clears a bit. Later commits tighten boxes and join pages, leaves
//!   and nodes; the work is proportional to the number of erased polygons.
//!
//! # Files
//!
//! * Insert, move, remove: `index.rs` (entry), `store.rs`, `store/insertion.rs`, `shelf.rs`,
//!   `unfiled.rs`.
//! * Commit: `residence.rs`, which files blocks (`runs.rs`, `insert.rs`, `grid.rs`) and takes polygons out (`remove.rs`);
//!   then `remove.rs` (upkeep), `divide.rs`, `order.rs`.
//! * Query: `plan.rs` chooses the method, `in_order.rs` walks the store, `query.rs` the tree, for one view or
//!   for two eyes, `answer.rs` writes the result; `ray.rs`; `visit.rs`, which also removes hidden polygons from a result.
//! * Creation: `warm.rs` loads the code of later frames.
//! * Storage of the tree: `layout.rs`, `pool.rs`. `tuning.rs` has the constants, `validate.rs`
//!   checks all invariants.
//!
//! # Layout
//!
//! ```text
//! shelf: 16 groups ─> 16 blocks ─> 16 exact boxes; masks: live, in the tree, moved; the places of the runs
//! node: 8 boxes ─> node | leaf          straddlers: runs longer than the node's children
//! leaf: a chain of buckets              bucket: 16 boxes ─> 16 pages
//! page: 16 runs (first id and mask)     page boxes, of the runs ─> boxes of the block
//! ```

mod answer;
mod divide;
mod grid;
mod in_order;
mod index;
mod insert;
mod layout;
mod order;
mod plan;
mod pool;
mod query;
mod ray;
mod remove;
mod residence;
mod runs;
mod shelf;
mod store;
mod tuning;
mod unfiled;
mod validate;
mod visit;
mod warm;

pub use index::Osp;
