//! The model: polygons with stable ids, strokes, groups with transforms; erase, move, undo and redo.
//!
//! [`Scene::apply`] takes one event, [`Scene::apply_all`] those of a frame. Both list the
//! [`Change`](osp::polygon::Change)s, which an index follows. A polygon's id is its number in order of arrival and is
//! never used twice.
//!
//! # Spaces
//! A stroke's points are in the space of its group, or in world space without a group: a stroke that joins a placed
//! group moves with that group's transform. A [move](crate::recording::Event::Move) is given in world space and stored
//! in the space of the stroke's group, turned and scaled back. When the group is placed again, the motion turns and
//! scales with it.
//!
//! A group that is placed again and again can [move as a whole](Scene::keeping_groups_whole): then one change stands
//! for the group, instead of one for each polygon.
//!
//! # Memory
//! [Undo](Scene::UNDO_DEPTH) reaches a thousand edits back. The limit is the same everywhere, because the meaning of a
//! recording depends on it. A stroke out of reach of undo and redo is gone: events about it are ignored, its number
//! stays used, and [`Scene::let_go`] frees its memory.
//!
//! # Several authors
//! Undo and redo are [each author's own](crate::recording::Author): the model results from all edits that are not
//! undone, in the order of the session. Moves add up. The last grouping, placing or layer of a stroke or group counts.
//! A stroke is erased as long as an author's erasure of it is active. So nobody undoes another author's edit. When an
//! author leaves, all the author's edits are for good. If undoing a grouping would make groups form a circle, the
//! later grouping sets no parent. An edit out of reach of undo counts as one before all others.
//!
//! A layer is open to all, unless its owner [closes](Scene::may_touch) it; it opens again when the owner leaves.
//!
//! Each author's undo has the limits of one author. Together they store at most 65,536 edits, which name at most four
//! million strokes. Beyond that, the author with the most loses the oldest.
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
