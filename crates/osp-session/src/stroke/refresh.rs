/// Smallest number of parts that are rebuilt at the end. Most strokes have fewer parts, so only long strokes are ever
/// out of date.
const LEAST: usize = 32;

/// Decides how many parts of a growing segment are rebuilt, if the shape of all parts depends on the segment's length.
/// Usually only the end is rebuilt, seldom the whole segment.
///
/// A part is rebuilt before the number of parts after it has doubled since its last build. The end therefore always has
/// its correct shape. Parts far from the end are slightly out of date until the stroke ends. A segment that grows to
/// `n` parts, one by one, costs about `n (2 log n + 32)` builds of a part.
#[derive(Clone, Debug, Default)]
pub(super) struct Refresh {
    /// Largest number of parts of the segment so far.
    count: usize,
    /// Length of the segment when it was last rebuilt as a whole, metres.
    whole_m: f32,
}

impl Refresh {
    /// Number of parts to rebuild at the end of a segment of `count` parts and this length.
    pub(super) fn parts(&mut self, count: usize, length_m: f32) -> usize {
        let before = self.count;
        self.count = before.max(count);
        // The largest power of two that has a multiple above the old count, up to the new count.
        let passed = (before ^ self.count).checked_ilog2().map_or(0, |bit| 1_usize << bit);
        let parts = LEAST + 4 * passed;
        if parts < count && length_m <= 1.25 * self.whole_m {
            return parts;
        }
        self.whole_m = self.whole_m.max(length_m);
        count
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_end_is_made_often_and_all_of_it_seldom() {
        const COUNT: usize = 1 << 14;
        let (mut refresh, mut made, mut whole) = (Refresh::default(), 0, 0);
        // Number of parts of the segment when each part was last rebuilt.
        let mut made_at = vec![0; COUNT];
        for count in 1..=COUNT {
            let parts = refresh.parts(count, count as f32);
            assert!(parts >= LEAST.min(count));
            made += parts;
            whole += usize::from(parts == count);
            made_at[count - parts..count].fill(count);
            for at in (0..count).step_by(97) {
                assert!(2 * (count - made_at[at]) < count - at, "part {at} of {count} is of {}", made_at[at]);
            }
        }
        assert!(made < 64 * COUNT && whole < 100, "{made} parts, {whole} times all");
        // A part that is removed and added again is no growth.
        for count in [COUNT - 1, COUNT, COUNT - 1, COUNT] {
            assert_eq!(refresh.parts(count, count as f32), LEAST);
        }
        assert_eq!(refresh.parts(COUNT, 1.3 * COUNT as f32), COUNT, "a leap");
    }
}
