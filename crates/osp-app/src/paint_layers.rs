//! The layers of a session in the window: named, hidden, locked; one of them is drawn on.

use osp_session::recording::{Author, Paint};

/// A layer as the window shows it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LayerRow {
    /// Its number.
    pub layer: u32,
    /// Its name.
    pub name: String,
    /// Whether its strokes are not drawn.
    pub is_hidden: bool,
    /// Whether its strokes are neither selected nor erased.
    pub is_locked: bool,
    /// Its owner, by number and name, in a session of several authors.
    pub owner: Option<(Author, String)>,
    /// Only its owner may draw on it and change it.
    pub is_closed: bool,
}

/// Change of the layers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum LayerEdit {
    /// Make another one, and draw on it.
    New,
    /// Draw on it.
    Choose(u32),
    /// Give it a name.
    Name(u32, String),
    /// Hide the current one, or show it.
    ToggleHidden,
    /// Lock the current one, or unlock it.
    ToggleLocked,
    /// Hide it, or show it.
    Hide(u32, bool),
    /// Lock it, or unlock it.
    Lock(u32, bool),
    /// Close an own one to all other authors, or open it.
    Close(u32, bool),
    /// Bring the selection to the current one.
    TakeSelection,
}

/// An author's name, or the number if there is no name.
pub(super) fn name_or_number(author: Author, name: &str) -> String {
    if name.trim().is_empty() { format!("author {author}") } else { name.to_owned() }
}

/// The layer of a new stroke: a stroke without a brush gets an empty brush on this layer.
pub(super) fn on_layer(paint: Option<Box<Paint>>, layer: u32) -> Option<Box<Paint>> {
    if layer == 0 {
        return paint;
    }
    let mut paint = paint.unwrap_or_else(|| Box::new(Paint::new("", 0)));
    paint.layer = layer;
    Some(paint)
}
