//! Morton codes of 63 bits and their radix sort.
//!
//! Source of the order: G. M. Morton, "A Computer Oriented Geodetic Data Base" (1966).

use glam::Vec3;

use super::top_down::box_of_centers;
use crate::item::Item;

/// Largest number of bits of an axis.
pub(crate) const MOST_BITS: u32 = 21;

pub(super) const CODE_BITS: u32 = 3 * MOST_BITS;

/// The code of a polygon, and the polygon's index among the items.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Key {
    pub(super) code: u64,
    pub(super) item: u32,
}

/// The keys, and a second array of the same size to sort into.
#[derive(Debug, Default)]
pub(super) struct MortonOrder {
    keys: Vec<Key>,
    other: Vec<Key>,
}

impl MortonOrder {
    /// The keys of all items along the Morton curve through the box around the items' centres. The sort is stable. Only the
    /// highest `bits` bits of an axis count, 1 to [`MOST_BITS`]; the others are 0.
    pub(super) fn sort(&mut self, items: &[Item], bits: u32) -> &[Key] {
        let counted = u32::MAX << (MOST_BITS - bits.clamp(1, MOST_BITS));
        let centers = box_of_centers(items);
        // Both corners are halved, because the edge of a huge box overflows.
        let least = centers.min * 0.5;
        let scale = Vec3::splat((1u32 << MOST_BITS) as f32) / (centers.max * 0.5 - least);
        let code = |item: &Item| {
            let cell = (item.bounds.center() * 0.5 - least) * scale;
            // If the box has no extent on an axis, the number is NaN, and NaN becomes 0.
            [cell.x, cell.y, cell.z].iter().enumerate().fold(0, |code, (axis, &x)| {
                code | spread(u64::from((x as u32).min((1 << MOST_BITS) - 1) & counted)) << (2 - axis)
            })
        };
        self.keys.clear();
        self.keys.extend(items.iter().enumerate().map(|(i, item)| Key { code: code(item), item: i as u32 }));
        self.radix_sort();
        &self.keys
    }

    /// Sorts by the least digit first, eight bits at a time. A digit that all keys share is skipped.
    fn radix_sort(&mut self) {
        self.other.clear();
        self.other.resize(self.keys.len(), Key { code: 0, item: 0 });
        let mut counts = [[0u32; 256]; 8];
        for key in &self.keys {
            for (digit, counts) in counts.iter_mut().enumerate() {
                counts[(key.code >> (8 * digit)) as usize & 255] += 1;
            }
        }
        for (digit, counts) in counts.iter_mut().enumerate() {
            if counts.iter().any(|&count| count as usize == self.keys.len()) {
                continue;
            }
            let mut next = 0;
            for count in counts.iter_mut() {
                next += std::mem::replace(count, next);
            }
            for key in &self.keys {
                let place = &mut counts[(key.code >> (8 * digit)) as usize & 255];
                self.other[*place as usize] = *key;
                *place += 1;
            }
            std::mem::swap(&mut self.keys, &mut self.other);
        }
    }

    pub(super) fn bytes(&self) -> usize {
        (self.keys.capacity() + self.other.capacity()) * size_of::<Key>()
    }
}

/// Moves bit `i` to bit `3 i`, for 21 bits.
fn spread(x: u64) -> u64 {
    let x = (x | x << 32) & 0x001f_0000_0000_ffff;
    let x = (x | x << 16) & 0x001f_0000_ff00_00ff;
    let x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
    let x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
    (x | x << 2) & 0x1249_2492_4924_9249
}

#[cfg(test)]
mod tests {
    use super::*;
    use osp::{math::Aabb, polygon::PolygonId};

    #[test]
    fn spread_moves_every_bit() {
        for bit in 0..MOST_BITS {
            assert_eq!(spread(1 << bit), 1 << (3 * bit));
        }
    }

    #[test]
    fn sorted_and_stable() {
        let items: Vec<Item> = (0..1000u32)
            .map(|i| {
                let p = Vec3::new((i * 7 % 50) as f32, (i * 11 % 3) as f32, (i * 13 % 170) as f32);
                Item { bounds: Aabb::new(p, p), id: PolygonId(i) }
            })
            .collect();
        let mut order = MortonOrder::default();
        let mut codes = [MOST_BITS, 2].map(|bits| {
            let keys = order.sort(&items, bits);
            assert_eq!(keys.len(), items.len());
            assert!(keys.windows(2).all(|w| (w[0].code, w[0].item) < (w[1].code, w[1].item)));
            keys.iter().map(|key| key.code).collect::<Vec<_>>()
        });
        codes.iter_mut().for_each(Vec::dedup);
        assert!(codes[0].len() > 64 && codes[1].len() <= 64, "two bits of three axes make 64 codes");
    }
}
