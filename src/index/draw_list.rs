use super::simd::ROOM_BEHIND;
use crate::polygon::{BLOCK, PolygonId};

/// The ids that a query found, in the order of the query. The list allocates only while it grows. Frames use sets
/// instead, see [`VisibleBlocks`](crate::polygon::VisibleBlocks).
#[derive(Clone, Debug, Default)]
pub struct DrawList {
    ids: Vec<PolygonId>,
    /// Working memory of an index that finds blocks before it lists their ids.
    masks: Vec<u16>,
}

/// Equal if they list the same polygons in the same order.
impl PartialEq for DrawList {
    fn eq(&self, other: &Self) -> bool {
        self.ids == other.ids
    }
}

impl Eq for DrawList {}

impl DrawList {
    /// An empty list.
    pub const fn new() -> Self {
        Self { ids: Vec::new(), masks: Vec::new() }
    }

    /// An empty list with room for `polygons` ids, see [`DrawList::reserve`].
    pub fn with_capacity(polygons: usize) -> Self {
        let mut list = Self::new();
        list.reserve(polygons);
        list
    }

    /// A list of these ids.
    pub(crate) fn of(ids: Vec<PolygonId>) -> Self {
        Self { ids, masks: Vec::new() }
    }

    /// Returns the list's memory.
    pub(crate) fn into_ids(self) -> Vec<PolygonId> {
        self.ids
    }

    /// Removes all ids; keeps the memory.
    pub fn clear(&mut self) {
        self.ids.clear();
    }

    /// Makes room for `additional` more ids, or for all ids below [`PolygonId::LIMIT`] if those are fewer. A query that
    /// finds at most this number of polygons does not allocate.
    pub fn reserve(&mut self, additional: usize) {
        let additional = additional.min(PolygonId::LIMIT as usize);
        self.ids.reserve(additional + ROOM_BEHIND);
        self.masks.reserve(additional / BLOCK + ROOM_BEHIND);
    }

    /// Appends one polygon.
    pub fn push(&mut self, id: PolygonId) {
        self.ids.push(id);
    }

    /// Appends polygons.
    pub fn extend_from_slice(&mut self, ids: &[PolygonId]) {
        self.ids.extend_from_slice(ids);
    }

    /// The polygons.
    pub fn ids(&self) -> &[PolygonId] {
        &self.ids
    }

    /// The vector of ids, for an index that appends many at once.
    pub fn ids_mut(&mut self) -> &mut Vec<PolygonId> {
        &mut self.ids
    }

    /// The vector of ids, and a mask for each block with unspecified contents.
    pub(crate) fn parts(&mut self) -> (&mut Vec<PolygonId>, &mut Vec<u16>) {
        (&mut self.ids, &mut self.masks)
    }

    /// Number of polygons.
    pub fn len(&self) -> usize {
        self.ids.len()
    }

    /// Whether the list is empty.
    pub fn is_empty(&self) -> bool {
        self.ids.is_empty()
    }
}

impl Extend<PolygonId> for DrawList {
    fn extend<I: IntoIterator<Item = PolygonId>>(&mut self, ids: I) {
        self.ids.extend(ids);
    }
}
