//! The model: polygons with stable ids, strokes, groups with transforms; erase, move, undo and redo.
//!
//! [`Scene::apply`] applies one event, [`Scene::apply_all`] those of a frame. Both list the
//! [`Change`](osp::polygon::Change)s for an index. Polygon ids are assigned in order of creation and never reused.
//!
//! # Spaces
//! A stroke's points are in the space of its group, or in world space without a group: a stroke that joins a placed
//! group moves with that group's transform. A [move](crate::recording::Event::Move) is a vector in world space; it is
//! converted to the space of the stroke's group and stored there. When the group is placed again, the translation
//! rotates and scales with it.
//!
//! A group that is placed repeatedly can [move as a whole](Scene::keeping_groups_whole): then one change reports the
//! whole group, instead of one for each polygon.
//!
//! # Memory
//! [Undo](Scene::UNDO_DEPTH) reaches a thousand edits back. The limit is constant, because the meaning of a recording
//! depends on it. An erased stroke that undo and redo no longer reach is gone: events about it are ignored, its number
//! stays used, and [`Scene::free_unreachable`] frees its memory.
//!
//! # Several authors
//! Undo and redo are [each author's own](crate::recording::Author): the model results from all edits that are not
//! undone, in the order of the session. Moves add up. If a stroke or group has several groupings, placements or layers,
//! the last counts. A stroke is erased as long as any author's erasure of it is active. So no author undoes another
//! author's edit. When an author leaves, all edits of the author become permanent. If undoing a grouping would create a
//! cycle of groups, the later grouping sets no parent. A permanent edit precedes all others.
//!
//! A layer is open to all, unless its owner [closes](Scene::may_touch) it; it opens again when the owner leaves.
//!
//! The undo limits apply to each author. All authors together store at most 65,536 edits, which list at most four
//! million strokes. Beyond that, the author with the most loses the oldest.
//!
//! Depends on [`recording`](crate::recording), [`stroke`](crate::stroke) and [`polygon`](osp::polygon).

mod author_state;
mod authors;
mod edit;
mod editing;
mod geometry;
mod group;
mod history;
mod layer_state;
mod layers;
mod log;
mod model;
mod parents;
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
