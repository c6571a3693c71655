//! Maps a key to the slot of its object in the culler's lists, and to the object's number in the index.

use std::{
    collections::HashMap,
    fmt::Debug,
    hash::{BuildHasherDefault, Hash},
};

use crate::{
    key_hasher::KeyHasher,
    polygon::{PolygonId, bits},
};

/// The index of an object in the culler's own lists. Its type is [`PolygonId`], because these lists are of type
/// [`ById`](crate::polygon::ById).
pub(super) type Slot = PolygonId;

/// The engine's key of an object: any type that is `Copy + Eq + Hash`, which costs a hash lookup in each call, or
/// [`Dense`] without a lookup.
///
/// Hashed keys get internal numbers in spatial order, the best order for the index. [`Dense`] keys are internal
/// numbers, which the engine chooses.
pub trait Key: Copy {
    /// The map from keys to slots and numbers.
    #[doc(hidden)]
    type Places: Places<Self>;
}

/// A number as a key. Small numbers without gaps cost least. Objects that are drawn together should have neighbouring
/// numbers, because sixteen consecutive numbers make a block of the index. Numbers from [`PolygonId::LIMIT`] on are
/// refused.
///
/// The type does not implement `Hash`, because it needs no map.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Dense(pub u32);

impl Key for Dense {
    type Places = Numbers;
}

impl<K: Copy + Eq + Hash> Key for K {
    type Places = Map<K>;
}

/// A map from keys to slots and to numbers; see [`Key::Places`]. An object has a slot while the engine has the object, and
/// a number while the object is in the index.
pub trait Places<K>: Default {
    /// Whether [`Places::give_number`] chooses the numbers.
    const ARE_NUMBERED: bool;

    /// The slot of a key, if it has one.
    fn slot(&self, key: K) -> Option<Slot>;

    /// The slot of a key, or a new slot if the key has none; `None` if no slot is left.
    fn slot_or_new(&mut self, key: K) -> Option<Slot>;

    /// Frees the slot of a key. No other key gets this slot before [`Places::settle`].
    fn take(&mut self, key: K) -> Option<Slot>;

    /// Makes freed slots available again. Called when the index contains all changes.
    fn settle(&mut self);

    /// The number of the object in a slot, if the object may be in the index.
    fn number(&self, slot: Slot) -> Option<PolygonId>;

    /// Gives the object in a slot a number for the index.
    fn give_number(&mut self, slot: Slot) -> PolygonId;

    /// Sorts the free numbers before `coming` calls of [`Places::give_number`], if sorting is cheap. These calls then
    /// return ascending numbers.
    fn sort_numbers(&mut self, coming: usize);

    /// Frees the number of the object in a slot. Called when the object leaves the index.
    fn free(&mut self, slot: Slot);

    /// The key of the object with this number; `None` for a free number.
    fn key(&self, number: PolygonId) -> Option<K>;

    /// The slot of the object with this number.
    fn slot_of(&self, number: PolygonId) -> Option<Slot>;

    /// The key in a slot; `None` for a free slot.
    fn key_in(&self, slot: Slot) -> Option<K>;
}

/// The map of [`Dense`] keys: each number is its own slot.
#[derive(Clone, Debug, Default)]
pub struct Numbers {
    /// A bit for each number in the index.
    in_index: Vec<u64>,
}

impl Places<Dense> for Numbers {
    const ARE_NUMBERED: bool = false;

    #[inline]
    fn slot(&self, Dense(number): Dense) -> Option<Slot> {
        (number < PolygonId::LIMIT).then_some(PolygonId(number))
    }

    #[inline]
    fn slot_or_new(&mut self, key: Dense) -> Option<Slot> {
        self.slot(key)
    }

    #[inline]
    fn take(&mut self, key: Dense) -> Option<Slot> {
        self.slot(key)
    }

    fn settle(&mut self) {}

    #[inline]
    fn number(&self, slot: Slot) -> Option<PolygonId> {
        bits::contains(&self.in_index, slot.index()).then_some(slot)
    }

    fn give_number(&mut self, slot: Slot) -> PolygonId {
        if bits::words_for(slot.index() + 1) > self.in_index.len() {
            self.in_index.resize(bits::words_for(slot.index() + 1), 0);
        }
        bits::insert(&mut self.in_index, slot.index());
        slot
    }

    fn sort_numbers(&mut self, _: usize) {}

    fn free(&mut self, slot: Slot) {
        if self.number(slot).is_some() {
            bits::remove(&mut self.in_index, slot.index());
        }
    }

    #[inline]
    fn key(&self, number: PolygonId) -> Option<Dense> {
        Some(Dense(number.0))
    }

    #[inline]
    fn slot_of(&self, number: PolygonId) -> Option<Slot> {
        Some(number)
    }

    fn key_in(&self, slot: Slot) -> Option<Dense> {
        Some(Dense(slot.0))
    }
}

/// Stands for no number.
const NONE: PolygonId = PolygonId(u32::MAX);

/// Free numbers are sorted if their count is at most this multiple of the count of new objects. If it is larger, frames
/// with few new objects take longer. If it is smaller, objects that are inserted after many removals lie in more
/// blocks.
const FREE_TO_COMING: usize = 8;

/// The map of hashed keys, with their slots and numbers.
#[derive(Clone, Debug)]
pub struct Map<K> {
    slots: HashMap<K, Slot, BuildHasherDefault<KeyHasher>>,
    /// For each slot, the key, and the number or [`NONE`].
    objects: Vec<(Option<K>, PolygonId)>,
    free_slots: Vec<Slot>,
    /// Slots that were freed since the index was last updated.
    taken: Vec<Slot>,
    /// For each number, the key and its slot; `None` for a free number.
    keys: Vec<Option<(K, Slot)>>,
    free_numbers: Vec<PolygonId>,
}

impl<K> Default for Map<K> {
    fn default() -> Self {
        Self {
            slots: HashMap::default(),
            objects: Vec::new(),
            free_slots: Vec::new(),
            taken: Vec::new(),
            keys: Vec::new(),
            free_numbers: Vec::new(),
        }
    }
}

impl<K: Copy + Eq + Hash> Places<K> for Map<K> {
    const ARE_NUMBERED: bool = true;

    fn slot(&self, key: K) -> Option<Slot> {
        self.slots.get(&key).copied()
    }

    fn slot_or_new(&mut self, key: K) -> Option<Slot> {
        if let Some(slot) = self.slot(key) {
            return Some(slot);
        }
        let slot = match self.free_slots.pop() {
            Some(slot) => slot,
            None if self.objects.len() >= PolygonId::LIMIT as usize => return None,
            None => {
                self.objects.push((None, NONE));
                PolygonId(self.objects.len() as u32 - 1)
            }
        };
        self.objects[slot.index()].0 = Some(key);
        self.slots.insert(key, slot);
        Some(slot)
    }

    fn take(&mut self, key: K) -> Option<Slot> {
        let slot = self.slots.remove(&key)?;
        self.objects[slot.index()].0 = None;
        self.taken.push(slot);
        Some(slot)
    }

    fn settle(&mut self) {
        self.free_slots.append(&mut self.taken);
    }

    fn number(&self, slot: Slot) -> Option<PolygonId> {
        Some(self.objects[slot.index()].1).filter(|&number| number != NONE)
    }

    fn give_number(&mut self, slot: Slot) -> PolygonId {
        let number = self.free_numbers.pop().unwrap_or_else(|| {
            self.keys.push(None);
            PolygonId(self.keys.len() as u32 - 1)
        });
        let object = &mut self.objects[slot.index()];
        object.1 = number;
        self.keys[number.index()] = object.0.map(|key| (key, slot));
        number
    }

    fn sort_numbers(&mut self, coming: usize) {
        if self.free_numbers.len() <= coming.saturating_mul(FREE_TO_COMING) {
            // [`Places::give_number`] pops numbers from the end of the list.
            self.free_numbers.sort_unstable_by(|a, b| b.cmp(a));
        }
    }

    fn free(&mut self, slot: Slot) {
        let number = std::mem::replace(&mut self.objects[slot.index()].1, NONE);
        if let Some(of_number) = self.keys.get_mut(number.index()) {
            *of_number = None;
            self.free_numbers.push(number);
        }
    }

    fn key(&self, number: PolygonId) -> Option<K> {
        self.keys.get(number.index()).copied().flatten().map(|(key, _)| key)
    }

    fn slot_of(&self, number: PolygonId) -> Option<Slot> {
        self.keys.get(number.index()).copied().flatten().map(|(_, slot)| slot)
    }

    fn key_in(&self, slot: Slot) -> Option<K> {
        self.objects.get(slot.index())?.0
    }
}
