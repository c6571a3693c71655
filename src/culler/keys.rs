//! Which place in the culler's lists each key has.

use std::{
    collections::HashMap,
    fmt::Debug,
    hash::{BuildHasherDefault, Hash, Hasher},
};

use crate::polygon::PolygonId;

/// What an engine may call its objects: anything `Copy + Eq + Hash`, which costs a look into a map for each call, or [`Dense`]
/// numbers, which cost none.
pub trait Key: Copy {
    /// Where the key of each object is kept.
    #[doc(hidden)]
    type Places: Places<Self>;
}

/// A number as a key. Small numbers without gaps cost least; objects that are drawn together should have neighbouring numbers,
/// because sixteen of them make a block of the index. Numbers from [`PolygonId::LIMIT`] on are refused.
///
/// It is not `Hash`: a map is what it saves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Dense(pub u32);

impl Key for Dense {
    type Places = Numbers;
}

impl<K: Copy + Eq + Hash> Key for K {
    type Places = Map<K>;
}

/// See [`Key::Places`].
pub trait Places<K>: Default {
    /// The place of a key.
    fn find(&self, key: K) -> Option<PolygonId>;

    /// The place of a key, which is given one if it has none; none if there is no place left.
    fn find_or_add(&mut self, key: K) -> Option<PolygonId>;

    /// Takes the place of a key, which nobody else is given before [`Places::settle`].
    fn take(&mut self, key: K) -> Option<PolygonId>;

    /// The key at a place, if it has not been taken.
    fn key(&self, place: PolygonId) -> Option<K>;

    /// The index has followed all changes: what was taken may be given away.
    fn settle(&mut self);
}

/// A number is its own place.
#[derive(Clone, Copy, Debug, Default)]
pub struct Numbers;

impl Places<Dense> for Numbers {
    fn find(&self, Dense(number): Dense) -> Option<PolygonId> {
        (number < PolygonId::LIMIT).then_some(PolygonId(number))
    }

    fn find_or_add(&mut self, number: Dense) -> Option<PolygonId> {
        self.find(number)
    }

    fn take(&mut self, number: Dense) -> Option<PolygonId> {
        self.find(number)
    }

    fn key(&self, place: PolygonId) -> Option<Dense> {
        Some(Dense(place.0))
    }

    fn settle(&mut self) {}
}

/// Places in the order in which keys come; those of keys that have gone come first.
#[derive(Clone, Debug)]
pub struct Map<K> {
    places: HashMap<K, PolygonId, BuildHasherDefault<KeyHasher>>,
    keys: Vec<Option<K>>,
    free: Vec<PolygonId>,
    /// Taken since the index was brought up to date.
    taken: Vec<PolygonId>,
}

impl<K> Default for Map<K> {
    fn default() -> Self {
        Self { places: HashMap::default(), keys: Vec::new(), free: Vec::new(), taken: Vec::new() }
    }
}

impl<K: Copy + Eq + Hash> Places<K> for Map<K> {
    fn find(&self, key: K) -> Option<PolygonId> {
        self.places.get(&key).copied()
    }

    fn find_or_add(&mut self, key: K) -> Option<PolygonId> {
        if let Some(place) = self.find(key) {
            return Some(place);
        }
        let place = match self.free.pop() {
            Some(place) => place,
            None if self.keys.len() >= PolygonId::LIMIT as usize => return None,
            None => {
                self.keys.push(None);
                PolygonId(self.keys.len() as u32 - 1)
            }
        };
        self.keys[place.index()] = Some(key);
        self.places.insert(key, place);
        Some(place)
    }

    fn take(&mut self, key: K) -> Option<PolygonId> {
        let place = self.places.remove(&key)?;
        self.keys[place.index()] = None;
        self.taken.push(place);
        Some(place)
    }

    fn key(&self, place: PolygonId) -> Option<K> {
        self.keys.get(place.index()).copied().flatten()
    }

    fn settle(&mut self) {
        // The last one is given away first: neighbours that went together come back together, in their order.
        self.free.extend(self.taken.drain(..).rev());
    }
}

/// Hashes keys of some bytes: a product for every eight bytes, whose two halves are mixed. Much faster than the hash of the standard
/// library, which also withstands keys that an enemy chooses.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct KeyHasher(u64);

/// Odd, and without a pattern: 2^64 divided by the golden ratio.
const FACTOR: u64 = 0x9E37_79B9_7F4A_7C15;

impl Hasher for KeyHasher {
    fn write(&mut self, bytes: &[u8]) {
        for part in bytes.chunks(8) {
            let mut word = [0; 8];
            word[..part.len()].copy_from_slice(part);
            self.write_u64(u64::from_le_bytes(word));
        }
    }

    fn write_u8(&mut self, number: u8) {
        self.write_u64(number.into());
    }

    fn write_u16(&mut self, number: u16) {
        self.write_u64(number.into());
    }

    fn write_u32(&mut self, number: u32) {
        self.write_u64(number.into());
    }

    fn write_u64(&mut self, number: u64) {
        let product = u128::from(self.0.rotate_left(32) ^ number ^ FACTOR) * u128::from(FACTOR);
        self.0 = product as u64 ^ (product >> 64) as u64;
    }

    fn write_usize(&mut self, number: usize) {
        self.write_u64(number as u64);
    }

    fn finish(&self) -> u64 {
        self.0
    }
}
