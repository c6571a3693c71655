use crate::recording::Author;

/// Properties of a layer that events have set. Properties that are `None` are those of the session's header.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LayerState {
    pub name: Option<String>,
    pub hidden: Option<bool>,
    /// Whether the window refuses to edit the layer's strokes.
    pub locked: Option<bool>,
    /// The layer's owner: the first author who changed it. After the owner has left, the next author who closes the
    /// layer becomes its owner. Layer 0 has no owner.
    pub owner: Option<Author>,
}
