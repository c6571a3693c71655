use crate::recording::Author;

/// What events have said of a layer; what they have not is as the session's header says.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LayerState {
    /// Its name.
    pub name: Option<String>,
    /// Whether its strokes are not drawn.
    pub hidden: Option<bool>,
    /// Whether its strokes are to be left alone.
    pub locked: Option<bool>,
    /// Whose it is: who said something of it first, or who has closed it since that one left. The first layer (0) is
    /// everybody's.
    pub owner: Option<Author>,
}
