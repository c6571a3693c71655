//! The loose octree: cells twice as large as their spacing, so that a polygon's size says its level and its centre its
//! cell.
//!
//! Source: Thatcher Ulrich, "Loose Octrees" (Game Programming Gems, 2000), looseness 2. All levels are preallocated flat
//! arrays (eight bytes a cell), so filing is O(1) but for the counts of the cells above, which let a query pass over
//! what is empty.
//!
//! # Differences from the source
//! * Rounding may leave a polygon a hair outside the loose cell that its size and centre ask for; it then goes a level
//!   up.
//! * A polygon whose centre is outside the root, or that is larger than the root, is kept in a list beside the tree and
//!   tested by itself. (The source leaves that open; many of them make a linear scan.)

mod cell;
mod query;
mod validate;

use super::{
    DrawList, IndexConfig, IndexError, SpatialIndex, Visitor, WorkCounts,
    buckets::{self, Buckets, NOWHERE, Spot},
    by_id::{ById, FiledBoxes},
    flat_tree::Item,
};
use crate::{
    math::{Aabb, Frustum},
    scene::PolygonId,
};
use cell::{Cell, LooseGrid};

/// Polygons of a bucket: cells hold few.
const LANES: usize = 8;

/// The deepest tree that is made: 2.4 million cells, 19 MB.
const MAX_MAX_DEPTH: u32 = 7;

/// How a loose octree is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LooseOctreeConfig {
    /// Levels below the root, at most 7. More: fewer polygons a cell, more cells to look at. Polygons smaller than the
    /// smallest cells all lie on the last level.
    pub max_depth: u32,
}

impl Default for LooseOctreeConfig {
    fn default() -> Self {
        Self { max_depth: 5 }
    }
}

/// The tree.
#[derive(Debug)]
pub struct LooseOctree {
    grid: LooseGrid,
    /// First bucket of every cell, level by level; the last one is of the list beside the tree.
    chains: Vec<u32>,
    /// Polygons in every cell and below.
    counts: Vec<u32>,
    buckets: Buckets<LANES>,
    filed: FiledBoxes,
    spot: ById<Spot>,
}

impl LooseOctree {
    /// An empty tree over the root of `index`.
    pub fn new(config: LooseOctreeConfig, index: &IndexConfig) -> Self {
        let grid = LooseGrid::new(&index.root, config.max_depth.min(MAX_MAX_DEPTH));
        let mut spot = ById::new(NOWHERE);
        spot.reserve(index.capacity);
        Self {
            grid,
            chains: vec![buckets::NONE; grid.cell_count() + 1],
            counts: vec![0; grid.cell_count() + 1],
            buckets: Buckets::with_capacity(2 * index.capacity),
            filed: FiledBoxes::with_capacity(index.capacity),
            spot,
        }
    }

    /// Number of polygons that no cell of the tree can hold.
    pub fn outside_root(&self) -> usize {
        self.counts[self.outside()] as usize
    }

    /// The place of the list beside the tree.
    fn outside(&self) -> usize {
        self.chains.len() - 1
    }

    fn count(&mut self, cell: usize, by: i32) {
        if cell == self.outside() {
            self.counts[cell] = self.counts[cell].wrapping_add_signed(by);
            return;
        }
        let mut next = Some(self.grid.cell_at(cell));
        while let Some(cell) = next {
            let count = &mut self.counts[self.grid.number(&cell)];
            *count = count.wrapping_add_signed(by);
            next = cell.parent();
        }
    }

    fn cell_for(&self, bounds: &Aabb) -> usize {
        self.grid.place(bounds).map_or(self.outside(), |cell: Cell| self.grid.number(&cell))
    }

    fn file(&mut self, id: PolygonId, bounds: &Aabb) {
        let cell = self.cell_for(bounds);
        let spot = self.buckets.push(&mut self.chains[cell], cell as u32, &Item { bounds: *bounds, id });
        self.spot.set(id, spot);
        self.count(cell, 1);
    }

    fn take_out(&mut self, id: PolygonId) {
        let spot = self.spot.get(id);
        self.spot.set(id, NOWHERE);
        let cell = self.buckets.owner(spot) as usize;
        if let Some(moved) = self.buckets.remove(&mut self.chains[cell], spot) {
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
        self.filed.len()
    }

    fn insert(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        self.filed.insert(id, bounds)?;
        self.file(id, bounds);
        Ok(())
    }

    fn remove(&mut self, id: PolygonId) -> Result<(), IndexError> {
        self.filed.remove(id)?;
        self.take_out(id);
        Ok(())
    }

    fn update(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        self.filed.update(id, bounds)?;
        let spot = self.spot.get(id);
        if self.cell_for(bounds) == self.buckets.owner(spot) as usize {
            self.buckets.set_bounds(spot, bounds);
        } else {
            self.take_out(id);
            self.file(id, bounds);
        }
        Ok(())
    }

    fn commit(&mut self) {}

    fn frustum_cull(&self, frustum: &Frustum, draw_list: &mut DrawList) -> WorkCounts {
        self.cull(frustum, draw_list)
    }

    fn traverse(&self, frustum: &Frustum, visitor: &mut dyn Visitor) -> WorkCounts {
        self.visit(frustum, visitor)
    }

    fn validate(&self) -> Result<(), String> {
        self.check()
    }

    fn bytes(&self) -> usize {
        (self.chains.capacity() + self.counts.capacity()) * size_of::<u32>()
            + self.buckets.bytes()
            + self.filed.bytes()
            + self.spot.bytes()
    }

    fn clear(&mut self) {
        self.chains.fill(buckets::NONE);
        self.counts.fill(0);
        self.buckets.clear();
        self.filed.clear();
        self.spot.clear();
    }
}
