/// Counts of dropped samples and polygons, by reason.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Drops {
    /// Samples at the position of the previous sample. Their segment has length zero.
    pub zero_length: u64,
    /// Polygons without area: needles, points, or polygons of width zero.
    pub degenerate: u64,
    /// Polygons with corners that are not finite or beyond [`osp::math::COORDINATE_LIMIT_M`].
    pub out_of_range: u64,
    /// Corners of a wall beyond [`crate::recording::Event::MAX_VERTICES`]. Each such corner replaces the last corner.
    pub excess_corners: u64,
    /// Particles and squares of a spray beyond [`MAX_SCATTERED`](crate::brush::MAX_SCATTERED) between two samples.
    pub excess_pieces: u64,
}
