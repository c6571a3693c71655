use osp::{
    index::{
        Backend, IndexConfig, IndexError, Node, SpatialIndex, Upkeep, Visit, Visitor, WorkCounts,
        kernels::{Boxes, IdWriter, Kernel, MaskWriter, PlaneSet, RunSink, WithKernel, admit},
    },
    math::{Aabb, Containment, Frustum, PlaneMask},
    polygon::{BLOCK, PolygonId, VisibleBlocks},
};

/// A hierarchy of boxes over the order of the ids: sixteen polygons form a block, sixteen blocks a larger group, and so
/// on. Nothing is sorted. Queries are fast if polygons that are drawn one after the other lie close together.
#[derive(Clone, Debug)]
pub struct TimeOrder {
    backend: Backend,
    /// Level 0 has the polygons' boxes. Every further level has the boxes around the groups of the level below.
    levels: Vec<Vec<Boxes<16>>>,
    /// Reserved memory for further levels, the lowest last.
    spare: Vec<Vec<Boxes<16>>>,
    /// For each block, the mask of its present ids.
    inserted: Vec<u16>,
    len: usize,
    upkeep: Upkeep,
}

impl TimeOrder {
    pub fn new(config: &IndexConfig) -> Self {
        let blocks = config.room().div_ceil(16);
        let mut spare: Vec<Vec<Boxes<16>>> = Vec::new();
        let mut groups = blocks;
        while groups > 1 || spare.is_empty() {
            groups = groups.div_ceil(16);
            spare.push(Vec::with_capacity(groups));
        }
        spare.reverse();
        let mut levels = Vec::with_capacity(1 + spare.len());
        levels.push(Vec::with_capacity(blocks));
        Self {
            backend: Backend::detect(),
            levels,
            spare,
            inserted: Vec::with_capacity(blocks),
            len: 0,
            upkeep: Upkeep::default(),
        }
    }

    fn holds(&self, id: PolygonId) -> bool {
        self.inserted.get(id.index() / 16).is_some_and(|inserted| inserted >> (id.0 % 16) & 1 == 1)
    }

    /// The lanes of a group that contain polygons.
    fn used(&self, level: usize, group: usize) -> u32 {
        if level == 0 { u32::from(self.inserted[group]) } else { 0xFFFF }
    }

    fn make_room(&mut self, block: usize) {
        let mut groups = block + 1;
        self.inserted.resize(groups.max(self.inserted.len()), 0);
        for level in 0.. {
            if level == self.levels.len() {
                // The new top contains the former top.
                let below = self.levels[level - 1].first().map_or(Aabb::EMPTY, |top| top.around(0xFFFF));
                let mut boxes = self.spare.pop().unwrap_or_default();
                boxes.push(Boxes::EMPTY);
                boxes[0].set(0, &below);
                self.levels.push(boxes);
            }
            let boxes = &mut self.levels[level];
            boxes.resize(groups.max(boxes.len()), Boxes::EMPTY);
            // `clear` keeps the levels, so each level gets its first group again.
            if boxes.len() == 1 && level > 0 && level + 1 == self.levels.len() {
                return;
            }
            groups = groups.div_ceil(16);
        }
    }

    /// Tightens the boxes above a block after a polygon in it has shrunk or gone.
    fn tighten(&mut self, block: usize) {
        let mut group = block;
        for level in 0..self.levels.len() - 1 {
            self.upkeep.boxes += 1;
            let bounds = self.levels[level][group].around(self.used(level, group));
            let above = &mut self.levels[level + 1][group / 16];
            if above.get(group % 16) == bounds {
                return;
            }
            above.set(group % 16, &bounds);
            group /= 16;
        }
    }

    fn top(&self) -> Option<usize> {
        (self.len > 0).then(|| self.levels.len() - 1)
    }

    fn visit(&self, walk: &mut Walk<'_>, level: usize, group: usize, mask: PlaneMask, decision: Visit) {
        for lane in (0..16).filter(|lane| self.used(level, group) >> lane & 1 == 1) {
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
            let number = group * 16 + lane;
            if level == 0 {
                walk.seen.push(PolygonId(number as u32));
                continue;
            }
            walk.work.nodes += 1;
            let depth = (self.levels.len() - 1 - level) as u32;
            let polygons = 1usize << (4 * level);
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
    planes: PlaneSet,
    out: S,
    work: WorkCounts,
}

impl<S: RunSink> WithKernel for Cull<'_, S> {
    type Output = (WorkCounts, S);

    #[inline(always)]
    fn run<K: Kernel>(mut self, kernel: K) -> (WorkCounts, S) {
        let Some(top) = self.index.top() else { return (self.work, self.out) };
        // The stack has at most fifteen siblings of each of eight levels.
        let mut stack = [(0u8, 0u32, 0u8); 16 * 8];
        stack[0] = (top as u8, 0, PlaneSet::ALL);
        let mut waiting = 1;
        while waiting > 0 {
            waiting -= 1;
            let (level, group, mask) = stack[waiting];
            let boxes = &self.index.levels[usize::from(level)][group as usize];
            if level == 0 {
                self.block(kernel, group, boxes, mask);
                continue;
            }
            self.work.nodes += 1;
            let sides = self.planes.sides_rows(kernel, mask, boxes);
            self.count(16, mask);
            let below = self.index.levels[usize::from(level) - 1].len() as u32 - group * 16;
            let mut seen = !sides.behind & ((1u32 << below.min(16)) - 1);
            while seen != 0 {
                // Pushes the last lane first, so that the stack returns the lanes in the order of their ids.
                let lane = seen.ilog2();
                seen &= !(1 << lane);
                stack[waiting] = (level - 1, group * 16 + lane, sides.planes_at(mask, lane as usize));
                waiting += 1;
            }
        }
        (self.work, self.out)
    }
}

impl<S: RunSink> Cull<'_, S> {
    #[inline(always)]
    fn count(&mut self, lanes: u32, planes: u8) {
        self.work.boxes += if planes == 0 { 0 } else { u64::from(lanes) };
        self.work.planes += u64::from(lanes * planes.count_ones());
    }

    #[inline(always)]
    fn block<K: Kernel>(&mut self, kernel: K, block: u32, boxes: &Boxes<16>, mask: u8) {
        let inserted = u32::from(self.index.inserted[block as usize]);
        let seen = inserted & !self.planes.behind(kernel, mask, boxes);
        self.count(inserted.count_ones(), mask);
        if seen != 0 {
            self.work.reported += u64::from(seen.count_ones());
            self.work.taken_whole += if mask == 0 { u64::from(seen.count_ones()) } else { 0 };
            self.out.push_run(kernel, block * 16, seen);
        }
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
        let (block, lane) = (id.index() / 16, id.index() % 16);
        if block >= self.inserted.len() {
            self.make_room(block);
        }
        if self.inserted[block] >> lane & 1 == 1 {
            return Err(IndexError::Duplicate(id));
        }
        self.inserted[block] |= 1 << lane;
        self.levels[0][block].set(lane, bounds);
        let mut group = block;
        for level in &mut self.levels[1..] {
            self.upkeep.boxes += 1;
            if !level[group / 16].widen(group % 16, bounds) {
                break;
            }
            group /= 16;
        }
        self.upkeep.inserted += 1;
        self.len += 1;
        Ok(())
    }

    fn remove(&mut self, id: PolygonId) -> Result<(), IndexError> {
        if !self.holds(id) {
            return Err(IndexError::Unknown(id));
        }
        let block = id.index() / 16;
        self.inserted[block] &= !(1 << (id.0 % 16));
        self.len -= 1;
        self.tighten(block);
        Ok(())
    }

    fn update(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        if !self.holds(id) {
            return Err(IndexError::Unknown(id));
        }
        if !bounds.is_valid() {
            return Err(IndexError::InvalidBounds(id));
        }
        let block = id.index() / 16;
        self.levels[0][block].set(id.index() % 16, bounds);
        self.tighten(block);
        self.upkeep.adjusted += 1;
        Ok(())
    }

    fn commit(&mut self) {}

    fn frustum_cull(&self, frustum: &Frustum, draw_list: &mut Vec<PolygonId>) -> WorkCounts {
        let out = IdWriter::new(draw_list);
        let planes = PlaneSet::new(frustum);
        let (work, out) = self.backend.run(Cull { index: self, planes, out, work: WorkCounts::default() });
        out.finish();
        work
    }

    fn frustum_cull_blocks(&self, frustum: &Frustum, visible: &mut VisibleBlocks) -> WorkCounts {
        let out = MaskWriter::new(visible.masks_for(self.inserted.len() * BLOCK));
        let planes = PlaneSet::new(frustum);
        let (work, out) = self.backend.run(Cull { index: self, planes, out, work: WorkCounts::default() });
        let (blocks, polygons) = out.finish();
        visible.note_filled(blocks, polygons);
        work
    }

    fn traverse(&self, frustum: &Frustum, visitor: &mut dyn Visitor) -> WorkCounts {
        let mut walk = Walk { frustum, visitor, work: WorkCounts::default(), seen: Vec::new() };
        if let Some(top) = self.top() {
            self.visit(&mut walk, top, 0, PlaneMask::ALL, Visit::Descend);
        }
        walk.work
    }

    fn upkeep(&self) -> Option<Upkeep> {
        Some(self.upkeep)
    }

    fn bytes(&self) -> usize {
        let boxes: usize = self.levels.iter().chain(&self.spare).map(Vec::capacity).sum();
        boxes * size_of::<Boxes<16>>() + self.inserted.capacity() * size_of::<u16>()
    }

    fn clear(&mut self) {
        for level in &mut self.levels {
            level.clear();
        }
        self.inserted.clear();
        self.len = 0;
    }
}
