use osp_session::recording::StrokeId;

/// The selected strokes.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Selection {
    strokes: Vec<StrokeId>,
}

impl Selection {
    /// The strokes, ascending.
    pub fn strokes(&self) -> &[StrokeId] {
        &self.strokes
    }

    /// Whether no stroke is selected.
    pub fn is_empty(&self) -> bool {
        self.strokes.is_empty()
    }

    /// Whether a stroke is selected.
    pub fn has(&self, stroke: StrokeId) -> bool {
        self.strokes.binary_search(&stroke).is_ok()
    }

    /// Deselects all strokes.
    pub fn clear(&mut self) {
        self.strokes.clear();
    }

    /// Selects these strokes and no other.
    pub fn set(&mut self, strokes: impl IntoIterator<Item = StrokeId>) {
        self.strokes.clear();
        self.strokes.extend(strokes);
        self.strokes.sort_unstable();
        self.strokes.dedup();
    }

    /// Selects a stroke, or deselects it if it is selected.
    pub fn toggle(&mut self, stroke: StrokeId) {
        match self.strokes.binary_search(&stroke) {
            Ok(at) => {
                self.strokes.remove(at);
            }
            Err(at) => self.strokes.insert(at, stroke),
        }
    }
}
