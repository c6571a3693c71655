use super::IndexError;
use crate::{math::Aabb, polygon::PolygonId};

/// Checks that the id and the box of a polygon can be inserted. All indexes call this before an insertion.
#[inline]
pub fn admit(id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
    admit_id(id)?;
    if bounds.is_valid() { Ok(()) } else { Err(IndexError::InvalidBounds(id)) }
}

/// Checks only the id, for an index that checks boxes while it converts them to its own form.
#[inline]
pub(crate) fn admit_id(id: PolygonId) -> Result<(), IndexError> {
    if id.0 < PolygonId::LIMIT { Ok(()) } else { Err(IndexError::IdBeyondLimit(id)) }
}
