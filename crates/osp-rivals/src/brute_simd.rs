use osp::{
    index::{
        Backend, IndexConfig, IndexError, Node, SpatialIndex, Visit, Visitor, WorkCounts,
        kernels::{Boxes, IdWriter, Kernel, MaskWriter, PlaneSet, RunSink, WithKernel, admit},
    },
    math::{Aabb, Containment, Frustum},
    polygon::{BLOCK, PolygonId, VisibleBlocks},
};

/// A SIMD loop over all boxes in the order of their ids, sixteen at a time, without any structure. A tree has to be
/// faster.
#[derive(Clone, Debug)]
pub struct BruteSimd {
    backend: Backend,
    blocks: Vec<Boxes<16>>,
    /// For each block, a bit for each inserted id.
    inserted: Vec<u16>,
    len: usize,
}

impl BruteSimd {
    pub fn new(config: &IndexConfig) -> Self {
        let blocks = config.room().div_ceil(16);
        Self {
            backend: Backend::detect(),
            blocks: Vec::with_capacity(blocks),
            inserted: Vec::with_capacity(blocks),
            len: 0,
        }
    }

    /// Makes room for a polygon and inserts it. As a tail call, it makes other insertions save no registers.
    #[cold]
    fn insert_beyond(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        self.blocks.resize(id.index() / 16 + 1, Boxes::EMPTY);
        self.inserted.resize(id.index() / 16 + 1, 0);
        self.insert(id, bounds)
    }

    fn holds(&self, id: PolygonId) -> bool {
        self.inserted.get(id.index() / 16).is_some_and(|inserted| inserted >> (id.0 % 16) & 1 == 1)
    }
}

struct Pass<'a, S> {
    index: &'a BruteSimd,
    planes: PlaneSet,
    out: S,
}

impl<S: RunSink> WithKernel for Pass<'_, S> {
    type Output = (WorkCounts, S);

    #[inline(always)]
    fn run<K: Kernel>(mut self, kernel: K) -> (WorkCounts, S) {
        let mut work = WorkCounts::default();
        let before = self.out.found();
        for (i, (boxes, &inserted)) in self.index.blocks.iter().zip(&self.index.inserted).enumerate() {
            let inserted = u32::from(inserted);
            let seen = inserted & !self.planes.behind_any(kernel, boxes);
            self.out.push_run(kernel, i as u32 * 16, seen);
        }
        work.reported = (self.out.found() - before) as u64;
        work.boxes = self.index.len as u64;
        work.planes = 6 * work.boxes;
        (work, self.out)
    }
}

impl SpatialIndex for BruteSimd {
    fn name(&self) -> &'static str {
        "brute-simd"
    }

    fn len(&self) -> usize {
        self.len
    }

    fn insert(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        admit(id, bounds)?;
        let (block, lane) = (id.index() / 16, id.index() % 16);
        if block >= self.blocks.len() {
            return self.insert_beyond(id, bounds);
        }
        if self.inserted[block] >> lane & 1 == 1 {
            return Err(IndexError::Duplicate(id));
        }
        self.blocks[block].set(lane, bounds);
        self.inserted[block] |= 1 << lane;
        self.len += 1;
        Ok(())
    }

    fn remove(&mut self, id: PolygonId) -> Result<(), IndexError> {
        if !self.holds(id) {
            return Err(IndexError::Unknown(id));
        }
        self.inserted[id.index() / 16] &= !(1 << (id.0 % 16));
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
        self.blocks[id.index() / 16].set(id.index() % 16, bounds);
        Ok(())
    }

    fn commit(&mut self) {}

    fn frustum_cull(&self, frustum: &Frustum, draw_list: &mut Vec<PolygonId>) -> WorkCounts {
        let out = IdWriter::new(draw_list);
        let (work, out) = self.backend.run(Pass { index: self, planes: PlaneSet::new(frustum), out });
        out.finish();
        work
    }

    fn frustum_cull_blocks(&self, frustum: &Frustum, visible: &mut VisibleBlocks) -> WorkCounts {
        let out = MaskWriter::new(visible.masks_for(self.inserted.len() * BLOCK));
        let (work, out) = self.backend.run(Pass { index: self, planes: PlaneSet::new(frustum), out });
        let (blocks, polygons) = out.finish();
        visible.note_filled(blocks, polygons);
        work
    }

    fn traverse(&self, frustum: &Frustum, visitor: &mut dyn Visitor) -> WorkCounts {
        let planes = PlaneSet::new(frustum);
        let mut work = WorkCounts::default();
        for (i, (boxes, &inserted)) in
            self.blocks.iter().zip(&self.inserted).enumerate().filter(|(_, (_, f))| **f != 0)
        {
            let mut ids = Vec::new();
            let first = i as u32 * 16;
            let bounds = boxes.around(u32::from(inserted));
            let containment = frustum.classify(&bounds);
            work.nodes += 1;
            work.boxes += 1;
            work.planes += 6;
            let polygons = inserted.count_ones() as usize;
            if containment == Containment::Outside {
                continue;
            }
            let node = Node { bounds: &bounds, depth: 0, containment, polygons, is_leaf: true };
            let answer = visitor.node(&node);
            if answer == Visit::Skip {
                continue;
            }
            let one = One { planes: &planes, boxes, inserted: u32::from(inserted) };
            let seen = self.backend.run(one);
            ids.extend((0..16).filter(|lane| seen >> lane & 1 == 1).map(|lane| PolygonId(first + lane)));
            work.boxes += polygons as u64;
            work.planes += 6 * polygons as u64;
            work.reported += ids.len() as u64;
            if !ids.is_empty() {
                visitor.polygons(&ids, answer);
            }
        }
        work
    }

    fn bytes(&self) -> usize {
        self.blocks.capacity() * size_of::<Boxes<16>>() + self.inserted.capacity() * size_of::<u16>()
    }

    fn clear(&mut self) {
        self.blocks.clear();
        self.inserted.clear();
        self.len = 0;
    }
}

/// The input of a test of one block against all planes.
struct One<'a> {
    planes: &'a PlaneSet,
    boxes: &'a Boxes<16>,
    inserted: u32,
}

impl WithKernel for One<'_> {
    type Output = u32;

    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) -> u32 {
        self.inserted & !self.planes.behind_any(kernel, self.boxes)
    }
}
