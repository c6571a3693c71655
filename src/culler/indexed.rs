use glam::Vec3;

use super::keys::{Key, Places, Slot};
use crate::{
    index::{IndexConfig, IndexError, Osp, SpatialIndex},
    math::{Aabb, Frustum},
    polygon::{BLOCK, ConvexPolygon, Geometry, PolygonId},
};

/// Largest number of moving objects that the index updates together, so that their boxes are still in the cache.
const MOST_TOGETHER: usize = 256;

/// Fewer new objects than this get numbers in order of arrival.
const LEAST_SORTED: usize = 32;

/// A commit rebuilds the index if it inserts at least this many objects, and at least [`MANY_TIMES`] times the number
/// of present objects. If these limits are smaller, the index is rebuilt more often.
const LEAST_MANY: usize = 1024;
const MANY_TIMES: usize = 4;

/// New objects keep their order of arrival if the boxes around their blocks are at most this many times as large as in
/// spatial order. If it is larger, more blocks extend through much of the world. If it is smaller, more objects that move
/// together get numbers far apart.
const MOST_LARGER: f64 = 8.0;

/// Number of bits for each axis of the Morton codes that sort new objects.
const CELL_BITS: u32 = 10;

/// The index, and reused buffers for the next commit.
#[derive(Debug)]
pub(super) struct Indexed {
    index: Osp,
    moving: Vec<(PolygonId, Aabb)>,
    coming: Vec<(Slot, Aabb)>,
    /// For each new object, its Morton code and its index in `coming`.
    order: Vec<(u32, u32)>,
    refused: Vec<IndexError>,
}

impl Indexed {
    pub(super) fn new() -> Self {
        let index = Osp::new(&IndexConfig { capacity: 0, ..IndexConfig::default() });
        Self { index, moving: Vec::new(), coming: Vec::new(), order: Vec::new(), refused: Vec::new() }
    }

    pub(super) fn index(&self) -> &Osp {
        &self.index
    }

    /// The box of the object with this number; `None` if it is not in the index.
    pub(super) fn get(&self, number: PolygonId) -> Option<Aabb> {
        self.index.bounds(number)
    }

    /// Passes moves and removals to the index, and collects new objects; [`Indexed::commit`] inserts these.
    pub(super) fn take_all<K: Key>(&mut self, keys: &mut K::Places, changes: &[(Slot, Aabb)]) {
        let mut left = changes;
        while let Some((&(slot, bounds), behind)) = left.split_first() {
            if !K::Places::ARE_NUMBERED {
                // Each slot is the object's number in the index, so moves are passed without conversion.
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
                // This returns no error, because an object with a number is in the index.
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
        // The index accepts every valid box, for new objects and for moves.
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
            self.rebuild_for_new_objects();
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

    /// Rebuilds the index with a root and a capacity for the present and the new objects. Neither is known beforehand.
    fn rebuild_for_new_objects(&mut self) {
        let mut there = Vec::new();
        self.index.frustum_cull(&Frustum::everything(), &mut there);
        let there: Vec<_> = there.into_iter().filter_map(|id| Some((id, self.index.bounds(id)?))).collect();
        let boxes =
            self.coming.iter().map(|(_, bounds)| bounds).chain(there.iter().map(|(_, bounds)| bounds));
        let root = boxes.fold(Aabb::EMPTY, |around, bounds| around.union(bounds));
        let capacity = self.coming.len() + there.len();
        self.index = Osp::new(&IndexConfig { root, capacity });
        self.refused.extend(there.iter().filter_map(|(id, bounds)| self.index.insert(*id, bounds).err()));
    }

    /// Sorts new objects in spatial order, because queries test sixteen objects with consecutive numbers by one box.
    /// Returns false if the order of arrival is about as good.
    fn sort(&mut self) -> bool {
        let around = self.coming.iter().fold(Aabb::EMPTY, |around, (_, bounds)| around.union(bounds));
        let root = Aabb::cube(around.center(), around.extent().max_element());
        let codes = self.coming.iter().map(|(_, bounds)| morton_code(bounds.center(), &root));
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
        // An engine's own order is preferred, because it also shows which objects move together.
        as_they_come > sorted * MOST_LARGER
    }
}

/// Supplies the boxes of the objects to the index.
impl Geometry for Indexed {
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

/// The Morton code of a point in a cube: the interleaved bits of the coordinates of the point's cell (Morton, 1966).
fn morton_code(point: Vec3, cube: &Aabb) -> u32 {
    let cells = (point - cube.min) / cube.extent() * (1 << CELL_BITS) as f32;
    let spread = |cell: f32| {
        // A cube without a size has one cell.
        let cell = (cell as u32).min((1 << CELL_BITS) - 1);
        (0..CELL_BITS).fold(0, |bits, bit| bits | (cell >> bit & 1) << (3 * bit))
    };
    spread(cells.x) | spread(cells.y) << 1 | spread(cells.z) << 2
}
