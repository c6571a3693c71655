/// Counts of dropped samples and polygons, by reason.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Drops {
    /// Samples at the place of the one before: a segment of length zero.
    pub zero_length: u64,
    /// Polygons without area: needles and points, or a width of zero.
    pub degenerate: u64,
    /// Polygons whose corners are not finite or beyond [`osp::math::COORDINATE_LIMIT_M`].
    pub out_of_range: u64,
    /// Corners of a wall beyond [`crate::recording::Event::MAX_VERTICES`]: each replaces the one before it.
    pub excess_corners: u64,
    /// Particles and squares of a spray beyond [`MAX_SCATTERED`](crate::brush::MAX_SCATTERED) on the way to one sample.
    pub excess_pieces: u64,
}
