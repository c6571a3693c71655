/// Number of edits in all histories, and of the strokes that they list.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Remembered {
    pub(super) edits: usize,
    pub(super) named: usize,
}
