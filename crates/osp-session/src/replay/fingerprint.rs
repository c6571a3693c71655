use xxhash_rust::xxh3::xxh3_64;

use osp::polygon::PolygonId;

/// A fingerprint of a frame's visible set. It does not depend on the order of the polygons. A polygon that is listed
/// twice changes the fingerprint.
pub fn fingerprint_of_frame(ids: impl IntoIterator<Item = PolygonId>) -> u64 {
    SetFingerprint::of(ids).value()
}

/// The fingerprint of a set whose polygons are added in parts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SetFingerprint {
    // A sum, because it does not depend on the order.
    sum: u64,
    count: u64,
}

impl SetFingerprint {
    pub fn of(ids: impl IntoIterator<Item = PolygonId>) -> Self {
        // Each id is hashed first, so that sets with equal sums of ids differ. The hash is the finaliser of Steele, Lea
        // and Flood, "Fast splittable pseudorandom number generators", 2014.
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

    pub fn add(&mut self, other: Self) {
        self.sum = self.sum.wrapping_add(other.sum);
        self.count += other.count;
    }

    pub fn count(&self) -> u64 {
        self.count
    }

    /// The fingerprint as a number, equal to that of [`fingerprint_of_frame`].
    pub fn value(&self) -> u64 {
        self.sum ^ self.count.wrapping_mul(0xd6e8_feb8_6659_fd93)
    }
}

/// A fingerprint of the visible sets of a frame's views, in the views' order. For a single view it equals
/// [`fingerprint_of_frame`].
pub fn fingerprint_of_views<V: IntoIterator<Item = PolygonId>>(views: impl IntoIterator<Item = V>) -> u64 {
    views.into_iter().fold(0, |all, view| all.rotate_left(1) ^ fingerprint_of_frame(view))
}

/// A hash over the fingerprints of a session's frames, in order.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SessionFingerprint {
    hash: u64,
    frames: u64,
}

impl SessionFingerprint {
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds the fingerprint of frame number `frame`. The number is hashed, too, so that skipped frames change the
    /// result.
    pub fn add(&mut self, frame: u64, fingerprint: u64) {
        let mut bytes = [0u8; 24];
        bytes[..8].copy_from_slice(&self.hash.to_le_bytes());
        bytes[8..16].copy_from_slice(&frame.to_le_bytes());
        bytes[16..].copy_from_slice(&fingerprint.to_le_bytes());
        self.hash = xxh3_64(&bytes);
        self.frames += 1;
    }

    pub fn value(&self) -> u64 {
        self.hash
    }

    pub fn frames(&self) -> u64 {
        self.frames
    }
}
