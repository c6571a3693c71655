use osp_session::recording::Tool;

/// The tool of the pointer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ToolChoice {
    /// Draws.
    Draw(Tool),
    /// Erases the strokes that it touches.
    Erase,
    /// Selects strokes and moves them.
    Select,
    /// Takes two points of the model, from where it is pressed to where it is let go.
    Span(Span),
}

impl Default for ToolChoice {
    fn default() -> Self {
        Self::Draw(Tool::Ribbon)
    }
}

/// What two picked points make.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Span {
    /// The distance between them.
    Distance,
    /// The box with both in opposite corners: strokes in it are selected.
    Box,
    /// The sphere around the first through the second: strokes in it are selected.
    Sphere,
}
