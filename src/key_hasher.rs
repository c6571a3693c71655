use std::hash::{BuildHasherDefault, Hasher};

/// A hash for short keys. Each eight bytes are combined with the hash by XOR and multiplied by [`FACTOR`]; both halves
/// of the product are combined by XOR. It is much faster than the hash of the standard library, but does not withstand
/// keys chosen by an attacker.
#[derive(Clone, Copy, Debug, Default)]
pub struct KeyHasher(u64);

/// The default hash of a culler's keys: fast, but not made for keys that an attacker chooses.
pub type FastHash = BuildHasherDefault<KeyHasher>;

/// 2^64 divided by the golden ratio: an odd number without a pattern.
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
