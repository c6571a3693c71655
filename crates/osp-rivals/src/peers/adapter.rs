use crate::by_id::InsertedBoxes;
use osp::{
    index::{IndexConfig, IndexError, Node, SpatialIndex, Visit, Visitor, WorkCounts},
    math::{Aabb, Containment, Frustum},
    polygon::PolygonId,
};

/// A tree that can be built is built again when it has grown by one in this number since the last build.
const GROWTH: usize = 4;

/// Operations of another crate's tree.
pub(super) trait PeerTree: 'static + Default + Send + Sync {
    /// Builds the tree again from all boxes. Returns whether the crate can.
    fn build(&mut self, _inserted: &InsertedBoxes) -> bool {
        false
    }

    fn insert(&mut self, id: u32, bounds: &Aabb);

    /// Removes a polygon. `bounds` is its box in the tree.
    fn remove(&mut self, id: u32, bounds: &Aabb);

    /// Replaces a polygon's box.
    fn update(&mut self, id: u32, before: &Aabb, bounds: &Aabb) {
        self.remove(id, before);
        self.insert(id, bounds);
    }

    /// Ends a batch of changes. `inserted` contains the boxes of all present polygons.
    fn commit(&mut self, _inserted: &InsertedBoxes) {}

    fn cull(&self, frustum: &Frustum, out: &mut Vec<PolygonId>);

    fn bytes(&self) -> usize;
}

/// Another crate's tree as an index.
pub(super) struct Adapted<T> {
    name: &'static str,
    tree: T,
    inserted: InsertedBoxes,
    /// Polygons inserted since the last commit.
    waiting: Vec<PolygonId>,
    /// Number of polygons at the last build.
    built: usize,
    is_due: bool,
}

impl<T: PeerTree> Adapted<T> {
    pub(super) fn new(name: &'static str, config: &IndexConfig) -> Self {
        let inserted = InsertedBoxes::with_capacity(config.room());
        Self { name, tree: T::default(), inserted, waiting: Vec::new(), built: 0, is_due: false }
    }

    /// Inserts the polygons that wait, each in its place.
    fn insert_waiting(&mut self) {
        for id in self.waiting.drain(..) {
            self.tree.insert(id.0, &self.inserted.get(id));
        }
    }
}

impl<T: PeerTree> SpatialIndex for Adapted<T> {
    fn name(&self) -> &'static str {
        self.name
    }

    fn len(&self) -> usize {
        self.inserted.len()
    }

    fn insert(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        self.inserted.insert(id, bounds)?;
        self.waiting.push(id);
        self.is_due = true;
        Ok(())
    }

    fn remove(&mut self, id: PolygonId) -> Result<(), IndexError> {
        self.insert_waiting();
        let bounds = self.inserted.remove(id)?;
        self.tree.remove(id.0, &bounds);
        self.is_due = true;
        Ok(())
    }

    fn update(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        self.insert_waiting();
        let before = self.inserted.update(id, bounds)?;
        self.tree.update(id.0, &before, bounds);
        self.is_due = true;
        Ok(())
    }

    fn may_skip_commits(&self) -> bool {
        true
    }

    fn commit(&mut self) {
        if !std::mem::take(&mut self.is_due) {
            return;
        }
        let has_grown = self.inserted.len() > self.built + self.built / GROWTH;
        if has_grown && self.tree.build(&self.inserted) {
            self.built = self.inserted.len();
            self.waiting.clear();
        } else {
            self.insert_waiting();
            self.tree.commit(&self.inserted);
        }
    }

    fn frustum_cull(&self, frustum: &Frustum, draw_list: &mut Vec<PolygonId>) -> WorkCounts {
        let before = draw_list.len();
        if !self.is_empty() {
            self.tree.cull(frustum, draw_list);
        }
        let mut work = WorkCounts::default();
        work.reported = (draw_list.len() - before) as u64;
        work
    }

    fn traverse(&self, frustum: &Frustum, visitor: &mut dyn Visitor) -> WorkCounts {
        let bounds = self.inserted.iter().fold(Aabb::EMPTY, |all, (_, bounds)| all.union(bounds));
        let containment = frustum.classify(&bounds);
        if self.is_empty() || containment == Containment::Outside {
            return WorkCounts::default();
        }
        let polygons = self.inserted.len();
        let decision =
            visitor.node(&Node { bounds: &bounds, depth: 0, containment, polygons, is_leaf: true });
        let mut list = Vec::new();
        if decision == Visit::Skip {
            return WorkCounts::default();
        }
        let work = self.frustum_cull(frustum, &mut list);
        visitor.polygons(&list, decision);
        work
    }

    fn bytes(&self) -> usize {
        self.tree.bytes()
    }

    fn clear(&mut self) {
        self.inserted.clear();
        self.waiting.clear();
        (self.tree, self.built) = (T::default(), 0);
    }
}
