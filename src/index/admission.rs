use super::{IndexError, simd::Wide};
use crate::{math::Aabb, polygon::PolygonId};

/// Checks that the id and the box of a polygon can be inserted. All indexes call this before an insertion.
#[inline]
pub fn admit(id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
    if id.0 >= PolygonId::LIMIT {
        return Err(IndexError::IdBeyondLimit(id));
    }
    if Wide::from_box(bounds).is_valid() { Ok(()) } else { Err(IndexError::InvalidBounds(id)) }
}
