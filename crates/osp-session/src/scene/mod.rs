//! The model: polygons with stable ids, strokes, groups with transforms; erase, move, undo and redo.
//!
//! [`Scene::apply`] applies one event, and [`Scene::apply_all`] the events of a frame. Both list the
//! [`Change`](osp::polygon::Change)s for an index. Polygon ids are assigned in order of creation and never reused.
//!
//! # Spaces
//! A stroke's points are in the space of its group, or in world space without a group. The transform of a placed group
//! also moves a stroke that becomes a member. A [move](crate::recording::Event::Move) is a vector in world space. It is
//! converted to the space of the stroke's group and stored there. When the group is placed again, the translation
//! rotates and scales with the group.
//!
//! A group that is placed repeatedly can [move as a whole](Scene::keeping_groups_whole): a single change then reports
//! the whole group.
//!
//! # Memory
//! [Undo](Scene::UNDO_DEPTH) reaches a thousand edits back. The limit is constant, because the meaning of a recording
//! depends on it. An erased stroke that undo and redo no longer reach is gone. Events about it are ignored, its number
//! is never used again, and [`Scene::free_unreachable`] frees its memory.
//!
//! # Several authors
//! Each [author](crate::recording::Author) undoes and redoes only their own edits. The model results from all edits
//! that are not undone, in the order of the session. Moves add up. If a stroke or group has several groupings,
//! placements or layers, the last counts. A stroke is erased as long as any author's erasure of it is active. When an
//! author leaves, all edits of the author become permanent. If undoing a grouping would create a cycle of groups, the
//! later grouping sets no parent. A permanent edit precedes all others.
//!
//! A layer is open to all, unless its owner [closes](Scene::may_touch) it; it opens again when the owner leaves.
//!
//! The undo limits apply to each author. All authors together store at most 65,536 edits, which list at most four
//! million strokes. Beyond these limits, the author with the most edits or strokes can no longer undo their oldest
//! edit.
//!
//! Depends on [`recording`](crate::recording), [`stroke`](crate::stroke) and [`polygon`](osp::polygon).

mod authors;
mod edit;
mod editing;
mod geometry;
mod group;
mod history;
mod layers;
mod log;
mod model;
mod parents;
mod pieces;
mod solid;
mod spaces;
mod stroke;
mod tree;
mod undo;
mod used;

pub use authors::AuthorInfo;
pub use layers::LayerState;
pub use model::{KnownView, Scene, SceneCounts, SceneWork};
pub use stroke::Stroke;
pub use tree::GroupNode;
