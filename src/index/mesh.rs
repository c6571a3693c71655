use crate::{
    index::{BruteForce, IndexConfig, IndexError, Osp, SpatialIndex},
    math::Aabb,
    polygon::{ById, PolygonId},
};

/// Largest number of polygons in a plain list. A larger mesh uses a tree, which allocates its upper levels at once.
const MOST_LISTED: usize = 512;

/// The polygons of one space, found by their boxes in that space.
pub struct Mesh {
    /// The box of each polygon; [`Aabb::EMPTY`] for an id without a polygon.
    boxes: ById<Aabb>,
    index: Box<dyn SpatialIndex>,
    is_tree: bool,
    /// A box around all polygons. After removals and moves it may be too large until the next commit.
    bounds: Aabb,
    /// Whether polygons were removed or moved since `bounds` was computed.
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
    /// The index of the polygons, by their boxes in the mesh's space.
    pub fn index(&self) -> &dyn SpatialIndex {
        &*self.index
    }

    /// A box around all polygons of the last commit and all polygons set since.
    pub fn bounds(&self) -> &Aabb {
        &self.bounds
    }

    /// Inserts a polygon, changes its box, or removes it (`None`).
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
                // This returns no error, because the list has accepted each of these boxes.
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
