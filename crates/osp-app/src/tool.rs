use osp_session::recording::Tool;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ToolChoice {
    /// Turns the camera and changes nothing. The panel of tools and the grid are hidden.
    Look,
    Draw(Tool),
    /// Erases the strokes that it touches.
    Erase,
    /// Selects strokes and moves them.
    Select,
    /// Uses two points of the model, one at the press and one at the release.
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
    /// Measures the distance between the points.
    Distance,
    /// Selects the strokes in the box that has the points as opposite corners.
    Box,
    /// Selects the strokes in the sphere around the first point through the second.
    Sphere,
}
