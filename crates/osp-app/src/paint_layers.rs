//! The layers of a session in the window, with their names and states. New strokes are drawn on the current layer.

use osp_session::recording::{Author, Paint};

/// A layer as the window shows it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LayerRow {
    /// Number of the layer.
    pub layer: u32,
    /// Name of the layer.
    pub name: String,
    /// Whether the layer's strokes are hidden.
    pub is_hidden: bool,
    /// Whether the layer's strokes can be neither selected nor erased.
    pub is_locked: bool,
    /// The layer's owner, by number and name, in a session of several authors.
    pub owner: Option<(Author, String)>,
    /// Whether only the owner may draw on the layer and change it.
    pub is_closed: bool,
}

/// A change of the layers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum LayerEdit {
    /// Create a layer and make it the current layer.
    New,
    /// Make a layer the current layer.
    Choose(u32),
    /// Name a layer.
    Name(u32, String),
    /// Hide or show the current layer.
    ToggleHidden,
    /// Lock or unlock the current layer.
    ToggleLocked,
    /// Hide or show a layer.
    Hide(u32, bool),
    /// Lock or unlock a layer.
    Lock(u32, bool),
    /// Close a layer of the user to all other authors, or open it.
    Close(u32, bool),
    /// Move the selected strokes to the current layer.
    TakeSelection,
}

/// An author's name, or the number if the name is empty.
pub(super) fn name_or_number(author: Author, name: &str) -> String {
    if name.trim().is_empty() { format!("author {author}") } else { name.to_owned() }
}

/// Sets the layer of a new stroke. A stroke without a brush gets an empty brush, which stores the layer.
pub(super) fn on_layer(paint: Option<Box<Paint>>, layer: u32) -> Option<Box<Paint>> {
    if layer == 0 {
        return paint;
    }
    let mut paint = paint.unwrap_or_else(|| Box::new(Paint::new("", 0)));
    paint.layer = layer;
    Some(paint)
}
