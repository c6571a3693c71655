use crate::{
    index::{BruteForce, IndexConfig, IndexError, Osp, SpatialIndex},
    math::Aabb,
    polygon::{ById, PolygonId},
};

/// Polygons that a mesh keeps as a list. More are worth a tree, whose upper levels are there from the first polygon on.
const MOST_LISTED: usize = 512;

/// Polygons by their boxes in a space of their own.
pub struct Mesh {
    /// [`Aabb::EMPTY`] where there is none.
    boxes: ById<Aabb>,
    index: Box<dyn SpatialIndex>,
    is_tree: bool,
    /// Around all polygons; too large after some were taken out.
    bounds: Aabb,
    /// Polygons were taken out or moved since `bounds` was computed.
    is_loose: bool,
}

impl Default for Mesh {
    fn default() -> Self {
        Self {
            boxes: ById::new(Aabb::EMPTY),
            index: Box::new(BruteForce::new()),
            is_tree: false,
            bounds: Aabb::EMPTY,
            is_loose: false,
        }
    }
}

impl std::fmt::Debug for Mesh {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Mesh")
            .field("polygons", &self.index.len())
            .field("bounds", &self.bounds)
            .finish_non_exhaustive()
    }
}

impl Mesh {
    /// What is filed, by the boxes in the mesh's space.
    pub fn index(&self) -> &dyn SpatialIndex {
        &*self.index
    }

    /// Around all polygons as they were at the last commit, and those set since.
    pub fn bounds(&self) -> &Aabb {
        &self.bounds
    }

    /// Files a polygon, gives it another box, or takes it out (`None`).
    pub fn set(&mut self, id: PolygonId, bounds: Option<&Aabb>) -> Result<(), IndexError> {
        let is_there = !self.boxes.get(id).is_empty();
        match bounds {
            Some(bounds) if is_there => self.index.update(id, bounds)?,
            Some(bounds) => self.index.insert(id, bounds)?,
            None => self.index.remove(id)?,
        }
        self.boxes.set(id, bounds.copied().unwrap_or(Aabb::EMPTY));
        self.is_loose |= is_there;
        if let Some(bounds) = bounds {
            self.bounds = self.bounds.union(bounds);
        }
        Ok(())
    }

    /// Ends a batch of changes.
    pub fn commit(&mut self) {
        if std::mem::take(&mut self.is_loose) {
            self.bounds = self.boxes.iter().fold(Aabb::EMPTY, |all, (_, bounds)| all.union(bounds));
        }
        if self.index.len() > MOST_LISTED && !std::mem::replace(&mut self.is_tree, true) {
            let side = self.bounds.extent().max_element().max(f32::MIN_POSITIVE);
            let root = Aabb::cube(self.bounds.center(), side);
            let mut tree = Osp::new(&IndexConfig { root, capacity: self.index.len() });
            for (id, bounds) in self.boxes.iter() {
                // The list has taken each of them.
                let _ = tree.insert(id, bounds);
            }
            self.index = Box::new(tree);
        }
        self.index.commit();
    }

    /// Memory held, bytes.
    pub fn bytes(&self) -> usize {
        self.index.bytes() + self.boxes.bytes()
    }
}
