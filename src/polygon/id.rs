/// A polygon's number, chosen by the caller, below [`PolygonId::LIMIT`] and unique. Small numbers without gaps cost
/// least, because several structures keep an array by number. A caller with sparse or 64-bit keys has to map them to
/// array indices. Objects that are drawn together should have neighbouring numbers, because a query tests and returns
/// blocks of sixteen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(transparent)]
pub struct PolygonId(pub u32);

impl PolygonId {
    /// Every index refuses numbers from this limit on, and every set omits them. A single large number takes at most
    /// some megabytes: a set has a bit for each number up to the highest, and an index a list of pages. If the limit is
    /// larger, both may take more memory. Two days of drawing tubes at 90 samples a second make 2^27 polygons. Two
    /// rivals that are plain arrays, `brute-simd` and `time-order`, take 24 bytes for each number up to the highest.
    pub const LIMIT: u32 = 1 << 27;

    /// The number as an index of an array.
    pub fn index(self) -> usize {
        self.0 as usize
    }

    /// The numbers of polygons in one slice, in the form of a GPU buffer, without a copy.
    #[expect(unsafe_code, reason = "a slice of numbers is seen as one of integers")]
    pub fn numbers(ids: &[Self]) -> &[u32] {
        // SAFETY: the type is transparent: both slices have the same layout, and all bits are valid in both.
        unsafe { std::slice::from_raw_parts(ids.as_ptr().cast(), ids.len()) }
    }
}
