/// Number of edits in all histories, and total number of strokes that they list.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct HistoryTotals {
    pub(super) edits: usize,
    pub(super) named: usize,
}
