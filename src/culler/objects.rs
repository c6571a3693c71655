use std::hash::BuildHasher;

use glam::Vec3;

use super::keys::{Key, Places, Slot};
use crate::{
    index::{IndexConfig, IndexError, Osp, SpatialIndex, kernels::ROOM_BEHIND},
    math::{Aabb, Frustum},
    polygon::{BLOCK, ById, ConvexPolygon, Geometry, PolygonId},
};

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

/// The boxes of all objects: in the index, and of new objects, which the next commit inserts.
#[derive(Clone, Debug)]
pub(super) struct Objects {
    index: Osp,
    /// The objects that fill the world. They are not in the index.
    endless: Vec<(Slot, PolygonId)>,
    /// The new objects; an empty box for one that was removed again.
    coming: Vec<(Slot, Aabb)>,
    /// For the slot of each new object, its position in `coming`; [`NOT_COMING`] for the others.
    positions: ById<u32>,
    /// Number of objects in `coming` that were removed again.
    gone: usize,
    /// For each new object, its Morton code and its index in `coming`.
    order: Vec<(u32, u32)>,
    refused: Vec<IndexError>,
}

const NOT_COMING: u32 = u32::MAX;

/// The box of an object that fills the world.
const ENDLESS: Aabb = Aabb::new(Vec3::NEG_INFINITY, Vec3::INFINITY);

impl Objects {
    pub(super) fn new() -> Self {
        Self {
            index: Osp::new(&IndexConfig { capacity: 0, ..IndexConfig::default() }),
            endless: Vec::new(),
            coming: Vec::new(),
            positions: ById::new(NOT_COMING),
            gone: 0,
            order: Vec::new(),
            refused: Vec::new(),
        }
    }

    pub(super) fn index(&self) -> &Osp {
        &self.index
    }

    /// Number of objects with a box.
    pub(super) fn len(&self) -> usize {
        self.index.len() + self.endless.len() + self.coming.len() - self.gone
    }

    /// The box of the object with this number; `None` if no object has it.
    #[inline]
    pub(super) fn get(&self, number: PolygonId) -> Option<Aabb> {
        let endless = || self.endless().any(|of| of == number).then_some(ENDLESS);
        self.index.bounds(number).or_else(endless)
    }

    /// The objects that fill the world.
    pub(super) fn endless(&self) -> impl Iterator<Item = PolygonId> {
        self.endless.iter().map(|&(_, number)| number)
    }

    /// The numbers of all objects that have one.
    pub(super) fn numbers(&self) -> Vec<PolygonId> {
        let mut numbers = Vec::with_capacity(self.index.len() + ROOM_BEHIND);
        self.index.frustum_cull(&Frustum::everything(), &mut numbers);
        numbers.extend(self.endless());
        numbers
    }

    /// The new objects.
    pub(super) fn coming(&self) -> impl Iterator<Item = (Slot, Aabb)> {
        self.coming.iter().copied().filter(|(_, bounds)| !bounds.is_empty())
    }

    pub(super) fn clear(&mut self) {
        self.index.clear();
        self.endless.clear();
        self.coming.clear();
        self.positions.clear();
        self.gone = 0;
    }

    pub(super) fn reserve(&mut self, objects: usize) {
        self.coming.reserve(objects);
    }

    /// The box of a new object.
    pub(super) fn coming_box(&self, slot: Slot) -> Option<Aabb> {
        Some(self.coming.get(self.positions.get(slot) as usize)?.1)
    }

    /// Sets the valid box of an object. A new object gets a number with the next commit.
    #[inline]
    pub(super) fn set(&mut self, slot: Slot, number: Option<PolygonId>, bounds: &Aabb) {
        if !number.is_some_and(|number| self.index.move_to(number, bounds)) {
            self.arrive(slot, bounds);
        }
    }

    /// Makes an object endless. It gets a number with the next commit, unless it has one.
    pub(super) fn set_endless(&mut self, slot: Slot, number: Option<PolygonId>) {
        if self.endless.iter().all(|(of, _)| *of != slot) {
            let _ = number.map(|number| self.index.remove(number));
            self.arrive(slot, &ENDLESS);
        }
    }

    #[inline(never)]
    fn arrive(&mut self, slot: Slot, bounds: &Aabb) {
        self.endless.retain(|(of, _)| *of != slot);
        match self.coming.get_mut(self.positions.get(slot) as usize) {
            Some(coming) => coming.1 = *bounds,
            None => {
                self.positions.set(slot, self.coming.len() as u32);
                self.coming.push((slot, *bounds));
            }
        }
    }

    /// Removes the box of an object. Returns whether there was one.
    pub(super) fn remove(&mut self, slot: Slot, number: Option<PolygonId>) -> bool {
        if number.is_some_and(|number| self.index.remove(number).is_ok()) {
            return true;
        }
        if let Some(at) = self.endless.iter().position(|(of, _)| *of == slot) {
            self.endless.swap_remove(at);
            return true;
        }
        let Some(coming) = self.coming.get_mut(self.positions.get(slot) as usize) else { return false };
        coming.1 = Aabb::EMPTY;
        self.gone += 1;
        self.positions.set(slot, NOT_COMING);
        true
    }

    pub(super) fn commit<K: Key, S: BuildHasher>(&mut self, keys: &mut K::Places<S>) {
        if !self.coming.is_empty() {
            self.insert::<K, S>(keys);
        }
        self.index.commit();
    }

    fn insert<K: Key, S: BuildHasher>(&mut self, keys: &mut K::Places<S>) {
        if self.gone > 0 {
            self.coming.retain(|(_, bounds)| !bounds.is_empty());
        }
        if self.coming.len() >= LEAST_MANY && self.coming.len() / MANY_TIMES >= self.index.len() {
            self.rebuild_for_new_objects();
        }
        let are_sorted = K::Places::<S>::ARE_NUMBERED && self.coming.len() >= LEAST_SORTED && self.sort();
        if self.coming.len() >= LEAST_SORTED {
            keys.sort_numbers(self.coming.len());
        }
        for i in 0..self.coming.len() {
            let (slot, bounds) = self.coming[if are_sorted { self.order[i].1 as usize } else { i }];
            self.positions.set(slot, NOT_COMING);
            let number = keys.give_number(slot);
            if bounds.is_valid() {
                self.refused.extend(self.index.insert(number, &bounds).err());
            } else {
                self.endless.push((slot, number));
            }
        }
        // The index accepts every valid box.
        debug_assert!(self.refused.is_empty(), "{:?}", self.refused);
        self.refused.clear();
        self.coming.clear();
        self.gone = 0;
    }

    /// Rebuilds the index with a root and a capacity for the present and the new objects. Neither is known beforehand.
    fn rebuild_for_new_objects(&mut self) {
        let there: Vec<_> =
            self.numbers().into_iter().filter_map(|id| Some((id, self.index.bounds(id)?))).collect();
        let boxes = self
            .coming
            .iter()
            .map(|(_, bounds)| bounds)
            .filter(|bounds| bounds.is_valid())
            .chain(there.iter().map(|(_, bounds)| bounds));
        let root = boxes.fold(Aabb::EMPTY, |around, bounds| around.union(bounds));
        let capacity = self.coming.len() + there.len();
        self.index = Osp::new(&IndexConfig { root, capacity });
        self.refused.extend(there.iter().filter_map(|(id, bounds)| self.index.insert(*id, bounds).err()));
    }

    /// Sorts new objects in spatial order, because queries test sixteen objects with consecutive numbers by one box.
    /// Returns false if the order of arrival is about as good.
    fn sort(&mut self) -> bool {
        let finite = self.coming.iter().filter(|(_, bounds)| bounds.is_valid());
        let around = finite.fold(Aabb::EMPTY, |around, (_, bounds)| around.union(bounds));
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
impl Geometry for Objects {
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
