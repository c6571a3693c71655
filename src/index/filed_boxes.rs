use super::{IndexError, admission::admit};
use crate::{
    math::Aabb,
    polygon::{ById, PolygonId},
};

/// The boxes filed in an index, by id, and the checks that every index makes before it changes anything.
#[derive(Clone, Debug)]
pub(crate) struct FiledBoxes {
    boxes: ById<Aabb>,
    len: usize,
}

impl FiledBoxes {
    pub(crate) const fn new() -> Self {
        Self { boxes: ById::new(Aabb::EMPTY), len: 0 }
    }

    pub(crate) fn with_capacity(capacity: usize) -> Self {
        let mut filed = Self::new();
        filed.boxes.reserve(capacity);
        filed
    }

    pub(crate) fn len(&self) -> usize {
        self.len
    }

    /// The box of a polygon that is filed; [`Aabb::EMPTY`] of any other.
    #[inline]
    #[cfg_attr(not(feature = "rivals"), expect(dead_code, reason = "only other structures look a box up"))]
    pub(crate) fn get(&self, id: PolygonId) -> Aabb {
        self.boxes.get(id)
    }

    #[inline]
    pub(crate) fn contains(&self, id: PolygonId) -> bool {
        !self.boxes.get(id).is_empty()
    }

    /// Files a box.
    pub(crate) fn insert(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        admit(id, bounds)?;
        if self.contains(id) {
            return Err(IndexError::Duplicate(id));
        }
        self.boxes.set(id, *bounds);
        self.len += 1;
        Ok(())
    }

    /// Takes a box out and returns it.
    pub(crate) fn remove(&mut self, id: PolygonId) -> Result<Aabb, IndexError> {
        let before = self.boxes.get(id);
        if before.is_empty() {
            return Err(IndexError::Unknown(id));
        }
        self.boxes.set(id, Aabb::EMPTY);
        self.len -= 1;
        Ok(before)
    }

    /// Replaces a box and returns the one of before.
    pub(crate) fn update(&mut self, id: PolygonId, bounds: &Aabb) -> Result<Aabb, IndexError> {
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
    pub(crate) fn iter(&self) -> impl Iterator<Item = (PolygonId, &Aabb)> {
        self.boxes.iter().filter(|(_, bounds)| !bounds.is_empty())
    }

    pub(crate) fn clear(&mut self) {
        self.boxes.clear();
        self.len = 0;
    }

    pub(crate) fn bytes(&self) -> usize {
        self.boxes.bytes()
    }
}
