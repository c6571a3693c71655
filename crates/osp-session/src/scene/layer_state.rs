use crate::recording::Author;

/// Properties of a layer from events; all others are those of the session's header.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LayerState {
    /// Its name.
    pub name: Option<String>,
    /// Whether its strokes are not drawn.
    pub hidden: Option<bool>,
    /// Whether its strokes are to be left alone.
    pub locked: Option<bool>,
    /// Its owner: the first author who changed it, or who has closed it since the first one left. The first layer (0)
    /// is everybody's.
    pub owner: Option<Author>,
}
