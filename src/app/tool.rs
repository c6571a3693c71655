use crate::recording::Tool;

/// The tool of the pointer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ToolChoice {
    /// Draws.
    Draw(Tool),
    /// Erases the strokes that it touches.
    Erase,
    /// Selects strokes and moves them.
    Select,
}
