use std::cmp::Ordering;

/// A node or polygon that a search for the nearest polygons has found and not visited yet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SearchEntry<P> {
    /// The parameter at which the ray enters its box, or the distance from the point.
    pub t: f32,
    /// The node or polygon.
    pub place: P,
}

impl<P: PartialEq> Eq for SearchEntry<P> {}

impl<P: Ord> PartialOrd for SearchEntry<P> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl<P: Ord> Ord for SearchEntry<P> {
    /// The nearest entry compares as the greatest, so a heap returns it first, and a sorted stack has it on top.
    fn cmp(&self, other: &Self) -> Ordering {
        other.t.total_cmp(&self.t).then_with(|| other.place.cmp(&self.place))
    }
}
