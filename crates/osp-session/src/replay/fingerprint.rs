use xxhash_rust::xxh3::xxh3_64;

use osp::polygon::PolygonId;

/// A number for a frame's visible set: equal for equal sets, whatever their order; a polygon reported twice changes it.
pub fn fingerprint_of_frame(ids: impl IntoIterator<Item = PolygonId>) -> u64 {
    SetFingerprint::of(ids).value()
}

/// The fingerprint of a set that is gathered in parts, as they come.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SetFingerprint {
    // A sum does not depend on the order.
    sum: u64,
    count: u64,
}

impl SetFingerprint {
    /// Fingerprint of some polygons.
    pub fn of(ids: impl IntoIterator<Item = PolygonId>) -> Self {
        // Each id is mixed first (the finaliser of Steele, Lea and Flood, "Fast splittable pseudorandom number
        // generators", 2014) so that sets with equal sums of ids differ.
        let mixed = |id: PolygonId| {
            let mut x = (u64::from(id.0) + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            x ^ (x >> 31)
        };
        let add = |(sum, count): (u64, u64), id| (sum.wrapping_add(mixed(id)), count + 1);
        let (sum, count) = ids.into_iter().fold((0, 0), add);
        Self { sum, count }
    }

    /// Adds polygons that were not among those before.
    pub fn add(&mut self, other: Self) {
        self.sum = self.sum.wrapping_add(other.sum);
        self.count += other.count;
    }

    /// Polygons of the set.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// The number, which is that of [`fingerprint_of_frame`].
    pub fn value(&self) -> u64 {
        self.sum ^ self.count.wrapping_mul(0xd6e8_feb8_6659_fd93)
    }
}

/// A number for the polygons that the views of a frame see, in the views' order; of one view, the number of
/// [`fingerprint_of_frame`].
pub fn fingerprint_of_views<V: IntoIterator<Item = PolygonId>>(views: impl IntoIterator<Item = V>) -> u64 {
    views.into_iter().fold(0, |all, view| all.rotate_left(1) ^ fingerprint_of_frame(view))
}

/// The fingerprints of a session's frames, chained.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SessionFingerprint {
    hash: u64,
    frames: u64,
}

impl SessionFingerprint {
    /// Fingerprint of no frame.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a frame by its number, so that a session measured on some frames only differs from one measured on all.
    pub fn add(&mut self, frame: u64, fingerprint: u64) {
        let mut bytes = [0u8; 24];
        bytes[..8].copy_from_slice(&self.hash.to_le_bytes());
        bytes[8..16].copy_from_slice(&frame.to_le_bytes());
        bytes[16..].copy_from_slice(&fingerprint.to_le_bytes());
        self.hash = xxh3_64(&bytes);
        self.frames += 1;
    }

    /// The number.
    pub fn value(&self) -> u64 {
        self.hash
    }

    /// Frames added.
    pub fn frames(&self) -> u64 {
        self.frames
    }
}
