//! The model: polygons with stable ids, strokes, groups with transforms; erase, move, undo and redo.
//!
//! [`Scene::apply`] takes one event and says what it changed as a list of [`Change`]s; an index follows them. A
//! polygon's id is its number in order of arrival and is never used twice.

mod edit;
mod group;
mod model;
mod paged;

pub use model::{Change, PolygonId, Scene, SceneCounts, Stroke};
pub use paged::Paged;
