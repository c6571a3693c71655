use glam::Vec3;
use osp::{
    index::{
        Backend, IndexConfig, IndexError, Node, SpatialIndex, Upkeep, Visit, Visitor, WorkCounts,
        kernels::{Boxes, IdWriter, Kernel, MaskWriter, PlaneSet, RunSink, Sides, WithKernel, admit},
    },
    math::{Aabb, Containment, Frustum, PlaneMask},
    polygon::{BLOCK, PolygonId, VisibleBlocks},
};

/// Number of levels of boxes: around 1, 16, 256 and 4,096 consecutive ids.
const LEVELS: usize = 4;

const NONE: usize = usize::MAX;

const ENDLESS: Aabb = Aabb { min: Vec3::splat(f32::MIN), max: Vec3::splat(f32::MAX) };

/// A hierarchy of boxes over the order of the ids. Nothing is sorted. Queries are fast if polygons that are drawn one
/// after the other lie close together. Insertions and moves widen the boxes above; a commit computes those of what moved
/// or went again.
#[derive(Clone, Debug)]
pub struct TimeOrder {
    backend: Backend,
    /// Boxes around `16^level` ids, sixteen to an entry.
    levels: [Vec<Boxes<16>>; LEVELS],
    /// For each block of sixteen ids, the mask of its present ids; sixteen blocks to an entry.
    inserted: Vec<[u16; BLOCK]>,
    /// For each sixteen blocks, the mask of the blocks with boxes moved or removed since the last commit.
    changed: Vec<u16>,
    has_changed: bool,
    /// The block of the last insertion since the last commit, or [`NONE`]. Until another follows, the boxes around 256 and
    /// 4,096 ids that contain it are endless.
    open: usize,
    /// These boxes before.
    closed: [Aabb; LEVELS - 2],
    len: usize,
    upkeep: Upkeep,
}

impl TimeOrder {
    pub fn new(config: &IndexConfig) -> Self {
        let groups = config.room().div_ceil(BLOCK * BLOCK);
        Self {
            backend: Backend::detect(),
            levels: std::array::from_fn(|level| {
                Vec::with_capacity((BLOCK * groups).div_ceil(BLOCK.pow(level as u32)))
            }),
            inserted: Vec::with_capacity(groups),
            changed: Vec::with_capacity(groups),
            has_changed: false,
            open: NONE,
            closed: [Aabb::EMPTY; LEVELS - 2],
            len: 0,
            upkeep: Upkeep::default(),
        }
    }

    fn holds(&self, id: PolygonId) -> bool {
        self.inserted
            .as_flattened()
            .get(id.index() / BLOCK)
            .is_some_and(|inserted| inserted >> (id.0 % 16) & 1 == 1)
    }

    /// The lanes of a group that may contain polygons.
    #[inline(always)]
    fn used(&self, level: usize, group: usize) -> u32 {
        match level.checked_sub(1) {
            None => u32::from(self.inserted.as_flattened()[group]),
            Some(below) => (1u32 << (self.levels[below].len() - group * BLOCK).min(BLOCK)) - 1,
        }
    }

    /// Closes the open block and opens this one.
    #[inline(never)]
    fn open(&mut self, block: usize) {
        self.close();
        self.open = block;
        if block >= self.levels[0].len() {
            let mut groups = (block + 1).next_multiple_of(BLOCK);
            for level in &mut self.levels {
                level.resize(groups.max(level.len()), Boxes::EMPTY);
                groups = groups.div_ceil(BLOCK);
            }
            self.inserted.resize(self.levels[1].len(), [0; BLOCK]);
            self.changed.resize(self.levels[1].len(), 0);
        }
        let mut group = block / BLOCK;
        for (level, closed) in self.levels[2..].iter_mut().zip(&mut self.closed) {
            *closed = level[group / BLOCK].get(group % BLOCK);
            level[group / BLOCK].set(group % BLOCK, &ENDLESS);
            group /= BLOCK;
        }
    }

    /// Widens the boxes that contain the open block.
    fn close(&mut self) {
        let mut group = self.open / BLOCK;
        if self.open != NONE {
            let bounds = self.levels[1][group].get(self.open % BLOCK);
            for (level, closed) in self.levels[2..].iter_mut().zip(&self.closed) {
                level[group / BLOCK].set(group % BLOCK, &closed.union(&bounds));
                group /= BLOCK;
            }
            self.open = NONE;
        }
    }

    #[inline]
    fn mark(&mut self, id: PolygonId) {
        self.changed[id.index() / (BLOCK * BLOCK)] |= 1 << (id.index() / BLOCK % BLOCK);
        self.has_changed = true;
    }

    /// Sets the box around a group in the level above.
    fn refit(&mut self, level: usize, group: usize) {
        let bounds = self.levels[level][group].around(self.used(level, group));
        self.levels[level + 1][group / BLOCK].set(group % BLOCK, &bounds);
        self.upkeep.boxes += 1;
    }

    fn cull<S: RunSink>(&self, frustum: &Frustum, out: S) -> (WorkCounts, S) {
        let planes = &PlaneSet::new(frustum);
        self.backend.run(Cull { index: self, planes, out, work: WorkCounts::default() })
    }

    fn visit(&self, walk: &mut Walk<'_>, level: usize, group: usize, mask: PlaneMask, decision: Visit) {
        for lane in (0..BLOCK).filter(|lane| self.used(level, group) >> lane & 1 == 1) {
            let bounds = self.levels[level][group].get(lane);
            if bounds.is_empty() {
                continue;
            }
            let (containment, below, planes) = walk.frustum.classify_masked(&bounds, mask);
            walk.work.boxes += 1;
            walk.work.planes += u64::from(planes);
            if containment == Containment::Outside {
                continue;
            }
            let number = group * BLOCK + lane;
            if level == 0 {
                walk.seen.push(PolygonId(number as u32));
                continue;
            }
            walk.work.nodes += 1;
            let (depth, polygons) = ((LEVELS - 1 - level) as u32, BLOCK.pow(level as u32));
            let node = Node { bounds: &bounds, depth, containment, polygons, is_leaf: level == 1 };
            let answer = if decision == Visit::Take { Visit::Take } else { walk.visitor.node(&node) };
            if answer == Visit::Skip {
                continue;
            }
            self.visit(walk, level - 1, number, below, answer);
            if !walk.seen.is_empty() {
                walk.work.reported += walk.seen.len() as u64;
                walk.visitor.polygons(&walk.seen, answer);
                walk.seen.clear();
            }
        }
    }
}

struct Walk<'a> {
    frustum: &'a Frustum,
    visitor: &'a mut dyn Visitor,
    work: WorkCounts,
    /// The visible polygons of the current block.
    seen: Vec<PolygonId>,
}

struct Cull<'a, S> {
    index: &'a TimeOrder,
    planes: &'a PlaneSet,
    out: S,
    work: WorkCounts,
}

impl<S: RunSink> WithKernel for Cull<'_, S> {
    type Output = (WorkCounts, S);

    #[inline(always)]
    fn run<K: Kernel>(mut self, kernel: K) -> (WorkCounts, S) {
        let before = self.out.found();
        for top in 0..self.index.levels[3].len() {
            let (mut shelves, sides) = self.test(kernel, 3, top, PlaneSet::ALL);
            while let Some((shelf, mask)) = self.next(kernel, 3, top, &mut shelves, (&sides, PlaneSet::ALL)) {
                let (mut groups, sides) = self.test(kernel, 2, shelf, mask);
                while let Some((group, mask)) = self.next(kernel, 2, shelf, &mut groups, (&sides, mask)) {
                    self.group(kernel, group, mask);
                }
            }
        }
        self.work.reported = (self.out.found() - before) as u64;
        (self.work, self.out)
    }
}

impl<S: RunSink> Cull<'_, S> {
    /// Tests the boxes of a group. Returns those that are not behind a plane.
    #[inline(always)]
    fn test<K: Kernel>(&mut self, kernel: K, level: usize, group: usize, mask: u8) -> (u32, Sides) {
        self.work.nodes += 1;
        self.count(BLOCK as u32, mask);
        let sides = self.planes.sides_in_order(kernel, mask, &self.index.levels[level][group]);
        (!sides.behind & self.index.used(level, group), sides)
    }

    /// Takes whole the boxes of `seen` inside all planes, up to the first that a plane cuts. Returns its number and the
    /// planes that cut it.
    #[inline(always)]
    fn next<K: Kernel>(
        &mut self,
        kernel: K,
        level: usize,
        group: usize,
        seen: &mut u32,
        (sides, mask): (&Sides, u8),
    ) -> Option<(usize, u8)> {
        while *seen != 0 {
            let lane = seen.trailing_zeros() as usize;
            *seen &= *seen - 1;
            let number = group * BLOCK + lane;
            if sides.cut >> lane & 1 == 1 {
                return Some((number, sides.planes_at(mask, lane)));
            }
            let groups = BLOCK.pow(level as u32 - 2);
            let end = ((number + 1) * groups).min(self.index.inserted.len());
            let masks = self.index.inserted[number * groups..end].as_flattened();
            let first = number * groups * BLOCK;
            self.work.taken_whole += self.out.push_masks(kernel, first, masks) as u64;
        }
        None
    }

    /// Takes whole the blocks of a group inside all planes, and tests the polygons of those that a plane cuts. All are
    /// tested against the planes that cut the group, so that a processor can predict the loop.
    #[inline(always)]
    fn group<K: Kernel>(&mut self, kernel: K, group: usize, mask: u8) {
        let (seen, sides) = self.test(kernel, 1, group, mask);
        let (inserted, first) = (&self.index.inserted[group], group * BLOCK);
        let mut whole = seen & !sides.cut;
        while whole != 0 {
            let lane = whole.trailing_zeros() as usize % BLOCK;
            whole &= whole - 1;
            // `push_run` would branch on an empty mask, which is unpredictable.
            let taken = self.out.push_masks(kernel, first + lane, &[inserted[lane]]);
            self.work.taken_whole += taken as u64;
        }
        let mut cut = seen & sides.cut;
        self.count(BLOCK as u32 * cut.count_ones(), mask);
        while cut != 0 {
            let lane = cut.trailing_zeros() as usize % BLOCK;
            cut &= cut - 1;
            let behind = self.planes.behind(kernel, mask, &self.index.levels[0][first + lane]);
            self.out.push_masks(kernel, first + lane, &[inserted[lane] & !behind as u16]);
        }
    }

    #[inline(always)]
    fn count(&mut self, lanes: u32, planes: u8) {
        self.work.boxes += u64::from(lanes);
        self.work.planes += u64::from(lanes * planes.count_ones());
    }
}

impl SpatialIndex for TimeOrder {
    fn name(&self) -> &'static str {
        "time-order"
    }

    fn len(&self) -> usize {
        self.len
    }

    fn insert(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        admit(id, bounds)?;
        let (block, lane) = (id.index() / BLOCK, id.index() % BLOCK);
        if block != self.open {
            self.open(block);
        }
        let inserted = &mut self.inserted[block / BLOCK][block % BLOCK];
        if *inserted >> lane & 1 == 1 {
            return Err(IndexError::Duplicate(id));
        }
        *inserted |= 1 << lane;
        self.levels[0][block].set(lane, bounds);
        self.levels[1][block / BLOCK].grow(block % BLOCK, bounds);
        self.upkeep.inserted += 1;
        self.len += 1;
        Ok(())
    }

    fn remove(&mut self, id: PolygonId) -> Result<(), IndexError> {
        if !self.holds(id) {
            return Err(IndexError::Unknown(id));
        }
        self.inserted.as_flattened_mut()[id.index() / BLOCK] &= !(1 << (id.0 % 16));
        self.mark(id);
        self.len -= 1;
        Ok(())
    }

    fn update(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        if !self.holds(id) {
            return Err(IndexError::Unknown(id));
        }
        if !bounds.is_valid() {
            return Err(IndexError::InvalidBounds(id));
        }
        self.close();
        self.mark(id);
        let mut group = id.index() / BLOCK;
        self.levels[0][group].set(id.index() % BLOCK, bounds);
        for level in &mut self.levels[1..] {
            if !level[group / BLOCK].widen(group % BLOCK, bounds) {
                break;
            }
            group /= BLOCK;
        }
        self.upkeep.adjusted += 1;
        Ok(())
    }

    fn commit(&mut self) {
        self.close();
        if !std::mem::take(&mut self.has_changed) {
            return;
        }
        for group in 0..self.changed.len() {
            let mut changed = std::mem::take(&mut self.changed[group]);
            if changed == 0 {
                continue;
            }
            while changed != 0 {
                self.refit(0, group * BLOCK + changed.trailing_zeros() as usize);
                changed &= changed - 1;
            }
            self.refit(1, group);
            self.refit(2, group / BLOCK);
        }
    }

    fn frustum_cull(&self, frustum: &Frustum, draw_list: &mut Vec<PolygonId>) -> WorkCounts {
        let (work, out) = self.cull(frustum, IdWriter::new(draw_list));
        out.finish();
        work
    }

    fn frustum_cull_blocks(&self, frustum: &Frustum, visible: &mut VisibleBlocks) -> WorkCounts {
        let out = MaskWriter::new(visible.masks_for(self.levels[0].len() * BLOCK));
        let (work, out) = self.cull(frustum, out);
        let (blocks, polygons) = out.finish();
        visible.note_filled(blocks, polygons);
        work
    }

    fn traverse(&self, frustum: &Frustum, visitor: &mut dyn Visitor) -> WorkCounts {
        let mut walk = Walk { frustum, visitor, work: WorkCounts::default(), seen: Vec::new() };
        for top in 0..self.levels[LEVELS - 1].len() {
            self.visit(&mut walk, LEVELS - 1, top, PlaneMask::ALL, Visit::Descend);
        }
        walk.work
    }

    fn upkeep(&self) -> Option<Upkeep> {
        Some(self.upkeep)
    }

    fn bytes(&self) -> usize {
        let boxes: usize = self.levels.iter().map(Vec::capacity).sum();
        let masks = BLOCK * self.inserted.capacity() + self.changed.capacity();
        boxes * size_of::<Boxes<16>>() + masks * size_of::<u16>()
    }

    fn clear(&mut self) {
        self.levels.iter_mut().for_each(Vec::clear);
        self.inserted.clear();
        self.changed.clear();
        (self.has_changed, self.open) = (false, NONE);
        self.len = 0;
    }
}
