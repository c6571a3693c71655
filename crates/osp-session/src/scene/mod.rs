//! The model: polygons with stable ids, strokes, groups with transforms; erase, move, undo and redo.
//!
//! [`Scene::apply`] takes one event, [`Scene::apply_all`] those of a frame, and says what changed as a list of
//! [`Change`](osp::polygon::Change)s; an index follows them. A polygon's id is its number in order of arrival and is never used twice.
//!
//! # Spaces
//! A stroke's points are in the space of its group, which is the world's while it is in none: who takes it into a group
//! that was placed takes it to that place. A [move](crate::recording::Event::Move) is given in world space, as the hand
//! saw it, and kept in the space of the stroke's group, turned and scaled back: when the group is placed again, what was
//! moved turns and scales with it.
//!
//! A group that is placed again and again can [move as a whole](Scene::keeping_groups_whole): one change then tells of the
//! group, not one of each polygon.
//!
//! # Memory
//! [Undo](Scene::UNDO_DEPTH) reaches a thousand edits back, everywhere the same, because it is part of what a recording
//! means. A stroke that was erased before that, or taken back and then drawn over, is gone: what an event says of it is
//! ignored, its number stays used, and [`Scene::let_go`] frees what it held.
//!
//! # Several authors
//! Undo and redo are [each author's own](crate::recording::Author): the model is what all edits that are not taken back come
//! to, in the order of the session. Moves add up, of groupings, placings and layers the last one counts, and a stroke is
//! erased as long as anybody has erased it. So nobody takes back what somebody else has done. When an author leaves, all the
//! author's edits are for good. Where groups would form a circle because a grouping was taken back, the later one
//! hangs nothing. An edit that undo does not reach any more counts as one before all others.
//!
//! A layer is open to all, unless its owner [closes](Scene::may_touch) it; it is open again when the owner leaves.
//!
//! Each author's undo has the limits of one author; together they remember at most 65,536 edits, which name at most four
//! million strokes: beyond, whoever has most loses the oldest.
//!
//! Depends on [`recording`](crate::recording), [`stroke`](crate::stroke) and [`polygon`](osp::polygon).

mod author_state;
mod authors;
mod edit;
mod editing;
mod geometry;
mod group;
mod hanging;
mod history;
mod layer_state;
mod layers;
mod log;
mod model;
mod pieces;
mod remembered;
mod solid;
mod spaces;
mod stroke;
mod tree;
mod undo;
mod used;

pub use author_state::AuthorInfo;
pub use layer_state::LayerState;
pub use model::{KnownView, Scene, SceneCounts, SceneWork};
pub use stroke::Stroke;
pub use tree::GroupNode;
