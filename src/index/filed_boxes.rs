use super::{IndexError, admission::admit};
use crate::{
    math::Aabb,
    polygon::{ById, PolygonId},
};

/// The boxes filed in an index, by id, and the checks that every index makes before it changes anything.
#[derive(Clone, Debug)]
pub struct FiledBoxes {
    boxes: ById<Aabb>,
    len: usize,
}

impl FiledBoxes {
    pub(crate) const fn new() -> Self {
        Self { boxes: ById::new(Aabb::EMPTY), len: 0 }
    }

    /// Room for this many boxes.
    pub fn with_capacity(capacity: usize) -> Self {
        let mut filed = Self::new();
        filed.boxes.reserve(capacity);
        filed
    }

    /// How many boxes are filed.
    pub fn len(&self) -> usize {
        self.len
    }

    /// The box of a polygon that is filed; [`Aabb::EMPTY`] of any other.
    #[inline]
    pub fn get(&self, id: PolygonId) -> Aabb {
        self.boxes.get(id)
    }

    #[inline]
    /// Whether none is filed.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Whether a box is filed under this number.
    pub fn contains(&self, id: PolygonId) -> bool {
        !self.boxes.get(id).is_empty()
    }

    /// Files a box.
    pub fn insert(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        admit(id, bounds)?;
        if self.contains(id) {
            return Err(IndexError::Duplicate(id));
        }
        self.boxes.set(id, *bounds);
        self.len += 1;
        Ok(())
    }

    /// Takes a box out and returns it.
    pub fn remove(&mut self, id: PolygonId) -> Result<Aabb, IndexError> {
        let before = self.boxes.get(id);
        if before.is_empty() {
            return Err(IndexError::Unknown(id));
        }
        self.boxes.set(id, Aabb::EMPTY);
        self.len -= 1;
        Ok(before)
    }

    /// Replaces a box and returns the one of before.
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

    /// What is filed, ascending by id.
    pub fn iter(&self) -> impl Iterator<Item = (PolygonId, &Aabb)> {
        self.boxes.iter().filter(|(_, bounds)| !bounds.is_empty())
    }

    /// Forgets all boxes.
    pub fn clear(&mut self) {
        self.boxes.clear();
        self.len = 0;
    }

    /// Memory that the boxes take, bytes.
    pub fn bytes(&self) -> usize {
        self.boxes.bytes()
    }
}
