/// Edits that all histories hold, and the strokes that they name.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Remembered {
    pub(super) edits: usize,
    pub(super) named: usize,
}
