//! Maps a key to the slot of its object in the culler's lists, and to the object's number in the index.

use std::{
    collections::HashMap,
    fmt::Debug,
    hash::{BuildHasher, Hash},
    num::NonZeroU32,
};

use crate::polygon::{ById, PolygonId};

/// The index of an object in the culler's own lists. Its type is [`PolygonId`], because these lists are of type
/// [`ById`].
pub(super) type Slot = PolygonId;

/// The engine's key of an object: any type that is `Copy + Eq + Hash`, which costs a hash lookup in each call, or
/// [`Dense`] without a lookup. A [`Handle`] needs no lookup, either.
///
/// Hashed keys get internal numbers in spatial order, the best order for the index. [`Dense`] keys are internal
/// numbers, which the engine chooses.
pub trait Key: Copy {
    /// The map from keys to slots and numbers.
    #[doc(hidden)]
    type Places<S: BuildHasher>: Places<Self, S>;
}

/// A number as a key. Small numbers without gaps cost least. Objects that are drawn together should have neighbouring
/// numbers, because sixteen consecutive numbers make a block of the index. Numbers from [`PolygonId::LIMIT`] on are
/// refused.
///
/// The type does not implement `Hash`, because it needs no map.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Dense(pub u32);

/// The name that a culler gives to an object: a slot and a generation. Calls with a handle need no map. After the object
/// has been removed, its handle names nothing, and never another object of the culler. An empty culler that takes over
/// another one ([`Culler::append`](super::Culler::append)) takes over the other's handles: use none of its own from before.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Handle {
    slot: u32,
    generation: NonZeroU32,
}

impl Handle {
    /// The handle as a number, which is not 0.
    pub fn to_bits(self) -> u64 {
        u64::from(self.generation.get()) << 32 | u64::from(self.slot)
    }

    /// The handle of [`Handle::to_bits`]; `None` if no handle has these bits.
    pub fn from_bits(bits: u64) -> Option<Self> {
        Some(Self { slot: bits as u32, generation: NonZeroU32::new((bits >> 32) as u32)? })
    }
}

impl Key for Dense {
    type Places<S: BuildHasher> = Numbers;
}

impl<K: Copy + Eq + Hash> Key for K {
    type Places<S: BuildHasher> = Map<K, S>;
}

/// A map from keys to slots and to numbers; see [`Key::Places`]. An object has a slot while the engine has the object, and
/// a number while the object is in the index.
pub trait Places<K, S> {
    /// Whether [`Places::give_number`] chooses the numbers.
    const ARE_NUMBERED: bool;

    /// An empty map.
    fn new(hasher: S) -> Self;

    /// The slot of a key, if it has one.
    fn slot(&self, key: K) -> Option<Slot>;

    /// The slot of a key, or a new slot if the key has none; `None` if no slot is left.
    fn slot_or_new(&mut self, key: K) -> Option<Slot>;

    /// Frees the slot of a key, and ends its generation.
    fn take(&mut self, key: K) -> Option<Slot>;

    /// The handle of the object in a slot.
    fn handle(&self, slot: Slot) -> Option<Handle>;

    /// The slot that a handle names; `None` if its object has been removed.
    fn slot_at(&self, handle: Handle) -> Option<Slot>;

    /// The number of the object in a slot, if the object may be in the index.
    fn number(&self, slot: Slot) -> Option<PolygonId>;

    /// The number of the object in a slot, or a new number for the index.
    fn give_number(&mut self, slot: Slot) -> PolygonId;

    /// Sorts the free numbers before `coming` calls of [`Places::give_number`], if sorting is cheap. These calls then
    /// return ascending numbers.
    fn sort_numbers(&mut self, coming: usize);

    /// Frees the number of the object in a slot. Called when the object leaves the index.
    fn free(&mut self, slot: Slot);

    /// The key of the object that has this number, or had it last.
    fn key(&self, number: PolygonId) -> K;

    /// The slot of the object that has this number, or had it last.
    fn slot_of(&self, number: PolygonId) -> Slot;

    /// The key in a slot; `None` for a free slot.
    fn key_in(&self, slot: Slot) -> Option<K>;

    /// Makes room for this number of further objects.
    fn reserve(&mut self, objects: usize);

    /// Frees all slots and numbers, and ends all generations.
    fn clear(&mut self);
}

/// The map of [`Dense`] keys: each number is its own slot.
#[derive(Clone, Debug)]
pub struct Numbers {
    /// For each number, how often its object has been removed; and how often all have been.
    removals: ById<u32>,
    clears: u32,
}

impl<S> Places<Dense, S> for Numbers {
    const ARE_NUMBERED: bool = false;

    fn new(_: S) -> Self {
        Self { removals: ById::new(0), clears: 0 }
    }

    #[inline]
    fn slot(&self, Dense(number): Dense) -> Option<Slot> {
        (number < PolygonId::LIMIT).then_some(PolygonId(number))
    }

    #[inline]
    fn slot_or_new(&mut self, key: Dense) -> Option<Slot> {
        Places::<Dense, S>::slot(self, key)
    }

    fn take(&mut self, key: Dense) -> Option<Slot> {
        let slot = Places::<Dense, S>::slot(self, key)?;
        self.removals.set(slot, self.removals.get(slot).saturating_add(1));
        Some(slot)
    }

    fn handle(&self, slot: Slot) -> Option<Handle> {
        // Later generations have no handle, because further removals would not end them.
        let generation = self.removals.get(slot).checked_add(self.clears)?.checked_add(1)?;
        Some(Handle { slot: slot.0, generation: NonZeroU32::new(generation)? })
    }

    #[inline]
    fn slot_at(&self, Handle { slot, generation }: Handle) -> Option<Slot> {
        let slot = Some(PolygonId(slot)).filter(|slot| slot.0 < PolygonId::LIMIT)?;
        let removals = self.removals.get(slot).saturating_add(self.clears);
        (removals == generation.get() - 1).then_some(slot)
    }

    #[inline]
    fn number(&self, slot: Slot) -> Option<PolygonId> {
        Some(slot)
    }

    fn give_number(&mut self, slot: Slot) -> PolygonId {
        slot
    }

    fn sort_numbers(&mut self, _: usize) {}

    fn free(&mut self, _: Slot) {}

    #[inline]
    fn key(&self, number: PolygonId) -> Dense {
        Dense(number.0)
    }

    #[inline]
    fn slot_of(&self, number: PolygonId) -> Slot {
        number
    }

    fn key_in(&self, slot: Slot) -> Option<Dense> {
        Some(Dense(slot.0))
    }

    fn reserve(&mut self, _: usize) {}

    fn clear(&mut self) {
        self.clears = self.clears.saturating_add(1);
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
pub struct Map<K, S> {
    slots: HashMap<K, Slot, S>,
    /// For each slot, its generation, and the number or [`NONE`].
    objects: Vec<(NonZeroU32, PolygonId)>,
    /// For each slot, the key; `None` for a free slot.
    owners: Vec<Option<K>>,
    free_slots: Vec<Slot>,
    /// For each number, the key and the slot of its last object.
    keys: Vec<K>,
    slots_of: Vec<Slot>,
    free_numbers: Vec<PolygonId>,
}

impl<K: Copy + Eq + Hash, S: BuildHasher> Places<K, S> for Map<K, S> {
    const ARE_NUMBERED: bool = true;

    fn new(hasher: S) -> Self {
        Self {
            slots: HashMap::with_hasher(hasher),
            objects: Vec::new(),
            owners: Vec::new(),
            free_slots: Vec::new(),
            keys: Vec::new(),
            slots_of: Vec::new(),
            free_numbers: Vec::new(),
        }
    }

    #[inline]
    fn slot(&self, key: K) -> Option<Slot> {
        self.slots.get(&key).copied()
    }

    #[inline]
    fn slot_or_new(&mut self, key: K) -> Option<Slot> {
        if let Some(slot) = self.slot(key) {
            return Some(slot);
        }
        let slot = match self.free_slots.pop() {
            Some(slot) => slot,
            None if self.objects.len() >= PolygonId::LIMIT as usize => return None,
            None => {
                self.objects.push((NonZeroU32::MIN, NONE));
                self.owners.push(None);
                PolygonId(self.objects.len() as u32 - 1)
            }
        };
        self.owners[slot.index()] = Some(key);
        self.slots.insert(key, slot);
        Some(slot)
    }

    fn take(&mut self, key: K) -> Option<Slot> {
        let slot = self.slots.remove(&key)?;
        self.owners[slot.index()] = None;
        let generation = &mut self.objects[slot.index()].0;
        // A slot whose generations are used up is not used again.
        if let Some(next) = generation.checked_add(1) {
            *generation = next;
            self.free_slots.push(slot);
        }
        Some(slot)
    }

    fn handle(&self, slot: Slot) -> Option<Handle> {
        let generation = self.objects.get(slot.index())?.0;
        Some(Handle { slot: slot.0, generation })
    }

    #[inline]
    fn slot_at(&self, Handle { slot, generation }: Handle) -> Option<Slot> {
        let &(of_slot, number) = self.objects.get(slot as usize)?;
        // A free slot has no owner: its last generation has no end, and its next one has no handle yet.
        let is_there = of_slot == generation && (number != NONE || self.owners[slot as usize].is_some());
        is_there.then_some(PolygonId(slot))
    }

    #[inline]
    fn number(&self, slot: Slot) -> Option<PolygonId> {
        Some(self.objects[slot.index()].1).filter(|&number| number != NONE)
    }

    fn give_number(&mut self, slot: Slot) -> PolygonId {
        let (Some(key), None) = (self.owners[slot.index()], self.number(slot)) else {
            return self.objects[slot.index()].1;
        };
        let number = match self.free_numbers.pop() {
            Some(number) => {
                (self.keys[number.index()], self.slots_of[number.index()]) = (key, slot);
                number
            }
            None => {
                self.keys.push(key);
                self.slots_of.push(slot);
                PolygonId(self.keys.len() as u32 - 1)
            }
        };
        self.objects[slot.index()].1 = number;
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
        if number != NONE {
            self.free_numbers.push(number);
        }
    }

    #[inline]
    fn key(&self, number: PolygonId) -> K {
        self.keys[number.index()]
    }

    #[inline]
    fn slot_of(&self, number: PolygonId) -> Slot {
        self.slots_of[number.index()]
    }

    fn key_in(&self, slot: Slot) -> Option<K> {
        *self.owners.get(slot.index())?
    }

    fn reserve(&mut self, objects: usize) {
        self.slots.reserve(objects);
        self.objects.reserve(objects);
        self.owners.reserve(objects);
        self.keys.reserve(objects);
        self.slots_of.reserve(objects);
    }

    fn clear(&mut self) {
        let keys: Vec<K> = self.owners.iter().flatten().copied().collect();
        for key in keys {
            if let Some(slot) = self.take(key) {
                self.objects[slot.index()].1 = NONE;
            }
        }
        self.keys.clear();
        self.slots_of.clear();
        self.free_numbers.clear();
    }
}
