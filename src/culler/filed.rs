use glam::Vec3;

use super::keys::{Key, Places, Slot};
use crate::{
    index::{DrawList, IndexConfig, IndexError, Osp, SpatialIndex},
    math::{Aabb, Frustum},
    polygon::{BLOCK, ConvexPolygon, Geometry, PolygonId},
};

/// Moving objects that the index updates together: their boxes are still in the cache.
const MOST_TOGETHER: usize = 256;

/// With fewer coming objects, their numbers are in order of arrival.
const LEAST_SORTED: usize = 32;

/// The index is built again if at least this many objects come together, and [`MANY_TIMES`] as many as it has. Smaller:
/// more often.
const LEAST_MANY: usize = 1024;
const MANY_TIMES: usize = 4;

/// Blocks of objects in order of arrival may be this many times as large as blocks in the order of space. Larger: more
/// boxes that contain much of the world. Smaller: objects that move together have numbers far apart.
const MOST_LARGER: f64 = 8.0;

/// Cells along an axis in which objects that come together are sorted, as a power of two.
const CELL_BITS: u32 = 10;

/// The index, and buffers for the next commit, reused for their memory.
#[derive(Debug)]
pub(super) struct Filed {
    index: Osp,
    moving: Vec<(PolygonId, Aabb)>,
    coming: Vec<(Slot, Aabb)>,
    /// Position of each coming object on a curve through space, and its place among them.
    order: Vec<(u32, u32)>,
    refused: Vec<IndexError>,
}

impl Filed {
    pub(super) fn new() -> Self {
        let index = Osp::new(&IndexConfig { capacity: 0, ..IndexConfig::default() });
        Self { index, moving: Vec::new(), coming: Vec::new(), order: Vec::new(), refused: Vec::new() }
    }

    pub(super) fn index(&self) -> &Osp {
        &self.index
    }

    /// The box of a number.
    pub(super) fn get(&self, number: PolygonId) -> Option<Aabb> {
        self.index.bounds(number)
    }

    /// Takes changes, only the last one of each object; [`Filed::commit`] ends the batch.
    pub(super) fn take_all<K: Key>(&mut self, keys: &mut K::Places, changes: &[(Slot, Aabb)]) {
        let mut left = changes;
        while let Some((&(slot, bounds), behind)) = left.split_first() {
            if !K::Places::ARE_NUMBERED {
                // Slots are numbers: moved objects are passed on as they are.
                let moves = |change: &&(Slot, Aabb)| !change.1.is_empty() && keys.number(change.0).is_some();
                let count = left.iter().take(MOST_TOGETHER).take_while(moves).count();
                if count > 0 {
                    self.index.update_all(&left[..count], &mut self.refused);
                    left = &left[count..];
                    continue;
                }
            }
            self.take::<K>(keys, slot, bounds);
            left = behind;
        }
    }

    fn take<K: Key>(&mut self, keys: &mut K::Places, slot: Slot, bounds: Aabb) {
        match keys.number(slot) {
            Some(number) if bounds.is_empty() => {
                // No error is possible: an object with a number is in the index.
                let _ = self.index.remove(number);
                keys.free(slot);
            }
            Some(number) => {
                self.moving.push((number, bounds));
                if self.moving.len() == MOST_TOGETHER {
                    self.move_all();
                }
            }
            None if bounds.is_empty() => {}
            None => self.coming.push((slot, bounds)),
        }
    }

    pub(super) fn commit<K: Key>(&mut self, keys: &mut K::Places) {
        self.move_all();
        self.insert::<K>(keys);
        // No valid box is refused, whether its number is in the index or not.
        debug_assert!(self.refused.is_empty(), "{:?}", self.refused);
        self.refused.clear();
        self.index.commit();
    }

    fn move_all(&mut self) {
        self.index.update_all(&self.moving, &mut self.refused);
        self.moving.clear();
    }

    fn insert<K: Key>(&mut self, keys: &mut K::Places) {
        if self.coming.len() >= LEAST_MANY && self.coming.len() / MANY_TIMES >= self.index.len() {
            self.expect_many();
        }
        let are_sorted = K::Places::ARE_NUMBERED && self.coming.len() >= LEAST_SORTED && self.sort();
        if self.coming.len() >= LEAST_SORTED {
            keys.sort_numbers(self.coming.len());
        }
        for i in 0..self.coming.len() {
            let (slot, bounds) = self.coming[if are_sorted { self.order[i].1 as usize } else { i }];
            self.refused.extend(self.index.insert(keys.give_number(slot), &bounds).err());
        }
        self.coming.clear();
    }

    /// Builds the index again if the coming objects are many more than the present ones: neither the world's size nor
    /// the number of objects is known beforehand.
    fn expect_many(&mut self) {
        let mut there = DrawList::new();
        self.index.frustum_cull(&Frustum::everything(), &mut there);
        let there: Vec<_> = there.ids().iter().filter_map(|&id| Some((id, self.index.bounds(id)?))).collect();
        let boxes =
            self.coming.iter().map(|(_, bounds)| bounds).chain(there.iter().map(|(_, bounds)| bounds));
        let root = boxes.fold(Aabb::EMPTY, |around, bounds| around.union(bounds));
        let capacity = self.coming.len() + there.len();
        self.index = Osp::new(&IndexConfig { root, capacity });
        self.refused.extend(there.iter().filter_map(|(id, bounds)| self.index.insert(*id, bounds).err()));
    }

    /// Sorts coming objects in the order of space: sixteen objects with consecutive numbers are tested together if
    /// they lie side by side. Returns false if their order of arrival has this property already.
    fn sort(&mut self) -> bool {
        let around = self.coming.iter().fold(Aabb::EMPTY, |around, (_, bounds)| around.union(bounds));
        let root = Aabb::cube(around.center(), around.extent().max_element());
        let codes = self.coming.iter().map(|(_, bounds)| place_in_order(bounds.center(), &root));
        self.order.clear();
        self.order.extend(codes.zip(0..));
        self.order.sort_unstable();
        let size = |order: &mut dyn Iterator<Item = usize>| {
            let mut size = 0.0;
            loop {
                let block = order.take(BLOCK).fold(Aabb::EMPTY, |block, i| block.union(&self.coming[i].1));
                if block.is_empty() {
                    return size;
                }
                size += f64::from(block.extent().length());
            }
        };
        let as_they_come = size(&mut (0..self.coming.len()));
        let sorted = size(&mut self.order.iter().map(|(_, i)| *i as usize));
        // An engine's own order also shows which objects move together.
        as_they_come > sorted * MOST_LARGER
    }
}

/// Objects consist of their boxes only.
impl Geometry for Filed {
    fn id_end(&self) -> usize {
        PolygonId::LIMIT as usize
    }

    fn is_present(&self, id: PolygonId) -> bool {
        self.get(id).is_some()
    }

    fn bounds(&self, id: PolygonId) -> Aabb {
        self.get(id).unwrap_or(Aabb::EMPTY)
    }

    fn polygon(&self, _: PolygonId) -> Option<ConvexPolygon> {
        None
    }

    fn may_occlude(&self, _: PolygonId) -> bool {
        false
    }
}

/// Position of a point on a curve through all cells of a cube, on which neighbours are close: the interleaved bits of
/// its cell (Morton, 1966).
fn place_in_order(point: Vec3, cube: &Aabb) -> u32 {
    let cells = (point - cube.min) / cube.extent() * (1 << CELL_BITS) as f32;
    let spread = |cell: f32| {
        // A cube without a size has one cell.
        let cell = (cell as u32).min((1 << CELL_BITS) - 1);
        (0..CELL_BITS).fold(0, |bits, bit| bits | (cell >> bit & 1) << (3 * bit))
    };
    spread(cells.x) | spread(cells.y) << 1 | spread(cells.z) << 2
}
