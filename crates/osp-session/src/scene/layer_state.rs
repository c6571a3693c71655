use crate::recording::Author;

/// Properties of a layer from events; absent ones are as in the session's header.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LayerState {
    /// Its name.
    pub name: Option<String>,
    /// Whether its strokes are not drawn.
    pub hidden: Option<bool>,
    /// Whether the window leaves its strokes alone.
    pub locked: Option<bool>,
    /// Its owner: the first author who changed it. After that author has left, the next author who closes it. The
    /// first layer (0) belongs to everybody.
    pub owner: Option<Author>,
}
