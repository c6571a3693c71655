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
    /// Takes two points of the model, at the press and at the release.
    Span(Span),
}

impl Default for ToolChoice {
    fn default() -> Self {
        Self::Draw(Tool::Ribbon)
    }
}

/// Use of two picked points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Span {
    /// The distance between them.
    Distance,
    /// The box with the points in opposite corners: strokes in it are selected.
    Box,
    /// The sphere around the first point through the second: strokes in it are selected.
    Sphere,
}
