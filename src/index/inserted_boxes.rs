use super::{IndexError, admission::admit};
use crate::{
    math::Aabb,
    polygon::{ById, PolygonId},
};

/// The boxes of an index, by id. The methods return the same errors as an index.
#[derive(Clone, Debug)]
pub struct InsertedBoxes {
    boxes: ById<Aabb>,
    len: usize,
}

impl InsertedBoxes {
    pub(crate) const fn new() -> Self {
        Self { boxes: ById::new(Aabb::EMPTY), len: 0 }
    }

    /// An empty set with room for `capacity` boxes.
    pub fn with_capacity(capacity: usize) -> Self {
        let mut inserted = Self::new();
        inserted.boxes.reserve(capacity);
        inserted
    }

    /// Number of boxes.
    pub fn len(&self) -> usize {
        self.len
    }

    /// The box of a polygon; [`Aabb::EMPTY`] if it has none.
    #[inline]
    pub fn get(&self, id: PolygonId) -> Aabb {
        self.boxes.get(id)
    }

    #[inline]
    /// Whether there are no boxes.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Whether a polygon has a box.
    pub fn contains(&self, id: PolygonId) -> bool {
        !self.boxes.get(id).is_empty()
    }

    /// Inserts a box.
    pub fn insert(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        admit(id, bounds)?;
        if self.contains(id) {
            return Err(IndexError::Duplicate(id));
        }
        self.boxes.set(id, *bounds);
        self.len += 1;
        Ok(())
    }

    /// Removes a box and returns it.
    pub fn remove(&mut self, id: PolygonId) -> Result<Aabb, IndexError> {
        let before = self.boxes.get(id);
        if before.is_empty() {
            return Err(IndexError::Unknown(id));
        }
        self.boxes.set(id, Aabb::EMPTY);
        self.len -= 1;
        Ok(before)
    }

    /// Replaces a box and returns the former one.
    pub fn update(&mut self, id: PolygonId, bounds: &Aabb) -> Result<Aabb, IndexError> {
        let before = self.boxes.get(id);
        if before.is_empty() {
            return Err(IndexError::Unknown(id));
        }
        if !bounds.is_valid() {
            return Err(IndexError::InvalidBounds(id));
        }
        self.boxes.set(id, *bounds);
        Ok(before)
    }

    /// The ids and boxes, ascending by id.
    pub fn iter(&self) -> impl Iterator<Item = (PolygonId, &Aabb)> {
        self.boxes.iter().filter(|(_, bounds)| !bounds.is_empty())
    }

    /// Removes all boxes.
    pub fn clear(&mut self) {
        self.boxes.clear();
        self.len = 0;
    }

    /// Memory of the boxes, bytes.
    pub fn bytes(&self) -> usize {
        self.boxes.bytes()
    }
}
