use super::{DrawList, IndexError, Node, SpatialIndex, Visit, Visitor, WorkCounts, admission::admit};
use crate::{
    math::{Aabb, Containment, Frustum},
    polygon::PolygonId,
};

/// The reference: every polygon's box against every plane, one after the other, in the plainest code. Every other
/// index is tested against it.
#[derive(Clone, Debug, Default)]
pub struct BruteForce {
    /// By id; [`Aabb::EMPTY`] where there is none.
    boxes: Vec<Aabb>,
    len: usize,
}

impl BruteForce {
    /// An empty index.
    pub fn new() -> Self {
        Self::default()
    }

    /// An empty index with room for ids below `capacity`.
    pub fn with_capacity(capacity: usize) -> Self {
        Self { boxes: Vec::with_capacity(capacity), len: 0 }
    }

    fn filed(&self) -> impl Iterator<Item = (PolygonId, &Aabb)> {
        self.boxes.iter().enumerate().filter(|(_, b)| !b.is_empty()).map(|(i, b)| (PolygonId(i as u32), b))
    }
}

impl SpatialIndex for BruteForce {
    fn name(&self) -> &'static str {
        "brute-force"
    }

    fn len(&self) -> usize {
        self.len
    }

    fn insert(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        admit(id, bounds)?;
        if id.index() >= self.boxes.len() {
            self.boxes.resize(id.index() + 1, Aabb::EMPTY);
        }
        if !self.boxes[id.index()].is_empty() {
            return Err(IndexError::Duplicate(id));
        }
        self.boxes[id.index()] = *bounds;
        self.len += 1;
        Ok(())
    }

    fn remove(&mut self, id: PolygonId) -> Result<(), IndexError> {
        let slot = self.boxes.get_mut(id.index()).filter(|b| !b.is_empty()).ok_or(IndexError::Unknown(id))?;
        *slot = Aabb::EMPTY;
        self.len -= 1;
        Ok(())
    }

    fn update(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        let slot = self.boxes.get_mut(id.index()).filter(|b| !b.is_empty()).ok_or(IndexError::Unknown(id))?;
        if !bounds.is_valid() {
            return Err(IndexError::InvalidBounds(id));
        }
        *slot = *bounds;
        Ok(())
    }

    fn commit(&mut self) {}

    fn frustum_cull(&self, frustum: &Frustum, draw_list: &mut DrawList) -> WorkCounts {
        let mut work = WorkCounts::default();
        for (id, bounds) in self.filed() {
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
        let bounds = self.filed().fold(Aabb::EMPTY, |all, (_, b)| all.union(b));
        let containment = frustum.classify(&bounds);
        if self.len == 0 || containment == Containment::Outside {
            return WorkCounts::default();
        }
        let top = Node { bounds: &bounds, depth: 0, containment, polygons: self.len, is_leaf: true };
        let answer = visitor.node(&top);
        let mut work = WorkCounts { nodes: 1, ..WorkCounts::default() };
        if answer != Visit::Skip {
            let mut seen = DrawList::new();
            work += self.frustum_cull(frustum, &mut seen);
            visitor.polygons(seen.ids(), answer);
        }
        work
    }

    fn validate(&self) -> Result<(), String> {
        let filed = self.filed().count();
        if filed != self.len {
            return Err(format!("{filed} boxes filed, {} counted", self.len));
        }
        match self.filed().find(|(_, b)| !b.is_valid()) {
            Some((id, b)) => Err(format!("polygon {} has the box {b:?}", id.0)),
            None => Ok(()),
        }
    }

    fn bytes(&self) -> usize {
        self.boxes.capacity() * size_of::<Aabb>()
    }

    fn clear(&mut self) {
        self.boxes.clear();
        self.len = 0;
    }
}
