//! Two levels: a hierarchy of high quality with older polygons, and a dynamic hierarchy with new polygons.
//!
//! Source of the idea: Jon Bentley and James Saxe, "Decomposable Searching Problems I: Static-to-Dynamic
//! Transformation" (1980), with two structures instead of a logarithmic number. Renderers call them the static and the
//! dynamic scene. A query searches both levels. A new polygon goes to the dynamic tree. An erased polygon leaves a hole
//! in the static tree. A moving polygon leaves a hole, and goes to the dynamic tree. When either level has grown beyond
//! a share of the whole, one rebuild makes all polygons static again. So queries stay close to those of a new tree, but
//! single frames take O(n log n).

use super::{BinnedSah, BinnedSahBuilder};
use crate::{
    IndexSettings,
    by_id::{ById, InsertedBoxes},
    dynamic_bvh::BoxTree,
    flat_tree::FlatTree,
    item::Item,
    rebuilt::{TreeBuilder, build_tree},
};
use osp::{
    index::{IndexConfig, IndexError, SpatialIndex, Upkeep, Visitor, WorkCounts, kernels::Nearest},
    math::{Aabb, Frustum, Ray},
    polygon::PolygonId,
};

/// Configuration that decides when the two levels are joined.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TwoLevelConfig {
    /// The levels are joined if the polygons of the dynamic level, or the holes of the static level, exceed this share
    /// of all polygons. A larger share makes rebuilds rarer, and queries between rebuilds slower.
    pub max_share: f32,
    /// Smallest number of polygons of the dynamic level, or of holes, for a rebuild.
    pub min_changed: usize,
}

impl Default for TwoLevelConfig {
    fn default() -> Self {
        Self { max_share: 0.25, min_changed: 512 }
    }
}

/// The position of a polygon.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Place {
    Nowhere,
    /// The polygon was inserted since the last commit.
    Waiting,
    /// Position in the static tree's order.
    Static(u32),
    Dynamic(u32),
}

#[derive(Debug)]
pub struct BvhTwoLevel {
    config: TwoLevelConfig,
    builder: BinnedSahBuilder,
    inserted: InsertedBoxes,
    place: ById<Place>,
    fixed: FlatTree,
    dynamic: BoxTree,
    /// Polygons inserted since the last commit; some may have been removed again.
    waiting: Vec<PolygonId>,
    /// Working memory of a rebuild.
    items: Vec<Item>,
    /// Counts of the work of all rebuilds.
    rebuilt: Upkeep,
}

impl BvhTwoLevel {
    pub fn new(config: TwoLevelConfig, index: &IndexConfig) -> Self {
        Self::by(IndexSettings::default().sah(), config, index)
    }

    /// An empty index whose static level is split by `sah`.
    pub(crate) fn by(sah: BinnedSah, config: TwoLevelConfig, index: &IndexConfig) -> Self {
        let mut place = ById::new(Place::Nowhere);
        place.reserve(index.room());
        Self {
            config,
            builder: BinnedSahBuilder::new(sah),
            inserted: InsertedBoxes::with_capacity(index.room()),
            place,
            fixed: FlatTree::default(),
            dynamic: BoxTree::with_capacity(config.min_changed),
            waiting: Vec::new(),
            items: Vec::with_capacity(index.room()),
            rebuilt: Upkeep::default(),
        }
    }

    fn wait(&mut self, id: PolygonId) {
        self.place.set(id, Place::Waiting);
        self.waiting.push(id);
    }

    fn take_out(&mut self, id: PolygonId) {
        match self.place.get(id) {
            Place::Static(at) => self.fixed.vacate(at as usize),
            Place::Dynamic(leaf) => self.dynamic.remove(leaf),
            Place::Nowhere | Place::Waiting => {}
        }
        self.place.set(id, Place::Nowhere);
    }

    /// Whether this number of changed polygons is enough for a rebuild.
    fn pays(&self, changed: usize) -> bool {
        changed > self.config.min_changed
            && changed as f32 > self.config.max_share * self.inserted.len() as f32
    }

    fn rebuild(&mut self) {
        self.dynamic.clear();
        let count = self.inserted.len();
        build_tree(&mut self.builder, &self.inserted, count, &mut self.items, &mut self.fixed);
        self.rebuilt.inserted += self.inserted.len() as u64;
        self.rebuilt.boxes += self.fixed.node_count() as u64;
        for (at, &id) in self.fixed.ids().iter().enumerate() {
            self.place.set(id, Place::Static(at as u32));
        }
    }
}

impl SpatialIndex for BvhTwoLevel {
    fn name(&self) -> &'static str {
        "bvh-two-level"
    }

    fn len(&self) -> usize {
        self.inserted.len()
    }

    fn insert(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        self.inserted.insert(id, bounds)?;
        self.wait(id);
        Ok(())
    }

    fn remove(&mut self, id: PolygonId) -> Result<(), IndexError> {
        self.inserted.remove(id)?;
        self.take_out(id);
        Ok(())
    }

    fn update(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        self.inserted.update(id, bounds)?;
        self.take_out(id);
        self.wait(id);
        Ok(())
    }

    fn commit(&mut self) {
        if self.pays(self.dynamic.len() + self.waiting.len()) || self.pays(self.fixed.holes()) {
            self.waiting.clear();
            self.rebuild();
            return;
        }
        for id in self.waiting.drain(..) {
            // A polygon may have been removed again, or be listed twice.
            if self.place.get(id) == Place::Waiting {
                let leaf = self.dynamic.insert(id, &self.inserted.get(id));
                self.place.set(id, Place::Dynamic(leaf));
            }
        }
    }

    fn frustum_cull(&self, frustum: &Frustum, draw_list: &mut Vec<PolygonId>) -> WorkCounts {
        let mut work = self.fixed.frustum_cull(frustum, draw_list);
        work += self.dynamic.frustum_cull(frustum, draw_list);
        work
    }

    fn traverse(&self, frustum: &Frustum, visitor: &mut dyn Visitor) -> WorkCounts {
        let mut work = self.fixed.traverse(frustum, visitor);
        work += self.dynamic.traverse(frustum, visitor);
        work
    }

    fn ray_nearest(
        &self,
        ray: &Ray,
        t_max: f32,
        hit: &mut dyn FnMut(PolygonId) -> Option<f32>,
    ) -> Option<(PolygonId, f32)> {
        let mut nearest = Nearest::new(t_max, hit);
        self.fixed.ray_nearest(ray, &mut nearest);
        self.dynamic.ray_nearest(ray, &mut nearest);
        nearest.found()
    }

    fn upkeep(&self) -> Option<Upkeep> {
        let mut all = self.rebuilt;
        all += self.dynamic.upkeep();
        Some(all)
    }

    fn bytes(&self) -> usize {
        self.builder.bytes()
            + self.inserted.bytes()
            + self.place.bytes()
            + self.fixed.bytes()
            + self.dynamic.bytes()
            + self.waiting.capacity() * size_of::<PolygonId>()
            + self.items.capacity() * size_of::<Item>()
    }

    fn clear(&mut self) {
        self.inserted.clear();
        self.place.clear();
        self.fixed.clear();
        self.dynamic.clear();
        self.waiting.clear();
    }
}
