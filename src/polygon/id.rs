/// A polygon's number, chosen by the caller: below [`PolygonId::LIMIT`], one polygon a number. Small numbers without gaps
/// cost least, because several structures keep an array by number: map sparse or 64-bit keys to the places of an array. Objects
/// that are drawn together should have neighbouring numbers, because sixteen of them make a block of the answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(transparent)]
pub struct PolygonId(pub u32);

impl PolygonId {
    /// Every index refuses numbers from this limit on, and every set leaves them out. A stray number takes some
    /// megabytes at most: a set has a bit for each number up to the highest, an index a list of pages. Larger: both
    /// take more memory. Two days of drawing tubes at 90 samples a second make 2^27 polygons. Two rivals that are
    /// plain arrays, `brute-simd` and `time-order`, take 24 bytes for each number up to the highest.
    pub const LIMIT: u32 = 1 << 27;

    /// The number as a place in an array.
    pub fn index(self) -> usize {
        self.0 as usize
    }

    /// The numbers of several polygons in one slice, in the form of a GPU buffer; nothing is copied.
    #[expect(unsafe_code, reason = "a slice of numbers is seen as one of integers")]
    pub fn numbers(ids: &[Self]) -> &[u32] {
        // SAFETY: the type is transparent: both slices have the same layout, and all bits are valid in both.
        unsafe { std::slice::from_raw_parts(ids.as_ptr().cast(), ids.len()) }
    }
}
