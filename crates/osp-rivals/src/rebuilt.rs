use glam::Vec3;

use super::{
    by_id::{ById, InsertedBoxes},
    flat_tree::FlatTree,
    item::Item,
};
use osp::{
    index::{
        IndexError, SpatialIndex, Upkeep, Visitor, WorkCounts,
        kernels::{Nearest, nearest_by},
    },
    math::{Aabb, Frustum, Ray},
    polygon::PolygonId,
};

/// A tree is refitted until its relative surface exceeds this multiple of the surface after the build. Then it is
/// rebuilt. A larger limit makes cheaper commits and slower queries.
const REFIT_LIMIT: f64 = 1.5;

pub(super) trait TreeBuilder: 'static + Send + Sync + std::fmt::Debug {
    /// The name of the index on the command line and in tables.
    const NAME: &'static str;

    /// The action of a commit, if only boxes have changed since the last commit.
    const ON_UPDATE: OnUpdate;

    /// Fills `tree` with all `items` (at least one). The builder may reorder `items`.
    fn build(&mut self, items: &mut [Item], tree: &mut FlatTree);

    /// Memory held between builds, bytes.
    fn bytes(&self) -> usize;

    /// Whether a commit builds the tree once for each inserted polygon, not once for all.
    const EACH_INSERT: bool = false;
}

/// A commit builds at most this number of times, so that a loaded model takes seconds and not hours.
const MOST_BUILDS: usize = 1024;

/// Builds `tree` with the first `count` boxes.
pub(super) fn build_tree(
    builder: &mut impl TreeBuilder,
    boxes: &InsertedBoxes,
    count: usize,
    items: &mut Vec<Item>,
    tree: &mut FlatTree,
) {
    tree.start(count);
    items.clear();
    items.extend(boxes.iter().take(count).map(|(id, bounds)| Item { bounds: *bounds, id }));
    if !items.is_empty() {
        builder.build(items, tree);
    }
    tree.finish();
}

/// The action of a commit, if only boxes have changed since the last commit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum OnUpdate {
    /// Build the tree again.
    Rebuild,
    /// Make the node boxes tight again, bottom up. Build again if the tree has become bad (see [`REFIT_LIMIT`]).
    Refit,
}

/// The work that the next commit has to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Due {
    Nothing,
    Refit,
    Rebuild,
}

/// A static structure as an index. [`SpatialIndex::commit`] builds it again if polygons were inserted or removed since
/// the last commit. Builds reuse the memory.
#[derive(Debug)]
pub(super) struct Rebuilt<B> {
    builder: B,
    inserted: InsertedBoxes,
    /// For each polygon, its position in the tree's order. It is filled only if boxes may be refitted.
    place: ById<u32>,
    tree: FlatTree,
    due: Due,
    /// Number of polygons inserted since the last commit.
    new: usize,
    /// [`FlatTree::relative_area`] after the last build.
    built_area: f64,
    /// Working memory of a build.
    items: Vec<Item>,
    upkeep: Upkeep,
}

impl<B: TreeBuilder> Rebuilt<B> {
    pub(super) fn new(builder: B, capacity: usize) -> Self {
        Self {
            builder,
            inserted: InsertedBoxes::with_capacity(capacity),
            place: ById::new(u32::MAX),
            tree: FlatTree::default(),
            due: Due::Nothing,
            new: 0,
            built_area: 0.0,
            items: Vec::with_capacity(capacity),
            upkeep: Upkeep::default(),
        }
    }

    pub(super) fn builder(&self) -> &B {
        &self.builder
    }

    /// The builder, to change data other than boxes. The next commit builds again.
    pub(super) fn builder_mut(&mut self) -> &mut B {
        self.due = Due::Rebuild;
        &mut self.builder
    }

    pub(super) fn contains(&self, id: PolygonId) -> bool {
        self.inserted.contains(id)
    }

    /// Builds the tree with the first `count` polygons.
    fn rebuild(&mut self, count: usize) {
        build_tree(&mut self.builder, &self.inserted, count, &mut self.items, &mut self.tree);
        self.upkeep.inserted += count as u64;
        self.upkeep.boxes += self.tree.node_count() as u64;
        if B::ON_UPDATE == OnUpdate::Refit {
            for (at, &id) in self.tree.ids().iter().enumerate() {
                self.place.set(id, at as u32);
            }
            self.built_area = self.tree.relative_area();
        }
    }
}

impl<B: TreeBuilder> SpatialIndex for Rebuilt<B> {
    fn name(&self) -> &'static str {
        B::NAME
    }

    fn len(&self) -> usize {
        self.inserted.len()
    }

    fn insert(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        self.inserted.insert(id, bounds)?;
        self.due = Due::Rebuild;
        self.new += 1;
        Ok(())
    }

    fn remove(&mut self, id: PolygonId) -> Result<(), IndexError> {
        self.inserted.remove(id)?;
        self.due = Due::Rebuild;
        Ok(())
    }

    fn update(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        self.inserted.update(id, bounds)?;
        match (self.due, B::ON_UPDATE) {
            (Due::Rebuild, _) => {}
            (_, OnUpdate::Rebuild) => self.due = Due::Rebuild,
            (_, OnUpdate::Refit) => {
                self.tree.set_box(self.place.get(id) as usize, bounds);
                self.due = Due::Refit;
                self.upkeep.adjusted += 1;
            }
        }
        Ok(())
    }

    fn may_skip_commits(&self) -> bool {
        true
    }

    fn commit(&mut self) {
        if self.due == Due::Refit {
            self.tree.refit();
            self.upkeep.boxes += self.tree.node_count() as u64;
            if self.tree.relative_area() > REFIT_LIMIT * self.built_area {
                self.due = Due::Rebuild;
            }
        }
        if self.due == Due::Rebuild {
            // The trees without the polygons that came later serve nobody, as in the paper's comparison.
            let more = if B::EACH_INSERT { self.new.clamp(1, MOST_BUILDS) - 1 } else { 0 };
            for later in (0..=more).rev() {
                self.rebuild(self.inserted.len().saturating_sub(later));
            }
        }
        (self.due, self.new) = (Due::Nothing, 0);
    }

    fn frustum_cull(&self, frustum: &Frustum, draw_list: &mut Vec<PolygonId>) -> WorkCounts {
        self.tree.frustum_cull(frustum, draw_list)
    }

    fn traverse(&self, frustum: &Frustum, visitor: &mut dyn Visitor) -> WorkCounts {
        self.tree.traverse(frustum, visitor)
    }

    fn ray_nearest(
        &self,
        ray: &Ray,
        t_max: f32,
        hit: &mut dyn FnMut(PolygonId) -> Option<f32>,
    ) -> Option<(PolygonId, f32)> {
        let mut nearest = Nearest::new(t_max, hit);
        self.tree.ray_nearest(ray, &mut nearest);
        nearest.found()
    }

    fn nearest(
        &self,
        point: Vec3,
        count: usize,
        distance_m: &mut dyn FnMut(PolygonId) -> f32,
        out: &mut Vec<(PolygonId, f32)>,
    ) -> WorkCounts {
        nearest_by(point, count, self.len(), distance_m, out, |nearest| self.tree.test_nearest(nearest))
    }

    fn upkeep(&self) -> Option<Upkeep> {
        Some(self.upkeep)
    }

    fn bytes(&self) -> usize {
        self.builder.bytes()
            + self.inserted.bytes()
            + self.place.bytes()
            + self.tree.bytes()
            + self.items.capacity() * size_of::<Item>()
    }

    fn clear(&mut self) {
        self.inserted.clear();
        self.tree.clear();
        (self.due, self.new) = (Due::Nothing, 0);
    }
}
