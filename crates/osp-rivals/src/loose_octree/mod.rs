//! The loose octree: cells are twice as large as their spacing. So the size of a polygon determines its level, and its
//! centre determines its cell.
//!
//! Source: Thatcher Ulrich, "Loose Octrees" (Game Programming Gems, 2000), looseness 2. All levels are preallocated
//! flat arrays (eight bytes a cell). So insertion takes O(1), except for updating the counts of the cells above. A
//! query skips empty cells by these counts.
//!
//! # Differences from the source
//! * Because of rounding, a polygon may reach a little beyond the loose cell of its size and centre. It is then stored a
//!   level higher.
//! * A separate list contains the polygons with a centre outside the root, or larger than the root. A query tests each
//!   polygon of the list. (The source leaves this case open; many such polygons make a linear scan.)

mod cell;
mod query;

use cell::LooseGrid;

use super::{
    buckets::{self, Buckets, NOWHERE, Spot},
    by_id::{ById, InsertedBoxes},
    item::Item,
};
use osp::{
    index::{IndexConfig, IndexError, SpatialIndex, Upkeep, Visitor, WorkCounts, kernels::IdWriter},
    math::{Aabb, Frustum},
    polygon::PolygonId,
};

/// Number of blocks of sixteen polygons in a bucket. A cell has about as many polygons as a bucket.
const BLOCKS: usize = 2;

/// Largest depth of a tree. A tree of this depth has 2.4 million cells and takes 19 MB.
const MAX_MAX_DEPTH: u32 = 7;

/// Number of levels below the root at which each of the smallest cells has about 32 polygons. With more levels, cells
/// have fewer polygons, and queries visit more cells. Polygons smaller than the smallest cells lie on the last level.
fn max_depth(polygons: usize) -> u32 {
    let cells = (polygons / 32).max(1);
    cells.ilog2().div_ceil(3).clamp(2, MAX_MAX_DEPTH)
}

/// The state of a cell.
#[derive(Clone, Copy, Debug)]
struct Slot {
    /// The first bucket of the cell's own polygons.
    chain: u32,
    polygons: u32,
}

impl Slot {
    const EMPTY: Self = Self { chain: buckets::NONE, polygons: 0 };
}

#[derive(Debug)]
pub struct LooseOctree {
    grid: LooseGrid,
    /// The state of every cell, by its number. The last entry is the list of polygons outside the tree.
    slots: Vec<Slot>,
    buckets: Buckets<BLOCKS>,
    inserted: InsertedBoxes,
    spot: ById<Spot>,
    upkeep: Upkeep,
}

impl LooseOctree {
    /// An empty tree over the root of `index`.
    pub fn new(index: &IndexConfig) -> Self {
        let grid = LooseGrid::new(&index.root, max_depth(index.room()));
        let mut spot = ById::new(NOWHERE);
        spot.reserve(index.room());
        Self {
            grid,
            slots: vec![Slot::EMPTY; grid.cell_count() + 1],
            buckets: Buckets::with_capacity(2 * index.room()),
            inserted: InsertedBoxes::with_capacity(index.room()),
            spot,
            upkeep: Upkeep::default(),
        }
    }

    /// Index in `slots` of the list of polygons outside the tree.
    fn outside(&self) -> usize {
        self.slots.len() - 1
    }

    /// Adds `by` to the counts of a cell and of the cells above it.
    fn count(&mut self, mut cell: usize, by: i32) {
        let outside = self.outside();
        loop {
            let count = &mut self.slots[cell].polygons;
            *count = count.wrapping_add_signed(by);
            if cell == 0 || cell == outside {
                return;
            }
            cell = (cell - 1) / 8;
        }
    }

    fn cell_for(&self, bounds: &Aabb) -> usize {
        self.grid.place(bounds).map_or(self.outside(), |cell| cell.number as usize)
    }

    fn insert_polygon(&mut self, id: PolygonId, bounds: &Aabb) {
        self.upkeep.inserted += 1;
        let cell = self.cell_for(bounds);
        let spot = self.buckets.push(&mut self.slots[cell].chain, cell as u32, &Item { bounds: *bounds, id });
        self.spot.set(id, spot);
        self.count(cell, 1);
    }

    fn take_out(&mut self, id: PolygonId) {
        let spot = self.spot.get(id);
        self.spot.set(id, NOWHERE);
        let cell = self.buckets.owner(spot) as usize;
        if let Some(moved) = self.buckets.remove(&mut self.slots[cell].chain, spot) {
            self.spot.set(moved, spot);
        }
        self.count(cell, -1);
    }
}

impl SpatialIndex for LooseOctree {
    fn name(&self) -> &'static str {
        "loose-octree"
    }

    fn len(&self) -> usize {
        self.inserted.len()
    }

    fn insert(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        self.inserted.insert(id, bounds)?;
        self.insert_polygon(id, bounds);
        Ok(())
    }

    fn remove(&mut self, id: PolygonId) -> Result<(), IndexError> {
        self.inserted.remove(id)?;
        self.take_out(id);
        Ok(())
    }

    fn update(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        self.inserted.update(id, bounds)?;
        let spot = self.spot.get(id);
        if self.cell_for(bounds) == self.buckets.owner(spot) as usize {
            self.buckets.set_bounds(spot, bounds);
            self.upkeep.adjusted += 1;
        } else {
            self.take_out(id);
            self.insert_polygon(id, bounds);
        }
        Ok(())
    }

    fn commit(&mut self) {}

    fn frustum_cull(&self, frustum: &Frustum, draw_list: &mut Vec<PolygonId>) -> WorkCounts {
        IdWriter::append(draw_list, |out| self.cull_all(frustum, out))
    }

    fn traverse(&self, frustum: &Frustum, visitor: &mut dyn Visitor) -> WorkCounts {
        self.visit(frustum, visitor)
    }

    fn upkeep(&self) -> Option<Upkeep> {
        Some(self.upkeep)
    }

    fn bytes(&self) -> usize {
        self.slots.capacity() * size_of::<Slot>()
            + self.buckets.bytes()
            + self.inserted.bytes()
            + self.spot.bytes()
    }

    fn clear(&mut self) {
        self.slots.fill(Slot::EMPTY);
        self.buckets.clear();
        self.inserted.clear();
        self.spot.clear();
    }
}
