use osp::{
    index::{BruteForce, IndexError, SpatialIndex, Visitor, WorkCounts},
    math::{Aabb, Frustum},
    polygon::PolygonId,
};

/// An index whose lists of polygons in view are altered: `Altered::by(|list| list.retain(|&id| id != lost))`.
#[derive(Debug)]
pub struct Altered<F> {
    boxes: BruteForce,
    alter: F,
}

impl<F: Fn(&mut Vec<PolygonId>)> Altered<F> {
    /// Creates an empty index.
    pub fn by(alter: F) -> Self {
        Self { boxes: BruteForce::new(), alter }
    }
}

impl<F: Fn(&mut Vec<PolygonId>) + Send + Sync + 'static> SpatialIndex for Altered<F> {
    fn name(&self) -> &'static str {
        "altered"
    }

    fn len(&self) -> usize {
        self.boxes.len()
    }

    fn insert(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        self.boxes.insert(id, bounds)
    }

    fn remove(&mut self, id: PolygonId) -> Result<(), IndexError> {
        self.boxes.remove(id)
    }

    fn update(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        self.boxes.update(id, bounds)
    }

    fn commit(&mut self) {
        self.boxes.commit();
    }

    fn frustum_cull(&self, frustum: &Frustum, list: &mut Vec<PolygonId>) -> WorkCounts {
        let work = self.boxes.frustum_cull(frustum, list);
        (self.alter)(list);
        work
    }

    fn traverse(&self, frustum: &Frustum, visitor: &mut dyn Visitor) -> WorkCounts {
        self.boxes.traverse(frustum, visitor)
    }

    fn validate(&self) -> Result<(), String> {
        self.boxes.validate()
    }

    fn bytes(&self) -> usize {
        self.boxes.bytes()
    }

    fn clear(&mut self) {
        self.boxes.clear();
    }
}
