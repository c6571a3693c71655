use std::collections::VecDeque;

use glam::Vec3;

use super::{
    grid::{self, Grid, ROOT_SHIFT},
    layout::{Bucket, Node, OWN, Page, TakenRun},
    plan::with_seen,
    pool::{NONE, Pool},
    residence::Residence,
    runs::Gathered,
    store::Store,
    tuning::{self, MOST_IN_ORDER, MOST_TAKEN},
};
use crate::{
    index::{
        IndexConfig, IndexError, SpatialIndex, Upkeep, Visitor, WorkCounts,
        admission::admit,
        probe::{Nearest, nearest_by},
        simd::Backend,
    },
    math::{Aabb, Frustum, Ray},
    polygon::{BLOCK, PolygonId, VisibleBlocks},
};

/// The fast form of the OSP (octal space partition) tree, and the index that most programs should use: a loose octree
/// over a store of boxes in the order of their ids, for polygons that are inserted, moved and removed at any time. The
/// tree never rebuilds itself. Queries test eight or sixteen boxes at once (AVX-512, AVX2, SSE2, NEON, simd128).
#[derive(Clone, Debug)]
pub struct Osp {
    pub(super) backend: Backend,
    /// The boxes of all polygons, by id.
    pub(super) store: Store,
    /// Decides which polygons the tree holds.
    pub(super) residence: Residence,
    /// Largest number of groups of 256 ids that a plane cuts, for a query by the walk in the order of the ids alone.
    pub(super) most_in_order: usize,
    pub(super) grid: Grid,
    /// The preallocated levels: the link of each cell, 0 for an empty one.
    pub(super) flat: Vec<u32>,
    pub(super) flat_levels: u32,
    pub(super) nodes: Pool<Node>,
    pub(super) buckets: Pool<Bucket>,
    pub(super) pages: Pool<Page>,
    /// The highest node; its cell contains all keys.
    pub(super) top: u32,
    /// A counter that changes when nodes or buckets are added or removed.
    pub(super) shape: u32,
    /// Working memory for the runs of a block.
    pub(super) gathered: Option<Box<Gathered>>,
    /// Working memory for the runs of a leaf that is being packed.
    pub(super) taken: Vec<TakenRun>,
    /// First page of the queue for upkeep.
    pub(super) queue: u32,
    /// Queue of the leaves to pack.
    pub(super) to_pack: VecDeque<u32>,
    /// Queue of the lists of straddlers to move to the children of their node.
    pub(super) to_divide: VecDeque<u32>,
    /// Number of runs inserted into the tree since the last commit.
    pub(super) new_runs: u32,
    /// Number of commits.
    pub(super) clock: u32,
    /// Number of blocks filed since the last check of the free room.
    pub(super) changes: u32,
    /// Number of polygons taken out of the tree since the last commit.
    pub(super) removals: u32,
    /// Counts of upkeep for all changes so far; see [`SpatialIndex::upkeep`].
    pub(super) upkeep: Upkeep,
}

impl Osp {
    /// An empty index. The call writes to all reserved memory, so that the system commits it now. The first call in a
    /// process also builds and queries a small model, so that no later frame waits until this code is loaded. This
    /// takes about a millisecond.
    pub fn new(config: &IndexConfig) -> Self {
        Self::with_backend(config, Backend::detect())
    }

    /// An empty index that tests boxes with this instruction set, or with plain Rust if the processor lacks it. The
    /// query results do not depend on it.
    #[doc(hidden)]
    pub fn with_backend(config: &IndexConfig, backend: Backend) -> Self {
        Self::warm_up(backend);
        // The first query of this thread then allocates nothing.
        with_seen(|_| ());
        Self::empty(config, backend)
    }

    /// An empty index, without [`Osp::warm_up`].
    pub(super) fn empty(config: &IndexConfig, backend: Backend) -> Self {
        // This is room for a drawn session of `capacity` polygons, and the additional room of `make_room`.
        let (ahead, nodes_ahead) = ahead_of(config.room());
        let polygons = config.room() + ahead;
        // Reserves memory for the case that each polygon has its own run, because each has moved alone.
        let most_runs = config.room().min(MOST_SCATTERED);
        let most_blocks = most_runs / POLYGONS_A_BLOCK + ahead / 16;
        let mut osp = Self {
            backend,
            store: Store::with_room_for(polygons, most_blocks),
            residence: Residence::with_room_for(most_blocks.max(polygons / 16)),
            most_in_order: MOST_IN_ORDER,
            grid: Grid::new(&config.root),
            flat: vec![0; grid::flat_entries(tuning::flat_levels(config.capacity))],
            flat_levels: tuning::flat_levels(config.capacity),
            nodes: Pool::with_room_for(polygons / POLYGONS_A_NODE + nodes_ahead)
                .and_room_for(most_runs / 128 + nodes_ahead),
            buckets: Pool::with_room_for(polygons / POLYGONS_A_BUCKET + nodes_ahead)
                .and_room_for(most_runs / 48 + nodes_ahead),
            pages: Pool::with_room_for(polygons / POLYGONS_A_PAGE)
                .and_room_for((most_runs + ahead) / RUNS_A_PAGE),
            top: NONE,
            shape: 0,
            gathered: Some(Box::default()),
            taken: Vec::with_capacity(MOST_TAKEN),
            queue: NONE,
            to_pack: VecDeque::with_capacity(most_runs / 48 + nodes_ahead),
            to_divide: VecDeque::with_capacity(most_runs / 48 + nodes_ahead),
            new_runs: 0,
            clock: 0,
            changes: CHANGES_BETWEEN,
            removals: 0,
            upkeep: Upkeep::default(),
        };
        // The zeros are written here, because the system commits memory at the first write; see `Pool::with_room_for`.
        std::hint::black_box(&mut osp.flat).fill(0);
        osp.init_root();
        osp
    }

    /// Changes up to how many groups of 256 consecutive ids, cut by a plane, a query walks in the order of the ids
    /// instead of the tree. With 0, the tree answers all queries that cut a group. The results do not depend on it.
    #[doc(hidden)]
    #[must_use]
    pub fn with_most_in_order(mut self, groups: usize) -> Self {
        self.most_in_order = groups;
        self
    }

    /// Files every polygon in the next commit, and answers by the tree, for tests of the tree.
    #[doc(hidden)]
    #[must_use]
    pub fn with_all_in_tree(mut self) -> Self {
        self.residence.is_eager = true;
        self.with_most_in_order(0)
    }

    /// Creates the node of the root cube.
    pub(super) fn init_root(&mut self) {
        let top = self.nodes.take();
        let node = &mut self.nodes[top];
        (node.shift, node.key, node.parent) = (ROOT_SHIFT, Grid::root_key(), NONE);
        self.set_top(top);
    }

    /// Number of polygons that are not in the tree: they move, or were inserted lately. The query results do not depend
    /// on this number.
    pub fn moving(&self) -> usize {
        self.store.unfiled()
    }

    /// The box of a polygon; `None` if the polygon is not in the index.
    pub fn bounds(&self, id: PolygonId) -> Option<Aabb> {
        self.store.bounds(id)
    }

    /// A box around all polygons. It may be larger than needed.
    pub(crate) fn around(&self) -> Aabb {
        self.store.around()
    }

    /// Sets a valid box of a polygon; returns false, without effect, if the polygon is not in the index.
    #[inline]
    pub(crate) fn move_to(&mut self, id: PolygonId, bounds: &Aabb) -> bool {
        self.upkeep.adjusted += 1;
        self.store.write(id, bounds) || self.move_first(id, bounds)
    }

    #[inline(never)]
    fn move_first(&mut self, id: PolygonId, bounds: &Aabb) -> bool {
        self.upkeep.adjusted -= 1;
        self.update(id, bounds).is_ok()
    }

    /// Sets new boxes of polygons of one block; the last update of a polygon counts. Calls `refuse` with the errors
    /// of refused updates.
    #[inline(always)]
    fn update_block(&mut self, updates: &[(PolygonId, Aabb)], mut refuse: impl FnMut(IndexError)) {
        let Some(&(PolygonId(first), _)) = updates.first() else { return };
        let block = first / 16;
        self.store.close_if(block);
        let Some(at) = self.store.at_live(block) else {
            updates.iter().for_each(|(id, _)| refuse(IndexError::Unknown(*id)));
            return;
        };
        let lanes = updates.iter().fold(0, |lanes, (id, _)| lanes | 1 << (id.0 % 16));
        let filed = self.store.shelf(at.shelf).filed[at.block] & lanes;
        if filed != 0 {
            self.take_out(block, filed);
        }
        let count = self.store.set(at, updates, refuse);
        self.upkeep.adjusted += count as u64;
        self.wait(at, block);
    }
}

impl SpatialIndex for Osp {
    fn name(&self) -> &'static str {
        "osp"
    }

    fn len(&self) -> usize {
        self.store.len()
    }

    fn insert(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        admit(id, bounds)?;
        let block = id.0 / 16;
        if !self.store.is_open(block) {
            let at = self.store.open(id, bounds).ok_or(IndexError::Duplicate(id))?;
            self.wait(at, block);
        } else if !self.store.insert(id, bounds) {
            return Err(IndexError::Duplicate(id));
        }
        self.residence.inserted += 1;
        Ok(())
    }

    fn remove(&mut self, id: PolygonId) -> Result<(), IndexError> {
        let block = id.0 / 16;
        self.store.close_if(block);
        if self.store.filed_lanes(block) >> (id.0 % 16) & 1 == 1 {
            self.take_out(block, 1 << (id.0 % 16));
        }
        let at = self.store.remove(id).ok_or(IndexError::Unknown(id))?;
        self.wait(at, block);
        Ok(())
    }

    fn update(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        let mut refused = None;
        self.update_block(&[(id, *bounds)], |error| refused = Some(error));
        refused.map_or(Ok(()), Err)
    }

    /// Takes O(1) for each polygon, and O(depth) for each that leaves the tree.
    fn update_all(&mut self, updates: &[(PolygonId, Aabb)], refused: &mut Vec<IndexError>) {
        if self.moves_most(updates) {
            self.pause();
        }
        for of_block in updates.chunk_by(|(a, _), (b, _)| a.0 / 16 == b.0 / 16) {
            self.update_block(of_block, |error| refused.push(error));
        }
    }

    fn commit(&mut self) {
        self.clock = self.clock.wrapping_add(1);
        self.new_runs = 0;
        self.store.close();
        self.settle();
        if self.queue != NONE {
            self.keep_up();
        }
        self.divide_some(self.new_runs);
        self.pack_some(self.new_runs);
        self.removals = 0;
        if self.changes >= CHANGES_BETWEEN {
            self.changes = 0;
            self.make_room();
        }
    }

    fn frustum_cull(&self, frustum: &Frustum, draw_list: &mut Vec<PolygonId>) -> WorkCounts {
        self.cull(frustum, draw_list)
    }

    fn frustum_cull_blocks(&self, frustum: &Frustum, visible: &mut VisibleBlocks) -> WorkCounts {
        self.cull_blocks(frustum, visible)
    }

    fn frustum_cull_views(&self, frusta: &[Frustum], visible: &mut [VisibleBlocks]) -> WorkCounts {
        self.cull_views(frusta, visible)
    }

    fn traverse(&self, frustum: &Frustum, visitor: &mut dyn Visitor) -> WorkCounts {
        self.walk(frustum, visitor, None)
    }

    fn thin_out(&self, frustum: &Frustum, visible: &mut VisibleBlocks, visitor: &mut dyn Visitor) -> bool {
        self.walk(frustum, visitor, Some(visible));
        true
    }

    fn ray_nearest(
        &self,
        ray: &Ray,
        t_max: f32,
        hit: &mut dyn FnMut(PolygonId) -> Option<f32>,
    ) -> Option<(PolygonId, f32)> {
        let mut nearest = Nearest::new(t_max, hit);
        self.test_along(ray, &mut nearest);
        nearest.found()
    }

    fn nearest(
        &self,
        point: Vec3,
        count: usize,
        distance_m: &mut dyn FnMut(PolygonId) -> f32,
        out: &mut Vec<(PolygonId, f32)>,
    ) -> WorkCounts {
        nearest_by(point, count, self.len(), distance_m, out, |nearest| self.test_around(nearest))
    }

    fn upkeep(&self) -> Option<Upkeep> {
        Some(self.upkeep)
    }

    fn validate(&self) -> Result<(), String> {
        self.check()
    }

    fn bytes(&self) -> usize {
        size_of::<Self>()
            + self.flat.capacity() * size_of::<u32>()
            + self.nodes.bytes()
            + self.buckets.bytes()
            + self.pages.bytes()
            + self.store.bytes()
            + self.residence.bytes()
            + (self.to_pack.capacity() + self.to_divide.capacity()) * size_of::<u32>()
            + self.gathered.as_ref().map_or(0, |_| size_of::<Gathered>())
    }

    fn clear(&mut self) {
        self.flat.fill(0);
        self.clear_tree();
        self.store.clear();
        self.residence.clear();
    }
}

/// Number of blocks filed between two checks of the free room.
const CHANGES_BETWEEN: u32 = 64;

/// For how many polygons, and for how many nodes and buckets, a model of `polygons` polygons has room in advance. More room
/// takes more memory; with less, a frame that inserts many polygons allocates it.
fn ahead_of(polygons: usize) -> (usize, usize) {
    let ahead = (polygons / 16).clamp(CHANGES_BETWEEN as usize * BLOCK, 4096);
    (ahead, ahead / 64)
}

/// Largest number of scattered polygons to reserve memory for. Each of them is a run of its own, and pages are not full.
const MOST_SCATTERED: usize = 1 << 20;

/// Lower bound of the average number of runs of a page, because upkeep joins pages of at most eight runs. After all
/// polygons had moved one by one, the measured average was 11.5.
const RUNS_A_PAGE: usize = 10;

/// Lower bounds of the average numbers of polygons of a page, bucket and node in drawn models. Those of eight sketches and
/// of grown models were 176 to 230, 680 to 990 and 2,700 to 6,700. Larger bounds take less memory; if they are too large, a
/// frame waits for memory that the system has not committed yet.
const POLYGONS_A_PAGE: usize = 160;
const POLYGONS_A_BUCKET: usize = 640;
const POLYGONS_A_NODE: usize = 2048;

/// Average number of polygons left in a block of sixteen ids after removals at random places, if new polygons get new
/// ids.
const POLYGONS_A_BLOCK: usize = 8;

impl Osp {
    /// Empties the tree. All preallocated cells below the root cube must be empty already.
    pub(super) fn clear_tree(&mut self) {
        self.nodes.clear();
        self.buckets.clear();
        self.pages.clear();
        self.to_pack.clear();
        self.to_divide.clear();
        (self.queue, self.removals, self.new_runs) = (NONE, 0, 0);
        self.shape += 1;
        self.init_root();
    }

    /// Reserves memory for the next frame.
    fn make_room(&mut self) {
        let (ahead, nodes_ahead) = ahead_of(self.store.len());
        self.store.make_room(ahead);
        self.pages.make_room(ahead / RUNS_A_PAGE);
        self.buckets.make_room(nodes_ahead);
        self.nodes.make_room(nodes_ahead);
    }

    /// The first bucket of a bucket's chain.
    pub(super) fn chain_head(&self, bucket: u32) -> u32 {
        let b = &self.buckets[bucket];
        let node = &self.nodes[b.parent];
        if b.slot == OWN {
            return node.own;
        }
        match node.children[b.slot as usize].target() {
            super::layout::Target::Leaf(head) => head,
            _ => bucket,
        }
    }
}
