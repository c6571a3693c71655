//! An octree that lags behind: new and changed polygons are tested in a list, until a later build files them. So no
//! frame waits for the build of its own polygons.

use std::sync::{
    Mutex, PoisonError,
    mpsc::{Receiver, Sender, channel},
};

use glam::Vec3;

use super::{
    by_id::{ById, InsertedBoxes},
    flat_tree::FlatTree,
    item::Item,
    octree_rebuild::{DEEPEST, OctreeBuilder},
    rebuilt::{TreeBuilder, build_tree},
};
use osp::{
    index::{
        IndexConfig, IndexError, SpatialIndex, Visitor, WorkCounts,
        kernels::{Nearest, nearest_by},
    },
    math::{Aabb, Frustum, Ray},
    polygon::PolygonId,
};

/// Number of commits from one build to the next, if the same thread builds.
const COMMITS_A_BUILD: u32 = 16;
const NOWHERE: u32 = u32::MAX;

type Builder = OctreeBuilder<false>;

/// A tree, and the position of each of its polygons.
#[derive(Debug)]
struct Built {
    tree: FlatTree,
    place: ById<u32>,
    items: Vec<Item>,
    /// Memory of the thread that built it.
    elsewhere: usize,
}

impl Built {
    fn new() -> Self {
        Self { tree: FlatTree::default(), place: ById::new(NOWHERE), items: Vec::new(), elsewhere: 0 }
    }

    fn fill(&mut self, builder: &mut Builder, boxes: &InsertedBoxes) {
        build_tree(builder, boxes, boxes.len(), &mut self.items, &mut self.tree);
        self.place.clear();
        for (at, &id) in self.tree.ids().iter().enumerate() {
            self.place.set(id, at as u32);
        }
    }

    fn take_out(&mut self, id: PolygonId) {
        let at = self.place.get(id);
        if at != NOWHERE {
            self.tree.vacate(at as usize);
            self.place.set(id, NOWHERE);
        }
    }

    fn bytes(&self) -> usize {
        self.tree.bytes() + self.place.bytes() + self.items.capacity() * size_of::<Item>() + self.elsewhere
    }
}

/// Boxes that have changed since the last order, [`Aabb::EMPTY`] for a removed polygon; and a tree to build in.
type Order = (Vec<(PolygonId, Aabb)>, Built);

/// The thread that builds. It has its own copy of the boxes and ends with the index.
#[derive(Debug)]
struct Worker {
    orders: Sender<Order>,
    built: Mutex<Receiver<Built>>,
}

impl Worker {
    /// `None` where there are no threads.
    fn start(leaf_capacity: usize) -> Option<Self> {
        let (orders, received) = channel::<Order>();
        let (done, built) = channel();
        let work = move || {
            let mut boxes = InsertedBoxes::with_capacity(0);
            let mut builder = Builder::new(leaf_capacity, DEEPEST);
            for (changes, mut built) in received {
                for (id, bounds) in changes {
                    // An error only says that the box was not there before, or is there no more.
                    let _ = boxes.remove(id);
                    let _ = boxes.insert(id, &bounds);
                }
                built.fill(&mut builder, &boxes);
                built.elsewhere = boxes.bytes() + builder.bytes();
                if done.send(built).is_err() {
                    return;
                }
            }
        };
        std::thread::Builder::new().name("octree".to_owned()).spawn(work).ok()?;
        Some(Self { orders, built: Mutex::new(built) })
    }
}

#[derive(Debug)]
enum Site {
    Here(Builder),
    OnThread(Worker),
}

#[derive(Debug)]
pub(super) struct Lagging {
    name: &'static str,
    site: Site,
    inserted: InsertedBoxes,
    built: Built,
    /// The tree before, for the next order.
    spare: Option<Built>,
    /// Polygons that the tree being built contains, and that `built` does not.
    ordered: Vec<PolygonId>,
    /// Polygons that have changed since then.
    changed: Vec<PolygonId>,
    /// For each polygon, the last order before which it changed, so that `changed` has it once.
    order_of: ById<u32>,
    order: u32,
    /// One leaf with all polygons that `built` does not contain.
    list: FlatTree,
    commits: u32,
    is_due: bool,
}

impl Lagging {
    /// An octree that another thread builds again as soon as it has finished the last one. Where there are no threads, it
    /// is built as by [`Lagging::every_nth`].
    pub(super) fn on_thread(leaf_capacity: usize, config: &IndexConfig) -> Self {
        let here = || Site::Here(Builder::new(leaf_capacity, DEEPEST));
        let site = Worker::start(leaf_capacity).map_or_else(here, Site::OnThread);
        Self::new("octree-rebuild-thread", site, config)
    }

    /// An octree that every sixteenth commit builds again.
    pub(super) fn every_nth(leaf_capacity: usize, config: &IndexConfig) -> Self {
        let site = Site::Here(Builder::new(leaf_capacity, DEEPEST));
        Self::new("octree-rebuild-nth", site, config)
    }

    fn new(name: &'static str, site: Site, config: &IndexConfig) -> Self {
        Self {
            name,
            site,
            inserted: InsertedBoxes::with_capacity(config.room()),
            built: Built::new(),
            spare: None,
            ordered: Vec::new(),
            changed: Vec::new(),
            order_of: ById::new(0),
            order: 1,
            list: FlatTree::default(),
            commits: 0,
            is_due: false,
        }
    }

    fn change(&mut self, id: PolygonId) {
        self.built.take_out(id);
        if self.order_of.get(id) != self.order {
            self.order_of.set(id, self.order);
            self.changed.push(id);
        }
        self.is_due = true;
    }

    /// Takes the tree that the thread has finished.
    fn swap(&mut self, finished: Built) {
        self.spare = Some(std::mem::replace(&mut self.built, finished));
        self.ordered.clear();
        self.changed.iter().for_each(|&id| self.built.take_out(id));
        self.is_due = true;
    }

    fn build(&mut self) {
        let is_first = self.built.tree.node_count() == 0;
        match &mut self.site {
            Site::Here(builder) => {
                if is_first || self.commits >= COMMITS_A_BUILD {
                    self.built.fill(builder, &self.inserted);
                    self.changed.clear();
                    (self.commits, self.order, self.is_due) = (0, self.order + 1, true);
                }
            }
            Site::OnThread(worker) => {
                let changes = self.changed.iter().map(|&id| (id, self.inserted.get(id))).collect();
                let spare = self.spare.take().unwrap_or_else(Built::new);
                if worker.orders.send((changes, spare)).is_err() {
                    return;
                }
                std::mem::swap(&mut self.ordered, &mut self.changed);
                self.order += 1;
                // There is nothing to ask yet, and a model that was loaded would be one long list.
                if is_first {
                    let built = worker.built.get_mut().unwrap_or_else(PoisonError::into_inner).recv();
                    built.into_iter().for_each(|built| self.swap(built));
                }
            }
        }
    }
}

impl SpatialIndex for Lagging {
    fn name(&self) -> &'static str {
        self.name
    }

    fn len(&self) -> usize {
        self.inserted.len()
    }

    fn insert(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        self.inserted.insert(id, bounds)?;
        self.change(id);
        Ok(())
    }

    fn remove(&mut self, id: PolygonId) -> Result<(), IndexError> {
        self.inserted.remove(id)?;
        self.change(id);
        Ok(())
    }

    fn update(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        self.inserted.update(id, bounds)?;
        self.change(id);
        Ok(())
    }

    fn commit(&mut self) {
        self.commits += 1;
        if let Site::OnThread(worker) = &mut self.site
            && let Ok(finished) = worker.built.get_mut().unwrap_or_else(PoisonError::into_inner).try_recv()
        {
            self.swap(finished);
        }
        if self.ordered.is_empty() && !self.changed.is_empty() {
            self.build();
        }
        if std::mem::take(&mut self.is_due) {
            let once = self.ordered.iter().filter(|&&id| self.order_of.get(id) != self.order);
            let items: Vec<Item> = once
                .chain(&self.changed)
                .map(|&id| Item { bounds: self.inserted.get(id), id })
                .filter(|item| !item.bounds.is_empty())
                .collect();
            self.list.start(items.len());
            if !items.is_empty() {
                self.list.leaf(0, &items);
            }
            self.list.finish();
        }
    }

    fn frustum_cull(&self, frustum: &Frustum, draw_list: &mut Vec<PolygonId>) -> WorkCounts {
        let mut work = self.built.tree.frustum_cull(frustum, draw_list);
        work += self.list.frustum_cull(frustum, draw_list);
        work
    }

    fn traverse(&self, frustum: &Frustum, visitor: &mut dyn Visitor) -> WorkCounts {
        let mut work = self.built.tree.traverse(frustum, visitor);
        work += self.list.traverse(frustum, visitor);
        work
    }

    fn ray_nearest(
        &self,
        ray: &Ray,
        t_max: f32,
        hit: &mut dyn FnMut(PolygonId) -> Option<f32>,
    ) -> Option<(PolygonId, f32)> {
        let mut nearest = Nearest::new(t_max, hit);
        self.built.tree.ray_nearest(ray, &mut nearest);
        self.list.ray_nearest(ray, &mut nearest);
        nearest.found()
    }

    fn nearest(
        &self,
        point: Vec3,
        count: usize,
        distance_m: &mut dyn FnMut(PolygonId) -> f32,
        out: &mut Vec<(PolygonId, f32)>,
    ) -> WorkCounts {
        nearest_by(point, count, self.len(), distance_m, out, |nearest| {
            let mut work = self.built.tree.test_nearest(nearest);
            work += self.list.test_nearest(nearest);
            work
        })
    }

    fn bytes(&self) -> usize {
        let site = match &self.site {
            Site::Here(builder) => builder.bytes(),
            Site::OnThread(_) => self.spare.as_ref().map_or(0, Built::bytes),
        };
        site + self.inserted.bytes()
            + self.built.bytes()
            + self.order_of.bytes()
            + self.list.bytes()
            + (self.ordered.capacity() + self.changed.capacity()) * size_of::<PolygonId>()
    }

    fn clear(&mut self) {
        self.inserted.iter().map(|(id, _)| id).collect::<Vec<_>>().into_iter().for_each(|id| self.change(id));
        self.inserted.clear();
        self.list.clear();
    }
}
