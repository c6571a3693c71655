use std::collections::VecDeque;

use glam::Vec3;

use super::{
    churn::Churn,
    grid::{self, Grid, ROOT_SHIFT},
    ids::IdMap,
    layout::{Bucket, Node, OWN, TakenRun},
    linear::{Inserted, Linear},
    movers::{Movers, room_for},
    open::{Gathered, OpenBlock},
    pages::Pages,
    pool::{NONE, Pool},
    tuning::{self, LINEAR_BLOCKS, MOST_TAKEN, RESTING_COMMITS},
};
use crate::{
    index::{
        IndexConfig, IndexError, SpatialIndex, Thinner, Upkeep, Visitor, WorkCounts,
        admission::admit_id,
        probe::{Nearest, nearest_by},
        simd::{Backend, Wide},
    },
    math::{Aabb, Frustum, Ray},
    polygon::{Change, Geometry, PolygonId, VisibleBlocks},
};

/// The fast form of the OSP (octal space partition) tree, and the index that most programs should use: a loose octree
/// for polygons that are inserted and removed at any time. The tree never rebuilds itself. As long as there are few
/// polygons, they are stored in a plain list instead. Queries test eight or sixteen boxes at once (AVX-512, AVX2, SSE2,
/// NEON, simd128).
#[derive(Clone, Debug)]
pub struct Osp {
    pub(super) backend: Backend,
    /// The plain list, which holds all polygons while they are few; the tree is then empty.
    pub(super) linear: Linear,
    pub(super) is_linear: bool,
    /// Largest number of blocks of sixteen ids in the plain list.
    pub(super) linear_blocks: usize,
    /// The current limit of the list. For scattered polygons it rises above `linear_blocks` while more are inserted.
    pub(super) list_blocks: usize,
    /// Number of commits since the last insertion into the plain list.
    quiet: u32,
    pub(super) grid: Grid,
    /// The preallocated levels: the link of each cell, 0 for an empty one.
    pub(super) flat: Vec<u32>,
    pub(super) flat_levels: u32,
    pub(super) nodes: Pool<Node>,
    pub(super) buckets: Pool<Bucket>,
    pub(super) pages: Pages,
    pub(super) ids: IdMap,
    pub(super) open: OpenBlock,
    /// The highest node; its cell contains all keys.
    pub(super) top: u32,
    /// Whether the tree is a single node: all runs are straddlers of the top node. For few runs this is faster.
    pub(super) is_flat: bool,
    /// A counter that changes when nodes or buckets are added or removed.
    pub(super) shape: u32,
    /// Working memory for the runs of the open block.
    gathered: Option<Box<Gathered>>,
    /// Working memory for the runs of a leaf that is being packed.
    pub(super) taken: Vec<TakenRun>,
    /// First page of the queue for upkeep.
    pub(super) queue: u32,
    /// Queue of the leaves to pack.
    pub(super) to_pack: VecDeque<u32>,
    /// Queue of the lists of straddlers to move to the children of their node.
    pub(super) to_divide: VecDeque<u32>,
    /// Number of runs inserted into the tree or moved in it since the last commit, or of polygons inserted into the list.
    pub(super) new_runs: u32,
    /// Polygons that move in frame after frame. They are neither in the tree nor in the list, and `len` does not count
    /// them.
    pub(super) movers: Movers,
    /// Whether `movers` contains polygons of a former plain list, which commits insert into the tree.
    pub(super) is_settling: bool,
    pub(super) churn: Churn,
    /// Number of the first commit in which polygons of the rows return to the tree again.
    pub(super) next_return: u32,
    /// Number of commits.
    pub(super) clock: u32,
    /// Value of `clock` at the beginning of the current scan of the movers.
    pub(super) round: u32,
    /// Number of blocks closed and runs moved since the last check of the free room.
    pub(super) changes: u32,
    /// Number of polygons removed or moved since the last commit.
    pub(super) removals: u32,
    /// Number of polygons in the list or the tree, without those in the flat rows.
    pub(super) len: usize,
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

    /// An empty tree that tests boxes with this instruction set, or with plain Rust if the processor lacks it. The query
    /// results do not depend on it.
    #[doc(hidden)]
    pub fn with_backend(config: &IndexConfig, backend: Backend) -> Self {
        Self::warm_up(backend);
        Self::empty(config, backend)
    }

    /// An empty tree, without [`Osp::warm_up`].
    pub(super) fn empty(config: &IndexConfig, backend: Backend) -> Self {
        // This is room for a drawn session of `capacity` polygons, and the additional room of `make_room`.
        let polygons = config.room() + AHEAD;
        let runs = polygons / 8;
        // Reserves memory for the case that each polygon has its own run, because each has moved alone.
        let most_runs = config.room().min(MOST_SCATTERED);
        let mut osp = Self {
            backend,
            linear: Linear::with_room_for(LINEAR_BLOCKS, room_for(config.room())),
            is_linear: true,
            linear_blocks: LINEAR_BLOCKS,
            list_blocks: LINEAR_BLOCKS,
            quiet: 0,
            grid: Grid::new(&config.root),
            flat: vec![0; grid::flat_entries(tuning::flat_levels(config.capacity))],
            flat_levels: tuning::flat_levels(config.capacity),
            nodes: Pool::with_room_for(runs / 64 + NODES_AHEAD).and_room_for(most_runs / 128 + NODES_AHEAD),
            buckets: Pool::with_room_for(runs / 32 + NODES_AHEAD).and_room_for(most_runs / 48 + NODES_AHEAD),
            pages: Pages::with_room_for(runs / 6 + AHEAD / 16, most_runs / RUNS_A_PAGE + AHEAD / 16),
            ids: IdMap::with_room_for(polygons, most_runs / POLYGONS_A_BLOCK + AHEAD / 16),
            open: OpenBlock::new(),
            top: NONE,
            is_flat: true,
            shape: 0,
            gathered: Some(Box::default()),
            taken: Vec::with_capacity(MOST_TAKEN),
            queue: NONE,
            to_pack: VecDeque::with_capacity(most_runs / 48 + NODES_AHEAD),
            to_divide: VecDeque::with_capacity(most_runs / 48 + NODES_AHEAD),
            new_runs: 0,
            movers: Movers::with_room_for(config.room()),
            is_settling: false,
            churn: Churn::NONE,
            next_return: 0,
            clock: 0,
            round: 0,
            changes: CHANGES_BETWEEN,
            removals: 0,
            len: 0,
            upkeep: Upkeep::default(),
        };
        // The zeros are written here, because the system commits memory at the first write; see `Pool::with_room_for`.
        std::hint::black_box(&mut osp.flat).fill(0);
        osp.init_root();
        osp
    }

    /// Changes the limit of the plain list. The index stays a plain list while the ids of all polygons lie in at most
    /// `blocks` blocks of sixteen. For a few hundred polygons, a list is faster than a tree. With 0, the index is a
    /// tree from the first polygon on. The query results do not depend on the limit.
    #[must_use]
    pub fn with_linear_blocks(mut self, blocks: usize) -> Self {
        (self.linear_blocks, self.list_blocks) = (blocks, blocks);
        if self.is_linear && (blocks == 0 || self.linear.len() > blocks) {
            self.make_tree();
        }
        self
    }

    /// Number of polygons that are not in the open block.
    pub(super) fn in_tree(&self) -> usize {
        self.len - self.open.lanes().count_ones() as usize
    }

    /// Creates the node of the root cube.
    pub(super) fn init_root(&mut self) {
        self.is_flat = true;
        let top = self.nodes.take();
        let node = &mut self.nodes[top];
        (node.shift, node.key, node.parent) = (ROOT_SHIFT, Grid::root_key(), NONE);
        self.set_top(top);
    }

    /// Number of polygons in flat rows outside the tree. These polygons move in frame after frame, or come from the
    /// plain list and are not in the tree yet. The query results do not depend on this number.
    pub fn moving(&self) -> usize {
        self.movers.len()
    }

    /// The box of a polygon; `None` if the polygon is not in the index.
    pub fn bounds(&self, id: PolygonId) -> Option<Aabb> {
        if let Some(bounds) = self.movers.bounds(id) {
            return Some(bounds);
        }
        if self.is_linear {
            return self.linear.bounds(id.0);
        }
        let (block, lane) = (id.0 / 16, id.index() % 16);
        if self.open.is(block) && self.open.lanes() >> lane & 1 == 1 {
            return Some(self.open.bounds(lane));
        }
        if self.ids.in_tree(block) >> lane & 1 == 0 {
            return None;
        }
        let place = self.ids.place(id.0)?;
        let (run, bounds) = self.pages.run(place / 16, place as usize % 16);
        Some(if run.is_exact() { bounds } else { self.ids.boxes(run.store).get(lane) })
    }

    /// Whether the polygon is in the tree or in the open block.
    #[inline]
    fn holds(&self, id: PolygonId) -> bool {
        let (block, lane) = (id.0 / 16, id.0 % 16);
        let present = if self.open.is(block) { self.open.present() } else { self.ids.in_tree(block) };
        present >> lane & 1 == 1
    }

    /// Inserts the runs of the open block into the tree, and opens block `block`.
    #[inline(never)]
    fn open_block(&mut self, block: u32) {
        self.changes += 1;
        self.close_block();
        self.open.begin(block, self.ids.in_tree(block));
    }

    pub(super) fn close_block(&mut self) {
        if self.open.lanes() != 0 {
            let mut gathered = self.gathered.take().unwrap_or_default();
            self.open.gather(&mut gathered);
            let store = self.ids.note_block(&self.open, gathered.shared);
            self.insert_gathered(gathered, store);
        }
        self.open.close();
    }

    /// Inserts the runs of a block that is not the open block.
    pub(super) fn insert_block(&mut self, block: &OpenBlock) {
        self.changes += 1;
        let mut gathered = self.gathered.take().unwrap_or_default();
        block.gather(&mut gathered);
        let store = self.ids.note_block(block, gathered.shared);
        self.insert_gathered(gathered, store);
    }

    fn insert_gathered(&mut self, mut gathered: Box<Gathered>, store: u32) {
        let runs = &mut gathered.runs[..gathered.count];
        for (run, _) in runs.iter_mut().filter(|(run, _)| run.mask != 1) {
            run.store = store;
        }
        self.insert_runs(runs);
        self.gathered = Some(gathered);
    }

    /// The polygons in the open block, as a mask, if this block is open; otherwise 0.
    #[inline]
    pub(super) fn open_lanes(&self, block: u32) -> u16 {
        if self.open.is(block) { self.open.lanes() } else { 0 }
    }

    /// Sets a new box of a polygon in the tree or the open block, or returns the error of an update. From the list, only
    /// invalid boxes get here. It is a separate function, so that [`SpatialIndex::update`] saves fewer registers for
    /// moving polygons.
    #[inline(never)]
    fn update_resting(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        let is_known = if self.is_linear { self.linear.holds(id.0) } else { self.holds(id) };
        if !is_known {
            return Err(IndexError::Unknown(id));
        }
        let wide = Wide::from_box(bounds);
        if !wide.is_valid() {
            return Err(IndexError::InvalidBounds(id));
        }
        let lane = id.index() % 16;
        if self.open_lanes(id.0 / 16) >> lane & 1 == 1 {
            self.update_open(lane, wide);
        } else {
            self.move_one(id, wide);
        }
        Ok(())
    }

    /// Puts a polygon that is neither in the list nor in the flat rows into the open block. It is a separate function,
    /// so that [`SpatialIndex::insert`] saves fewer registers for an insertion into the list.
    #[inline(never)]
    fn insert_into_open_block(&mut self, id: PolygonId, bounds: Wide) -> Result<(), IndexError> {
        let (block, lane) = (id.0 / 16, id.index() % 16);
        if !self.open.is(block) {
            if self.holds(id) {
                return Err(IndexError::Duplicate(id));
            }
            self.open_block(block);
        }
        if self.open.present() >> lane & 1 == 1 {
            return Err(IndexError::Duplicate(id));
        }
        self.open.add(lane, bounds);
        self.len += 1;
        Ok(())
    }

    /// Puts a polygon that is not in the tree into the open block.
    pub(super) fn put(&mut self, block: u32, lane: usize, bounds: Wide) {
        if !self.open.is(block) {
            self.open_block(block);
        }
        self.open.add(lane, bounds);
        self.len += 1;
    }

    /// Removes a polygon that is in the tree or the open block.
    pub(super) fn take_out(&mut self, id: PolygonId) {
        let (block, lane) = (id.0 / 16, id.index() % 16);
        self.len -= 1;
        self.removals += 1;
        if self.open.is(block) {
            if self.open.lanes() >> lane & 1 == 1 {
                self.open.remove(lane);
                return;
            }
            self.open.forget_in_tree(lane);
        }
        self.remove_from_run(id.0);
    }
}

impl SpatialIndex for Osp {
    fn name(&self) -> &'static str {
        "osp"
    }

    fn len(&self) -> usize {
        self.len + self.movers.len()
    }

    fn announce(&mut self, geometry: &dyn Geometry, changes: &[Change]) {
        self.prefetch(geometry, changes);
    }

    fn insert(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        admit_id(id)?;
        let wide = Wide::from_box(bounds);
        if !wide.is_valid() {
            return Err(IndexError::InvalidBounds(id));
        }
        if self.churn.keeps_rows {
            debug_assert_eq!(self.len, 0, "the rows hold all polygons");
            self.churn.inserted += 1;
            return if self.movers.insert_new(id, bounds) { Ok(()) } else { Err(IndexError::Duplicate(id)) };
        }
        if self.movers.slot(id).is_some() {
            return Err(IndexError::Duplicate(id));
        }
        if self.is_linear {
            let inserted = match self.linear.insert(id.0, bounds, self.list_blocks) {
                Inserted::Full => self.insert_into_full_list(id, bounds),
                inserted => inserted,
            };
            match inserted {
                Inserted::Done => {
                    (self.len, self.new_runs) = (self.len + 1, self.new_runs + 1);
                    return Ok(());
                }
                Inserted::Present => return Err(IndexError::Duplicate(id)),
                Inserted::Full => self.make_tree(),
            }
        }
        self.insert_into_open_block(id, wide)
    }

    fn remove(&mut self, id: PolygonId) -> Result<(), IndexError> {
        if self.movers.remove(id) {
            self.churn.removals += u32::from(self.churn.keeps_rows);
            return Ok(());
        }
        if self.is_linear {
            if !self.linear.remove(id.0) {
                return Err(IndexError::Unknown(id));
            }
            self.len -= 1;
            return Ok(());
        }
        if !self.holds(id) {
            return Err(IndexError::Unknown(id));
        }
        self.take_out(id);
        Ok(())
    }

    fn update(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        if self.is_linear && self.linear.update(id.0, bounds) {
            self.upkeep.adjusted += 1;
            return Ok(());
        }
        if let Some(slot) = self.movers.slot(id) {
            if !Wide::from_box(bounds).is_valid() {
                return Err(IndexError::InvalidBounds(id));
            }
            self.movers.set(slot, bounds);
            self.upkeep.adjusted += 1;
            return Ok(());
        }
        self.update_resting(id, bounds)
    }

    /// Takes O(1) for each polygon, O(1) for each run with updated polygons, and O(depth) for each run that leaves its
    /// leaf.
    fn update_all(&mut self, updates: &[(PolygonId, Aabb)], refused: &mut Vec<IndexError>) {
        self.update_blocks(updates, refused);
    }

    fn commit(&mut self) {
        let new_runs = self.new_runs;
        if !self.is_linear {
            self.note_edits();
        }
        self.settle(new_runs);
        if self.is_linear {
            self.linear.commit();
            self.quiet = if new_runs == 0 { self.quiet.saturating_add(1) } else { 0 };
            self.new_runs = 0;
            // A long list is faster than a tree only while polygons are inserted in each frame.
            if self.quiet >= RESTING_COMMITS && self.linear.len() > self.linear_blocks {
                self.make_tree();
            }
            return;
        }
        if self.queue != NONE {
            self.keep_up();
        }
        self.divide_some(new_runs);
        self.pack_some(new_runs);
        // The runs that this commit has moved do not count.
        (self.new_runs, self.removals) = (0, 0);
        if self.changes >= CHANGES_BETWEEN {
            self.changes = 0;
            self.make_room();
        }
        if self.is_flat && self.is_small() {
            self.make_linear();
        }
    }

    fn frustum_cull(&self, frustum: &Frustum, draw_list: &mut Vec<PolygonId>) -> WorkCounts {
        let mut work = self.cull(frustum, draw_list);
        work += self.cull_movers(frustum, draw_list);
        work
    }

    fn frustum_cull_blocks(&self, frustum: &Frustum, visible: &mut VisibleBlocks) -> WorkCounts {
        let mut work = self.cull_blocks(frustum, visible);
        work += self.cull_mover_blocks(frustum, visible);
        work
    }

    fn frustum_cull_views(&self, frusta: &[Frustum], visible: &mut [VisibleBlocks]) -> WorkCounts {
        let mut work = self.cull_views(frusta, visible);
        for (frustum, visible) in frusta.iter().zip(visible) {
            work += self.cull_mover_blocks(frustum, visible);
        }
        work
    }

    fn traverse(&self, frustum: &Frustum, visitor: &mut dyn Visitor) -> WorkCounts {
        self.visit(frustum, visitor)
    }

    fn thin_out(&self, frustum: &Frustum, visible: &mut VisibleBlocks, thinner: &mut dyn Thinner) -> bool {
        self.thin(frustum, visible, thinner);
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
            + self.ids.bytes()
            + self.linear.bytes()
            + self.movers.bytes()
            + (self.to_pack.capacity() + self.to_divide.capacity()) * size_of::<u32>()
    }

    fn clear(&mut self) {
        self.flat.fill(0);
        self.clear_tree();
        self.linear.clear();
        self.movers.clear();
        (self.is_linear, self.list_blocks) = (self.linear_blocks > 0, self.linear_blocks);
        (self.len, self.churn) = (0, Churn::NONE);
    }
}

/// If at least this number of polygons was inserted since the last commit, the limit of the list does not rise.
pub(super) const AT_ONCE: u32 = 64;

/// Number of blocks closed and runs moved between two checks of the free room.
pub(super) const CHANGES_BETWEEN: u32 = 64;

/// Number of polygons for which room is reserved in advance, so that memory is allocated between two frames.
const AHEAD: usize = 4096;

/// Largest number of scattered polygons to reserve memory for. Each of them is a run of its own, and pages are not full.
const MOST_SCATTERED: usize = 1 << 20;

/// Lower bound of the average number of runs of a page, because upkeep joins pages of at most eight runs. After all
/// polygons had moved one by one, the measured average was 11.5.
const RUNS_A_PAGE: usize = 10;

/// Average number of polygons left in a block of sixteen ids after removals at random places, if new polygons get new
/// ids.
const POLYGONS_A_BLOCK: usize = 8;

/// Number of nodes, and of buckets, for which room is reserved in advance.
const NODES_AHEAD: usize = 64;

impl Osp {
    /// Empties the tree. All preallocated cells below the root cube must be empty already.
    pub(super) fn clear_tree(&mut self) {
        self.nodes.clear();
        self.buckets.clear();
        self.pages.clear();
        self.ids.clear();
        self.open.close();
        self.to_pack.clear();
        self.to_divide.clear();
        (self.queue, self.removals, self.new_runs) = (NONE, 0, 0);
        self.shape += 1;
        self.init_root();
    }

    /// Reserves memory for the next frame.
    fn make_room(&mut self) {
        self.ids.make_room(AHEAD);
        self.pages.make_room(AHEAD / 16);
        self.buckets.make_room(NODES_AHEAD);
        self.nodes.make_room(NODES_AHEAD);
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
