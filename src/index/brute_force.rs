use super::{
    IndexConfig, IndexError, Node, SpatialIndex, Visit, Visitor, WorkCounts, inserted_boxes::InsertedBoxes,
};
use crate::{
    math::{Aabb, Containment, Frustum},
    polygon::PolygonId,
};

/// The reference index: a query tests the box of every polygon against every plane, one after the other, in the
/// simplest code. The tests compare every other index with it.
#[derive(Clone, Debug)]
pub struct BruteForce {
    boxes: InsertedBoxes,
}

impl Default for BruteForce {
    fn default() -> Self {
        Self::new()
    }
}

impl BruteForce {
    /// An empty index.
    pub fn new() -> Self {
        Self { boxes: InsertedBoxes::new() }
    }

    /// An empty index with room for ids below `capacity`, or [`IndexConfig::MOST_RESERVED`] if that is less.
    pub fn with_capacity(capacity: usize) -> Self {
        Self { boxes: InsertedBoxes::with_capacity(capacity.min(IndexConfig::MOST_RESERVED)) }
    }
}

impl SpatialIndex for BruteForce {
    fn name(&self) -> &'static str {
        "brute-force"
    }

    fn len(&self) -> usize {
        self.boxes.len()
    }

    fn insert(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        self.boxes.insert(id, bounds)
    }

    fn remove(&mut self, id: PolygonId) -> Result<(), IndexError> {
        self.boxes.remove(id).map(|_| ())
    }

    fn update(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        self.boxes.update(id, bounds).map(|_| ())
    }

    fn commit(&mut self) {}

    fn frustum_cull(&self, frustum: &Frustum, draw_list: &mut Vec<PolygonId>) -> WorkCounts {
        let mut work = WorkCounts::default();
        for (id, bounds) in self.boxes.iter() {
            work.boxes += 1;
            work.planes += 6;
            if frustum.may_see(bounds) {
                work.reported += 1;
                draw_list.push(id);
            }
        }
        work
    }

    fn traverse(&self, frustum: &Frustum, visitor: &mut dyn Visitor) -> WorkCounts {
        let bounds = self.boxes.iter().fold(Aabb::EMPTY, |all, (_, b)| all.union(b));
        let containment = frustum.classify(&bounds);
        if self.is_empty() || containment == Containment::Outside {
            return WorkCounts::default();
        }
        let top = Node { bounds: &bounds, depth: 0, containment, polygons: self.len(), is_leaf: true };
        let answer = visitor.node(&top);
        let mut work = WorkCounts { nodes: 1, ..WorkCounts::default() };
        if answer != Visit::Skip {
            let mut seen = Vec::new();
            work += self.frustum_cull(frustum, &mut seen);
            visitor.polygons(&seen, answer);
        }
        work
    }

    fn validate(&self) -> Result<(), String> {
        let inserted = self.boxes.iter().count();
        if inserted != self.len() {
            return Err(format!("{inserted} boxes inserted, {} counted", self.len()));
        }
        match self.boxes.iter().find(|(_, b)| !b.is_valid()) {
            Some((id, b)) => Err(format!("polygon {} has the box {b:?}", id.0)),
            None => Ok(()),
        }
    }

    fn bytes(&self) -> usize {
        self.boxes.bytes()
    }

    fn clear(&mut self) {
        self.boxes.clear();
    }
}
